"""Cleaning of robots with loops and rounded values: structure, poses and list of changes."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from chasles.derive import derive, read_text
from chasles.derive.description.arrangement import Distances, arranged
from chasles.derive.description.cleaned_robot import cleaned
from chasles.derive.loops.checks.nearly_met import nearly_met
from chasles.derive.model.placements import Rotation
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.leg_platforms import drawn_as
from tests.support.generators.machine_platforms import MACHINE_KINDS
from tests.support.generators.rounded_mechanisms import awkward_turn, rounded
from tests.support.loops import mechanisms
from tests.support.loops.continued import closed_configuration
from tests.support.loops.solved import solved

R = sp.Rational
NOISE = 1e-9
DELTA = """\
name = "delta"
convention = "urdf"
actuated = ["s1", "s2", "s3"]
units = { length = "mm", angle = "deg" }
tool = { body = "platform", xyz = [0, 0, -30] }
reference = { z = 102.544, s1 = 300, s2 = 300, s3 = 300 }
[[joints]]
name = "platform"
type = "free"
link = "platform"
"""
TOWERS = ((0.0, 145.0, 90), (-125.5736835487, -72.5, 210), (125.5736835487, -72.5, 330))
PAIRS = (
    ((-30.0, 35.0), (30.0, 35.0)),
    ((-15.3108891325, -43.4807621135), (-45.3108891325, 8.4807621135)),
    ((45.3108891325, 8.4807621135), (15.3108891325, -43.4807621135)),
)
POSE = (0.00946701, 0.15328673, 0.08513579)
"""Tool position (meter) of the exact delta robot at the actuated coordinates ``AT``."""
AT = (0.3224862, 0.1265808, 0.0596154)


def linear_delta(longer=0.0):
    """Return a linear delta file whose first rod is ``longer`` millimeters too long."""
    text = DELTA
    for k, (x, y, yaw) in enumerate(TOWERS, 1):
        text += f'[[joints]]\nname = "s{k}"\nlink = "s{k}"\nparent = "0"\ntype = "prismatic"\n'
        text += f"xyz = [{x}, {y}, 0]\nrpy = [0, 0, {yaw}]\naxis = [0, 0, 1]\nlimits = [0, 400]\n"
    for k, pair in enumerate(PAIRS, 1):
        for side, (x, y), across in zip("lr", pair, (30, -30), strict=True):
            length = 217 + longer * (k == 1 and side == "l")
            text += f'[[rods]]\nname = "r{k}{side}"\nlength = {length}\nends = "ball"\n'
            text += f'a = {{ body = "s{k}", xyz = [-20, {across}, 0] }}\n'
            text += f'b = {{ body = "platform", xyz = [{x}, {y}, 0] }}\n'
    return text


def test_delta_in_decimals_has_closed_form_and_states_change_of_pose():
    derivation = derive(read_text(linear_delta()), functions=["fk"])
    assert not derivation.hybrid.forward.open
    (kernel,) = lower([derivation.function("fk")], "delta")
    T = np.array(kernel(AT)).reshape(4, 4)
    assert np.abs(T[:3, 3] - POSE).max() < 1e-7
    rods = [(tower, end) for tower, pair in zip(range(3), PAIRS, strict=True) for end in pair]
    lengths = [rod_length(*rod, across, T) for rod, across in zip(rods, (30, -30) * 3, strict=True)]
    assert np.abs(np.array(lengths) - 0.217).max() < 1e-12
    cleaning = derivation.robot.cleaning
    assert len(cleaning.numbers) == 10
    assert 0 < cleaning.position < 1e-9
    assert cleaning.samples > 0
    assert derivation.robot.notes[0] == cleaning.line
    assert f"at {cleaning.samples} random configurations" in cleaning.line


def rod_length(tower, end, across, T):
    """Return the distance (meter) between both ends of a rod, computed from rounded points."""
    x, y, yaw = TOWERS[tower]
    c, s = np.cos(np.deg2rad(yaw)), np.sin(np.deg2rad(yaw))
    a = np.array([x - 20 * c - across * s, y - 20 * s + across * c, 1000 * AT[tower]]) / 1000
    platform = T[:3, 3] - T[:3, :3] @ [0, 0, -0.03]
    return np.linalg.norm(a - platform - T[:3, :3] @ [*np.array(end) / 1000, 0])


def test_exact_option_keeps_decimals_of_loops():
    as_written = read_text(linear_delta(), exact=True)
    assert not as_written.cleaning.numbers
    assert as_written.as_written is None
    assert solved(as_written).forward.open


def test_rods_that_nearly_are_parallel_are_named():
    (message,) = nearly_met(solved(read_text(linear_delta(longer=0.3))))
    assert "three spheres" in message
    assert message.endswith("'r1l' and 'r1r' by 0.3 mm")
    assert not list(nearly_met(solved(read_text(linear_delta()))))


def test_equal_rods_are_not_named_if_another_loop_has_no_closed_form():
    h = solved(drawn_as(MACHINE_KINDS["delta with a shaft"], 1))
    assert h.forward.open
    assert not list(nearly_met(h))


def test_axis_that_is_nearly_parallel_is_named():
    robot = mechanisms.four_bar()
    crank, elbow, rocker = robot.joints
    tilted = replace(elbow, before=(*elbow.before, Rotation("x", R(1, 1000))))
    (message,) = nearly_met(
        solved(replace(robot, joints=(crank, tilted, rocker), closure="least squares"))
    )
    assert "loop of 'wrist' would be planar" in message
    assert "axis of 'elbow' is 1 mrad" in message


ROUNDED = {
    "four_bar": 4,
    "five_bar": 12,
    "parallelogram": 5,
    "welded": 7,
    "slider_crank": 4,
}


@pytest.mark.parametrize("name", ROUNDED)
def test_rounded_numbers_on_turned_base_keep_form(name):
    robot, places = getattr(mechanisms, name)(), ROUNDED[name]
    turn = awkward_turn(np.random.default_rng(places))
    found = solved(cleaned(rounded(robot, places, turn))).forward
    exact = solved(robot).forward
    assert not found.open
    assert [type(step) for step in found.steps] == [type(step) for step in exact.steps]


def test_pose_of_turned_delta_is_pose_in_its_decimals_within_stated_change():
    """For comparison, Newton's method closes the loops of the delta robot with rounded numbers."""
    written = rounded(mechanisms.delta(), 6, awkward_turn(np.random.default_rng(1)))
    derivation = derive(cleaned(written), functions=["fk"])
    assert not derivation.hybrid.forward.open
    assert any(
        "expressed in axes with the orientation of" in note for note in derivation.robot.notes
    )
    q = [-0.05, -0.2, -0.1]
    (kernel,) = lower([derivation.function("fk")], "delta")
    T = np.array(kernel(q)).reshape(4, 4)
    poses = mechanisms.body_poses(written, closed_configuration(written, q))
    stated = derivation.robot.cleaning
    assert 1e-9 < stated.position < 1e-5
    assert np.linalg.norm(T[:3, 3] - poses["platform"][:3, 3]) < stated.position
    assert np.abs(T[:3, :3] - poses["platform"][:3, :3]).max() < stated.orientation


