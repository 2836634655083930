"""Calibration of named parameters that several joints or rods share."""

import re

import numpy as np
import pytest

from chasles.calibration import Positions, identify
from chasles.derive import derive, read_text
from tests.support.compiling import compiled
from tests.support.derivations import description

NOISE = 2e-5
"""Standard deviation of a measured coordinate [m]."""
CHANGED = {"r_b": 0.2017, "l_r_2": 0.7988, "tower_2": np.radians(120.4)}
"""True values: radius of the base, length of one pair of rods, and angle of one tower."""


def delta_text():
    text = description("delta").read_text(encoding="utf-8")
    text = text.replace('name = "delta"', 'name = "named_delta"')
    text = text.replace(
        "l_r = {", "l_r_2 = { value = 800 }\ntower_2 = { value = 120, unit = 'deg' }\nl_r = {"
    )
    text = re.sub(r'(name = "rod_2_\w+"\nlength = )"l_r"', r'\1"l_r_2"', text)
    text = text.replace(
        '["r_b*cos(120)", "r_b*sin(120)", 0]\nrpy = [0, 0, 120]',
        '["r_b*cos(tower_2)", "r_b*sin(tower_2)", 0]\nrpy = [0, 0, "tower_2"]',
    )
    assert text.count("l_r_2") == 3
    assert text.count('"tower_2"') == 1
    return text


def robots(text, changed, folder):
    """Compile a nominal and a changed robot."""
    built = text
    for old, new in changed.items():
        assert built.count(old) == 1
        built = built.replace(old, new)
    functions = ["fk", "fk_p", "identification_jacobian"]
    nominal = compiled(read_text(text), folder / "nominal", functions, ["c"])
    return nominal, compiled(read_text(built), folder / "built", ["fk", "fk_p"], ["c"])


@pytest.fixture(scope="module")
def delta(tmp_path_factory):
    """Return the nominal robot and the robot as built."""
    changed = {
        "r_b = { value = 200": "r_b = { value = 201.7",
        "l_r_2 = { value = 800": "l_r_2 = { value = 798.8",
        "value = 120,": "value = 120.4,",
    }
    return robots(delta_text(), changed, tmp_path_factory.mktemp("named"))


def geometry(robot, changed):
    return np.array([changed.get(item.name, item.value) for item in robot.geometry])


def test_parameters_of_the_file_come_first(delta):
    named = [item for item in delta[0].geometry if item.part == "parameter"]
    assert [item.name for item in named] == ["r_b", "l_a", "l_r_2", "tower_2", "l_r", "r_p", "w"]
    assert delta[0].geometry[0].name in {item.name for item in named}
    assert {item.name: item.unit for item in named}["tower_2"] == "rad"


def test_changed_parameters_give_the_robot_of_the_changed_file(delta):
    nominal, built = delta
    q = np.random.default_rng(0).uniform(-0.3, 0.8, (50, 3))
    found = nominal.fk_p(q, np.tile(geometry(nominal, CHANGED), (50, 1)))
    np.testing.assert_allclose(found, built.fk(q), atol=1e-12)
    assert np.abs(found - nominal.fk(q)).max() > 1e-3
    others = np.array([item.part != "parameter" for item in nominal.geometry])
    step = others * np.random.default_rng(1).uniform(-1e-3, 1e-3, len(others))
    both = nominal.fk_p(q, geometry(nominal, CHANGED) + step)
    np.testing.assert_allclose(both, built.fk_p(q, geometry(built, {}) + step), atol=1e-12)


def test_identified_parameters_are_within_their_intervals(delta):
    nominal, built = delta
    q = np.random.default_rng(1).uniform(-0.4, 0.9, (40, 3))
    inside = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        measured = built.fk(q)[:, None, :3, 3] + rng.normal(0, NOISE, (40, 1, 3))
        found = identify(nominal, q, Positions(measured), vary=list(CHANGED), T_W_base=np.eye(4))
        names = list(found.names)
        rows = [names.index(name) for name in CHANGED]
        low, high = found.confidence_intervals[rows].T
        inside += ((low <= [*CHANGED.values()]) & ([*CHANGED.values()] <= high)).sum()
        np.testing.assert_allclose(found.values[rows], [*CHANGED.values()], atol=3e-4)
    # Each of the 24 intervals contains the true value with probability 0.95. The probability that
    # fewer than 20 intervals contain the true value is 0.5 %.
    assert inside >= 20


