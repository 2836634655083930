"""Tests that the power of the actuator forces equals the power of the tool wrench.

The tested robots include robots with loops.
"""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError, ShapeError

STATES = 2000
WITH_LOOPS = [name for name in chasles.robots() if chasles.load(name).loops]
RIGHT = 1e-12
"""Largest difference between actuator power and wrench power, divided by the sum of the absolute
values of all power terms."""


@pytest.mark.parametrize("representation", ["mixed", "body", "space"])
@pytest.mark.parametrize("name", ["ur5e", *WITH_LOOPS])
def test_forces_and_wrench_have_the_same_power(name, representation):
    robot, rng = chasles.load(name), np.random.default_rng(1)
    q = robot.random_q(STATES, rng=1)
    qd, wrench = rng.normal(size=(STATES, robot.n)), rng.normal(size=(STATES, 6))
    twist = getattr(robot, f"twist_{representation}")(q, qd)
    terms = robot.actuator_forces(q, wrench, representation=representation) * qd
    wanted = wrench * twist
    size = np.abs(terms).sum(-1) + np.abs(wanted).sum(-1)
    gap = np.abs(terms.sum(-1) - wanted.sum(-1))
    assert np.isfinite(gap).mean() > 0.99
    assert np.nanmax(gap / size) <= RIGHT


def test_weight_on_a_horizontal_arm_is_a_torque_about_its_shoulder():
    arm = chasles.load("lynxmotion")
    q = arm.q_reference
    J = arm.jacobian_mixed(q)
    weight = np.array([0, 0, -9.81, 0, 0, 0])
    np.testing.assert_allclose(arm.actuator_forces(q, weight), J.T @ weight, atol=1e-15)
    # A vertical force has no torque about the vertical first axis.
    assert abs(arm.actuator_forces(q, weight)[0]) < 1e-12


def test_leading_dimensions_broadcast_and_errors_name_the_argument():
    arm = chasles.load("ur5e")
    q, wrench = arm.random_q((3, 1)), np.ones((4, 6))
    assert arm.actuator_forces(q, wrench).shape == (3, 4, 6)
    with pytest.raises(ShapeError, match="expected wrench of shape"):
        arm.actuator_forces(q, np.ones(3))
    with pytest.raises(InputValueError, match='must be "space", "body" or "mixed"'):
        arm.actuator_forces(q, wrench, representation="tool")