def test_points_without_common_arrangement_stay():
    points = [(R("0.3"), R("0.1"), R(0)), (R("0.1"), R("0.2001"), R(0)), (R("0.1"), R("0.2"), R(0))]
    assert arranged([points], NOISE) == {}
    turned = (R("-0.05"), R("0.0866"), R(0))
    assert arranged([[turned, (R("0.1"), R(0), R("0.001"))]], NOISE) == {}
    assert arranged([[turned], [(R("0.1"), R(0), R(0))]], NOISE) == {}
    root = sp.sqrt(3) / 20
    assert arranged([[turned, (R("0.1"), R(0), R(0))]], NOISE) == {turned: (-R(1, 20), root, R(0))}


def test_length_that_repeats_distance_becomes_its_root():
    distances = Distances([[(R(0), R(0), R(0)), (R("0.3"), R("0.5"), R(0))]], NOISE)
    assert distances.exact(R("0.583095")) == sp.sqrt(R("0.34"))
    assert distances.exact(R("0.583195")) == R("0.583195")
    assert distances.exact(R("0.58")) == R("0.58")


def test_mirrored_points_are_no_rounded_copies():
    """Seen from the platform center, two rod ends are 14.8 degrees apart, close to 15 degrees."""
    x, y = R("0.239"), R("0.031")
    assert arranged([[(x, y, R(0)), (x, -y, R(0))]], NOISE) == {}


def test_rounded_point_is_copy_of_nearest_original():
    x, y = R("0.239"), R("0.031")
    point = (R("-0.093"), R("0.222"), R(0))
    exact = arranged([[(x, y, R(0)), (x, -y, R(0)), point]], NOISE)
    assert exact == {point: (-x / 2 + sp.sqrt(3) * y / 2, y / 2 + sp.sqrt(3) * x / 2, R(0))}
