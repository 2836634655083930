"""A gantry lays a brick wall: brick positions and motor angles."""

import numpy as np
import pytest

import chasles
from chasles.study.motion import MotionSequence, blend, limit_violations

BRICK = np.array([0.075, 0.036, 0.022])
"""Length, width and height of a brick of the model [m]."""
PULLEYS = {"motor_x": 0.010, "motor_y": 0.010, "motor_z": 0.015}
"""Pulley radii in the robot file [m]."""
PICK = np.array([0.02, 0.02, 0.03])
ABOVE = 0.15


def running_bond(courses, bricks):
    """Return the centers of bricks in running bond."""
    for course in range(courses):
        for k in range(bricks - course % 2):
            aside = BRICK[0] * (k + course % 2 / 2)
            yield np.array([0.06 + aside, 0.30, 0.03 + BRICK[2] * course])


def at(point):
    T = np.eye(4)
    T[:3, 3] = point
    return T


def over(point):
    return at([*point[:2], ABOVE])


@pytest.fixture(scope="module")
def gantry():
    return chasles.load("bricklaying_gantry")


@pytest.fixture(scope="module")
def laying(gantry):
    found = MotionSequence(gantry, gantry.ik(at(PICK)).q[0])
    limits = {"speed": 0.15, "acceleration": 0.6, "jerk": 6}
    for place in running_bond(3, 3):
        there = blend([at(PICK), over(PICK), over(place), at(place)], radius=0.03)
        back = blend([at(place), over(place), over(PICK), at(PICK)], radius=0.03)
        found = found.pause(0.3, "grip").follow(there, "s_curve", name="carry", **limits)
        found = found.pause(0.3, "release").follow(back, "s_curve", name="return", **limits)
    return found


def test_every_brick_is_released_at_its_position(laying):
    places = list(running_bond(3, 3))
    found = laying.sample(50)
    assert len(places) == 8
    released = [found.T[found.stage == 4 * k + 2][0, :3, 3] for k in range(len(places))]
    np.testing.assert_allclose(released, places, atol=1e-12)
    for k, place in enumerate(places):
        if place[2] > places[0][2]:
            below = [other for other in places[:k] if abs(place[2] - other[2] - BRICK[2]) < 1e-9]
            aside = np.abs([place[0] - other[0] for other in below])
            np.testing.assert_allclose(aside[aside < BRICK[0]], BRICK[0] / 2)
            assert (aside < BRICK[0]).any()


def test_motor_angles_are_proportional_to_prismatic_positions(gantry, laying):
    found = laying.sample(50)
    radii = np.array([PULLEYS[name] for name in found.coordinate_names])
    np.testing.assert_allclose(found.q * radii, found.T[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(found.qd * radii, found.V[:, :3], atol=1e-12)
    assert not limit_violations(gantry, found, rate_limits=0.15 / radii * (1 + 1e-9))
    assert np.abs(found.qd[:, 2]).max() > 9.9


def test_tool_stays_above_laid_bricks(laying):
    found = laying.sample(200)
    p = found.T[:, :3, 3]
    height = np.maximum(PICK[2], 0.03 + BRICK[2] * 3)
    carried = (p[:, 2] < height) & (np.abs(p[:, 1] - 0.3) < BRICK[1])
    places = np.array(list(running_bond(3, 3)))
    aside = np.abs(p[carried, None, 0] - places[None, :, 0]).min(1)
    assert carried.sum() > 100
    assert aside.max() < 1e-9


def test_brick_laying_jumps_only_in_jerk(laying):
    assert {name for _, name, _, _ in laying.jumps()} == {"jerk"}
    assert laying.duration == pytest.approx(sum(s.motion.duration for s in laying._stages))
