"""Couplings: joint values as linear functions of motor values, and the inverse functions."""

import re
from functools import cache
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from chasles.derive import DescriptionError, derive, explain, read, read_text
from chasles.derive.latex import files
from chasles.derive.program.programs import NO_PROGRAMS
from tests.support.generators.coupled_arms import coupled_arm
from tests.support.generators.synthetic import Function
from tests.support.oracles.matrix_product import product_errors

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "couplings.md"
PAGES = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
FILES = [text for text in PAGES if "[[closures]]" not in text]
ROUNDING = 1e-13
IK = "fk", "ik"
ARM = """\
name = "arm"
convention = "dh"
joints = [
  { name = "a", a = "0.3" },
  { name = "b", a = "0.2" },
  { name = "c", type = "prismatic" },
]
"""
TELESCOPE = """\
name = "telescope"
convention = "dh"
joints = [
  { name = "turn", alpha = "pi/2" },
  { name = "lift", alpha = "pi/2", a = "0.3" },
  { name = "inner", type = "prismatic", d = "0.5" },
  { name = "middle", type = "prismatic", d = "0.1" },
  { name = "outer", type = "prismatic", d = "0.1" },
]
[couplings]
middle = { inner = 1 }
outer = { middle = 1 }
"""


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 12, 20])
def test_coupled_arm_equals_the_matrix_product(seed):
    found = product_errors(coupled_arm(seed), 3, np.random.default_rng(seed))
    assert max(found.pose, found.jacobian, found.rate, found.maps) < ROUNDING
    assert found.lost == 0
    assert found.solutions > 0 or seed % 2


@pytest.mark.parametrize("text", FILES, ids=lambda text: text.split('"')[1])
def test_ik_of_documented_arms_recovers_motor_coordinates(text):
    _check_inclusion(derive(read_text(text), functions=IK), 1000)


def test_documented_arms_include_each_kind_of_gear():
    kinds = {"bevel_wrist", "planetary_wrist", "geared_wrist", "paint_wrist"}
    assert kinds <= {text.split('"')[1] for text in FILES}


@pytest.mark.parametrize(
    ("angles", "ratio"),
    [((35, -70, 35), 1), ((35, -70, 35), -1), ((30, -80, 40), 1), ((60, 60, 60), -1)],
)
def test_ik_of_hollow_wrist_recovers_motor_coordinates(angles, ratio):
    found = derived(angles, ratio)
    assert found.inverse.classification.found.family.has_couplings
    _check_inclusion(found, 1000)


