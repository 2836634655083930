"""Bounds of the motion of loops against the motion itself and against generated derivatives."""

from dataclasses import replace

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study.planning import ball, robot_space
from chasles.study.planning.loop_bounds import loop_bounds

ROBOTS = (
    "excavator",
    "well_manipulator",
    "board_installer",
    "bricklaying_gantry",
    "five_bar",
    "four_bar",
    "slider_crank",
)
PLACES = 33


def made(name):
    robot = chasles.load(name)
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    return robot, loop_bounds(robot, lower, upper), lower, upper


def around(values, turns):
    """Distances from the value in the middle, by the shorter way round."""
    away = values - values[PLACES // 2]
    return np.abs(np.where(turns, (away + np.pi) % (2 * np.pi) - np.pi, away)).max(0)


@pytest.mark.parametrize("name", ROBOTS)
def test_nothing_moves_further_than_bounded(name):
    robot, bounds, lower, upper = made(name)
    rng, certain, tight = np.random.default_rng(1), 0, []
    for k in range(90):
        a = rng.uniform(lower, upper)
        size = (0.002, 0.01, 0.05)[k % 3] * (upper - lower)
        b = np.clip(a + rng.normal(size=robot.n) * size, lower, upper)
        q = a + np.linspace(0, 1, PLACES)[:, None] * (b - a)
        z = robot.configuration(q)
        joints = bounds.joints(a, b)
        if joints is None:
            continue
        # With a bound, the loops close on the whole way.
        assert np.isfinite(z).all()
        moved = around(z, bounds.turns)
        assert (moved <= joints + 1e-9).all()
        points = np.concatenate(
            [robot.link_poses(q)[..., :3, 3], robot.fk(q)[:, None, :3, 3]], axis=1
        )
        here = points[PLACES // 2]
        most = bounds.frames(a, b, here)
        far = np.linalg.norm(points - here, axis=-1).max(0)
        assert (far <= most + 1e-9).all()
        tight.append(most[-1] / max(far[-1], 1e-9))
        certain += 1
    assert certain >= 50
    assert np.median(tight) < 6


@pytest.mark.parametrize("name", ROBOTS)
def test_curvature_bounds_generated_second_derivatives(name):
    robot, bounds, _, _ = made(name)
    rng, n = np.random.default_rng(2), len(bounds.turns)
    z = rng.uniform(-1, 1, (300, n)) * np.where(bounds.turns, np.pi, bounds.widest)
    most = np.zeros_like(bounds.curvature)
    for k, along in enumerate(np.eye(n)):
        second = robot.constraint_D_z_dot(z, np.broadcast_to(along, z.shape))
        most[:, :, k] = np.abs(second).max(0)
    assert (most <= bounds.curvature * (1 + 1e-12) + 1e-12).all()
    # No bound is far from what occurs: sums of sizes are at most a few times the largest sum.
    there = bounds.curvature > 1e-9
    assert (most[there] > 0.15 * bounds.curvature[there]).all()


def test_no_bound_where_loops_open_or_are_dead():
    """Cylinders beyond their limits: on short ways triangles open, or are as good as stretched."""
    robot, bounds, lower, upper = made("excavator")
    rng, dead, span = np.random.default_rng(3), 0, upper - lower
    for _ in range(3000):
        a = rng.uniform(lower - span, upper + span)
        b = a + rng.normal(size=robot.n) * 0.03 * span
        z = robot.configuration(a + np.linspace(0, 1, 60)[:, None] * (b - a))
        closed = np.isfinite(z).all(-1)
        if closed.all() or not closed.any():
            continue
        assert bounds.joints(a, b) is None
        assert np.isinf(bounds.frames(a, b, np.zeros((5, 3)))).all()
        dead += 1
    assert dead > 20


class OtherBranch:
    """A robot whose loops are on another branch at the end of the way."""

    def __init__(self, robot):
        self.constraint_D_z, self.real = robot.constraint_D_z, robot

    def configuration(self, q):
        z = self.real.configuration(q)
        z[-1, 1] += 0.5
        return z


def test_no_bound_beyond_the_slides_or_on_another_branch():
    robot, bounds, _, _ = made("excavator")
    q = np.array(robot.reference.q)
    way = (q, q + 1e-3)
    assert bounds.joints(*way) is not None
    assert replace(bounds, widest=0.2 * bounds.widest).joints(*way) is None
    assert replace(bounds, robot=OtherBranch(robot)).joints(*way) is None


def test_robots_without_bounds():
    with pytest.raises(InputValueError, match="a platform's legs are not links of its main chain"):
        robot_space(chasles.load("stewart_gough"), [ball([0, 0, 1], 0.1)], radius=0.05)
    with pytest.raises(InputValueError, match="equation 0 of its loops is no polynomial"):
        robot_space(chasles.load("delta"), [ball([0, 0, 1], 0.1)], radius=0.05)