def test_a_parameter_of_an_arm_moves_every_joint_that_uses_it(tmp_path):
    text = description("puma560").read_text(encoding="utf-8")
    text = text.replace('d = "d4"', 'd = "d4 + a2/2"').replace('d = "d3"', 'd = "d3 + a2"')
    changed = {'a2 = { value = "0.4318"': 'a2 = { value = "0.4331"'}
    nominal, built = robots(text, changed, tmp_path)
    q = np.random.default_rng(0).uniform(-2, 2, (40, 6))
    p = geometry(nominal, {"a2": 0.4331})
    np.testing.assert_allclose(nominal.fk_p(q, np.tile(p, (40, 1))), built.fk(q), atol=1e-12)
    step = 1e-6 * (np.array([item.name for item in nominal.geometry]) == "a2")
    slope = (nominal.fk_p(q, p + step) - nominal.fk_p(q, p - step))[:, :3, 3] / 2e-6
    J = nominal.identification_jacobian(q, np.tile(p, (40, 1)))
    np.testing.assert_allclose(J[:, :3, step > 0][..., 0], slope, atol=1e-8)


def test_names_of_groups_and_corrections_stay_unique():
    text = description("scara").read_text(encoding="utf-8")
    text = text.replace('"d1"', '"base"').replace("d1 = {", "base = {")
    text = text.replace('"a1"', '"shoulder_gain"').replace("a1 = {", "shoulder_gain = {")
    derived = derive(read_text(text), functions=["fk_p"])
    names = [item.name for item in derived.geometry.parameters]
    assert len(set(names)) == len(names)
    assert {"base_parameter", "shoulder_gain_parameter", "shoulder_gain"} <= {*names}


PALLETIZER = """\
name = "palletizer"
convention = "dh"
units = { length = "m", angle = "rad" }
joints = [
  { name = "j1", d = "0.4", alpha = "pi/2" },
  { name = "j2", a = "0.6" },
  { name = "j3", a = "0.5" },
]
[couplings]
j2 = { motor2 = "1/60" }
j3 = { motor3 = "1/50", motor2 = "-1/60" }
"""
WORN = {"j2_per_motor2": 1 / 60.1, "j3_per_motor2": -1 / 60.2, "j3_per_motor3": 1 / 49.9}


def test_identified_ratios_of_couplings_are_within_their_intervals(tmp_path):
    changed = {'j2 = { motor2 = "1/60" }': 'j2 = { motor2 = "1/60.1" }'}
    changed |= {'motor3 = "1/50", motor2 = "-1/60"': 'motor3 = "1/49.9", motor2 = "-1/60.2"'}
    nominal, built = robots(PALLETIZER, changed, tmp_path)
    ratios = [item.name for item in nominal.geometry if item.part == "coupling"]
    assert ratios == list(WORN)
    rng = np.random.default_rng(2)
    q = rng.uniform(-1, 1, (40, 3)) * [2, 60, 60]
    p = np.tile(geometry(nominal, WORN), (40, 1))
    np.testing.assert_allclose(nominal.fk_p(q, p), built.fk(q), atol=1e-13)
    measured = built.fk(q)[:, None, :3, 3] + rng.normal(0, NOISE, (40, 1, 3))
    found = identify(nominal, q, Positions(measured), vary="coupling", T_W_base=np.eye(4))
    rows = [found.names.index(name) for name in WORN]
    low, high = found.confidence_intervals[rows].T
    true = np.array([*WORN.values()])
    assert ((low <= true) & (true <= high)).all()
    # The confidence intervals exclude the nominal ratios, so the wear is detected.
    at = np.array([1 / 60, -1 / 60, 1 / 50])
    assert ((at < low) | (at > high)).all()