@pytest.mark.parametrize("shift", [0, 1e-13, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("angle", [0, np.pi])
def test_straight_and_folded_hollow_wrist_reaches_the_pose(angle, shift):
    for ratio in (1, -1):
        fk, ik = kernels((35, -70, 35), ratio)
        q = np.random.default_rng(1).uniform(-1.5, 1.5, (100, 6))
        q[:, 4] = angle + shift
        T = np.array(fk.kernel(ca.DM(q.T))).T.reshape(-1, 4, 4)
        assert ik(T).valid.any(axis=1).all()


def test_hollow_wrist_on_the_first_axis_reaches_the_pose():
    """A wrist center on the first joint axis does not determine the first joint value."""
    text = next(text for text in FILES if "paint_wrist" in text).replace("a = 300, ", "")
    found = derive(read_text(text), functions=IK)
    fk, ik = (Function(found.function(name)) for name in IK)
    q = np.random.default_rng(3).uniform(-3, 3, (200, 6))
    q[:, 2] = np.arcsin(-1.2 / 1.4 * np.cos(q[:, 1])) - q[:, 1]
    T = np.array(fk.kernel(ca.DM(q.T))).T.reshape(-1, 4, 4)
    assert np.abs(T[:, :2, 3] - 0.15 * T[:, :2, 2]).max() < 1e-12
    assert ik(T).valid.any(axis=1).all()


def test_explanation_of_hollow_wrist_states_that_steps_include_couplings():
    angles, ratio = (35, -70, 35), -1
    text = str(explain(hollow_wrist(angles, ratio)))
    assert "a wrist with opposite angles 5 and 6" in text
    assert "The steps include the couplings." in text
    article = files(derived(angles, ratio), NO_PROGRAMS)["latex/inverse.tex"]
    assert "The steps of this structure include the joint couplings." in article


def test_hollow_wrist_without_common_point_has_no_closed_form():
    text = next(text for text in FILES if "paint_wrist" in text)
    line = explain(read_text(text.replace("alpha = -70", "alpha = -70, d = 90"))).line
    assert line.startswith("no closed-form inverse: j5b follows other coordinates")


def hollow_wrist(angles, ratio):
    text = next(text for text in FILES if "paint_wrist" in text)
    for old, new in zip(("= 35 }", "= -70 }", "= 35 }"), angles, strict=True):
        text = text.replace(f"alpha {old}", f"alpha  = {new} }}", 1)
    return read_text(text.replace("j5a = -1", f"j5a = {ratio}"))


@cache
def derived(angles, ratio):
    return derive(hollow_wrist(angles, ratio), functions=IK)


@cache
def kernels(angles, ratio):
    return [Function(derived(angles, ratio).function(name)) for name in IK]


def test_stages_of_a_telescope_are_one_prismatic_joint():
    robot = read_text(TELESCOPE)
    assert sp.Matrix([[1, 0, 0], [0, 1, 0], *[[0, 0, 1]] * 3]) == robot.linear_map.C
    found = derive(robot, functions=("fk", "ik_position"))
    q = np.array([0.4, -0.7, 0.2])
    fk, ik = (Function(found.function(name)) for name in ("fk", "ik_position"))
    T = np.array(fk.kernel(ca.DM(q))).reshape(4, 4)
    answers = ik(T[None, :3, 3])
    assert (np.abs(answers.q[0] - q).max(axis=-1) < 1e-9).any()
    assert "inner, middle and outer act as one joint, outer." in str(explain(robot))


def _check_inclusion(found, poses):
    fk, ik = (Function(found.function(name)) for name in ("fk", "ik"))
    turns = np.array([c.unit == "rad" for c in found.robot.coordinates])
    joints = np.array([joint.unit == "rad" for joint in found.robot.moving])
    C = np.array(found.robot.linear_map.C, dtype=float)
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (poses, len(turns)))
    T = np.array(fk.kernel(ca.DM(q.T))).T.reshape(-1, 4, 4)
    answers = ik(T)
    # The joint values of an inverse kinematics solution may differ from the generating joint values
    # by full turns.
    apart = (answers.q - q[:, None]) @ C.T
    apart = np.where(joints, (apart + np.pi) % (2 * np.pi) - np.pi, apart)
    near = np.abs(apart).max(axis=-1) < 1e-6
    assert (answers.valid & near).any(axis=1).all()
    reached = np.array(fk.kernel(ca.DM(answers.q[answers.valid].T))).T.reshape(-1, 4, 4)
    wanted = np.repeat(T[:, None], answers.q.shape[1], axis=1)[answers.valid]
    np.testing.assert_allclose(reached, wanted, atol=3e-9)


def test_self_named_joint_has_a_coordinate_and_other_equations_are_inserted():
    robot = read_text(
        f'{ARM}[couplings]\nb = {{ b = 1, a = 2, offset = 3 }}\nc = {{ a = "1/2" }}\n'
    )
    assert [c.name for c in robot.coordinates] == ["a", "b"]
    assert sp.Matrix([[1, 0], [2, 1], [sp.Rational(1, 2), 0]]) == robot.linear_map.C
    assert robot.linear_map.c == sp.Matrix([0, 3, 0])
    chained = read_text(f"{ARM}[couplings]\nb = {{ a = 2, offset = 1 }}\nc = {{ b = 3 }}\n")
    assert sp.Matrix([1, 2, 6]) == chained.linear_map.C
    assert chained.linear_map.c == sp.Matrix([0, 1, 3])


def test_ratios_are_in_units_of_the_file():
    units = 'units = { length = "mm", angle = "deg" }\n'
    text = ARM.replace("joints", f"{units}joints")
    robot = read_text(f"{text}[couplings]\nc = {{ screw = 2 }}\n[motors.screw]\nlimits = [0, 90]\n")
    assert robot.couplings[0].ratios == (("screw", sp.Rational(2, 1000) * 180 / sp.pi),)
    assert robot.coordinates[2].limits == (0, sp.pi / 2)


def test_part_of_a_coupled_chain_keeps_the_equations_of_its_joints(tmp_path):
    file = tmp_path / "wrist.toml"
    file.write_text(next(text for text in FILES if "bevel_wrist" in text))
    whole, wrist, back = read(file), read(file, base="link4"), read(file, base="ee", tip="0")
    assert [c.name for c in wrist.coordinates] == ["left", "right"]
    assert whole.linear_map.C[4:, 4:] == wrist.linear_map.C
    assert wrist.motors == whole.motors
    assert [c.name for c in back.coordinates] == [
        *("left", "right", "forearm", "elbow", "shoulder", "waist")
    ]
    file.write_text(f"{ARM}[couplings]\nb = {{ a = 2 }}\n")
    with pytest.raises(DescriptionError, match="unknown coordinate 'a'; expected a motor or joint"):
        read(file, base="link1")


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ("[couplings]\nd = { a = 1 }", "couplings.d: expected a moving joint (a, b, c)"),
        ("[couplings]\nb = { a = 0 }", "couplings.b.a: expected a nonzero ratio"),
        ("[couplings]\nb = { c = 1 }\nc = { b = 1 }", "couplings form a cycle: b follows c"),
        ("[couplings]\nb = { b = 1, m = 1 }\nc = { n = 1, m = 1 }", "joints cannot determine"),
        ("[motors]\nm = {}", "motor 'm': expected the coordinate of a coupling"),
        ("[couplings]\nb = { m = 1 }\n[motors]\nm = { gear = 2 }", "motors.m.gear: expected one"),
    ],
)
def test_invalid_couplings_are_rejected(tables, words):
    with pytest.raises(DescriptionError, match=re.escape(words)):
        read_text(f"{ARM}{tables}\n")
