"""Calibration from points on circles, measured while a single joint rotates."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import se3
from chasles.calibration import CirclePoints, identify
from chasles.errors import InputValueError
from tests.support.measured_arms import drawn

NOISE = 2e-5


def turned(robot, seed):
    random = np.random.default_rng(seed)
    q, circle = [], []
    turning = [k for k, c in enumerate(robot.coordinates) if c.unit == "rad"]
    for number, k in enumerate([*turning, *turning]):
        here = np.tile(random.uniform(-1, 1, robot.n), (9, 1))
        here[:, k] = np.linspace(-1.2, 1.2, 9)
        q.append(here)
        circle += [number] * 9
    return np.concatenate(q), np.array(circle), [*turning, *turning]


@pytest.mark.parametrize("name", ["ur5e", "stanford"])
def test_circle_axes_and_start_frame_match_true_arm(loaded, name):
    robot = loaded(name)
    truth = drawn(robot, 2)
    q, circle, joints = turned(robot, 1)
    points = truth.positions(robot, q)
    points += NOISE * np.random.default_rng(0).normal(size=points.shape)
    points[3, 0] = np.nan
    measurements = CirclePoints(points, NOISE, circle)
    first = np.searchsorted(circle, np.arange(len(joints)))
    for axis, at, k in zip(measurements.axes(robot.fk(q)), q[first], joints, strict=True):
        # The true axis of the joint in the frame of the measuring device.
        v, omega = np.split(robot.jacobian_p(at, truth.p)[:, k], 2)
        direction = truth.T_W_base[:3, :3] @ omega
        assert_allclose(axis.direction, direction, atol=2e-3)
        tool = robot.fk_p(at, truth.p)[:3, 3]
        point = truth.T_W_base @ [*(tool + np.cross(omega, v)), 1]
        assert np.linalg.norm(np.cross(direction, axis.point - point[:3])) < 1e-3
        assert axis.error < 3 * NOISE
    start = measurements._start(robot.fk(q))
    assert np.abs(se3.log(se3.inverse(truth.T_W_base) @ start.T_W_base)).max() < 5e-3
    found = identify(robot, q, measurements)
    assert 0.9 < found.noise < 1.1


def test_simultaneous_joint_motion_in_circle_is_rejected(arm):
    q = np.linspace(0, 1, 8)[:, None] * [1.0, 1.0, 0, 0, 0, 0]
    measurements = CirclePoints(np.zeros((8, 1, 3)), NOISE, np.zeros(8, dtype=int))
    with pytest.raises(InputValueError, match="circle 0: the tool does not rotate enough about"):
        measurements.axes(arm.fk(q))


def test_circles_of_parallel_axes_give_accurate_start(arm, truth):
    q = np.tile([0.3, -1.0, 0.8, 0.2, 0.5, 0.1], (18, 1))
    q[:9, 1] += np.linspace(-1, 1, 9)
    q[9:, 2] += np.linspace(-1, 1, 9)
    points = truth.positions(arm, q)
    start = CirclePoints(points, NOISE, np.repeat([0, 1], 9))._start(arm.fk(q))
    assert start.misfit < 0.01
