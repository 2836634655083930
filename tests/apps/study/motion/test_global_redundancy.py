"""Global redundancy resolution: limits, cost and derivatives."""

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError, OutOfReachError
from chasles.study.motion import (
    Motion,
    MotionSequence,
    global_redundancy,
    joint_line,
    line,
    resolve_redundancy,
    time_scaling,
)
from tests.campaigns import redundancy
from tests.support.oracles.self_motion import reached_poses

ROBOTS = ("panda", "iiwa14", "well_manipulator")
"""The inverse of the first robot has one fixed joint, and the inverse of the second a swivel angle.
The third robot has loops, and its inverse kinematics function has three fixed joints."""


def curves(robot, rng, count):
    while count:
        middle = robot.limits.mean(1)
        size = np.diff(robot.limits)[:, 0] * rng.uniform(-0.25, 0.25, robot.n)
        q_start = middle + size
        q_end = q_start + 0.1 * np.diff(robot.limits)[:, 0] * rng.uniform(-1, 1, robot.n)
        if robot.loops:
            q_end[0] = q_start[0]
        if np.isfinite(robot.fk(q_end)).all():
            count -= 1
            yield q_start, line(robot.fk(q_start), robot.fk(q_end))


def motions(name, count, **options):
    robot, rng = chasles.load(name), np.random.default_rng(3)
    return [
        Motion(robot, curve, time_scaling("quintic", curve.length, duration=2), q, **options)
        for q, curve in curves(robot, rng, count)
    ]


def cost(robot, q):
    """Return the weighted sum of squared joint displacements."""
    units = np.array([robot.unit_length if c.unit == "m" else 1.0 for c in robot.coordinates])
    return (np.diff(q / units, axis=0) ** 2).sum() * (len(q) - 1)


@pytest.mark.parametrize("name", ROBOTS)
def test_tool_is_on_the_curve_within_limits(name):
    for motion in motions(name, 3, redundancy="global"):
        robot, found = motion.robot, motion.sample(50)
        poses = motion.curve.at(motion.time_scaling.at(found.t)[0]).T
        np.testing.assert_allclose(found.T, poses, atol=1e-11)
        assert (found.q >= robot.lower).all()
        assert (found.q <= robot.upper).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_rates_and_accelerations_match_differences(name):
    (motion,) = motions(name, 1, redundancy="global")
    step = 1e-4
    for t in (0.31, 0.77, 1.43):
        before, at, after = (motion.at([t + k * step]) for k in (-1, 0, 1))
        rate, acceleration = ((after.q - before.q), (after.qd - before.qd))
        np.testing.assert_allclose(rate / (2 * step), at.qd, atol=1e-6)
        np.testing.assert_allclose(acceleration / (2 * step), at.qdd, atol=1e-3)


def test_no_smooth_change_of_the_parameter_lowers_the_cost():
    (motion,) = motions("panda", 1, redundancy="global")
    robot, curve = motion.robot, motion.curve
    s = np.linspace(0, curve.length, 101)
    T, values = curve.at(s).T, motion._parameters.at(s)["joint7"]
    start = motion._parameters.q_start

    def total(joint7):
        path = robot.ik_path(T, start, fixed={"joint7": joint7})
        assert path.complete
        return cost(robot, path.q) + cost(robot, np.array([motion.q_seed, path.q[0]]))

    least, u = total(values), s / curve.length
    for shape in (1 + 0 * u, u, 1 - u, np.sin(np.pi * u), np.sin(2 * np.pi * u)):
        for size in (-0.05, -0.01, 0.01, 0.05):
            assert total(values + size * shape) > 0.995 * least


def test_motions_cost_less_than_with_a_fixed_parameter():
    compared = 0
    pairs = zip(motions("iiwa14", 4), motions("iiwa14", 4, redundancy="global"), strict=True)
    for fixed, free in pairs:
        try:
            expected = cost(fixed.robot, fixed.sample(50).q)
        except OutOfReachError:
            continue
        start = np.array([fixed.q_seed, free.sample(50).q[0]])
        assert cost(free.robot, free.sample(50).q) + cost(free.robot, start) < expected + 1e-6
        compared += 1
    assert compared >= 2


def test_limits_hold_where_a_dense_grid_contains_a_motion():
    robot, rng, outcomes = chasles.load("panda"), np.random.default_rng(8), []
    for q_start, curve in curves(robot, rng, 14):
        half = np.diff(robot.limits)[:, 0] * rng.uniform(0.03, 0.2, robot.n)
        limits = np.stack([q_start - half, q_start + half], -1)
        limits = np.clip(limits, robot.limits[:, :1], robot.limits[:, 1:])
        T = curve.at(np.linspace(0, curve.length, 40)).T
        exists = reached_poses(robot, T, limits, 200) == len(T)
        try:
            path = resolve_redundancy(robot, T, q_start, limits=limits)
        except OutOfReachError:
            assert not exists
            outcomes.append(False)
            continue
        assert path.complete
        assert (path.q >= limits[:, 0]).all()
        assert (path.q <= limits[:, 1]).all()
        np.testing.assert_allclose(robot.fk(path.q), T, atol=1e-11)
        outcomes.append(True)
    assert 3 <= sum(outcomes) <= 11


def test_camera_looks_at_a_target_within_limits():
    for number in (0, 9):
        outcome = redundancy.trial(number)
        assert outcome.counts == {"resolved": 1}
        assert not outcome.failures


def test_motion_that_must_follow_a_limit_is_found(monkeypatch):
    monkeypatch.setattr(global_redundancy, "_TRIES", global_redundancy._TRIES[-1:])
    outcome = redundancy.trial(77000106)
    assert outcome.counts == {"resolved": 1}
    assert not outcome.failures


def test_errors_name_the_place_and_the_remedy():
    robot = chasles.load("panda")
    q = np.array([0.1, -0.4, 0.2, -1.8, 0.3, 1.6, 0.5])
    T = np.repeat(robot.fk(q)[None], 10, 0)
    T[5:, 0, 3] += 3
    with pytest.raises(OutOfReachError, match=r"joint7 reaches the pose at \d+% of the path"):
        resolve_redundancy(robot, T, q)
    with pytest.raises(InputValueError, match="at least one pose"):
        resolve_redundancy(robot, T[:0], q)
    with pytest.raises(InputValueError, match="no redundancy parameters"):
        resolve_redundancy(chasles.load("ur5e"), T, q[:6])
    curve, straight = line(T[0], robot.fk(q + 0.1)), joint_line(q, q + 0.1)
    scaling = time_scaling("quintic", curve.length, duration=1)
    with pytest.raises(
        InputValueError, match=r"expected a curve of the tool pose for redundancy global"
    ):
        Motion(robot, straight, scaling, q, redundancy="global")
    with pytest.raises(InputValueError, match="does not support fixed joints"):
        Motion(robot, curve, scaling, q, fixed="joint7", redundancy="global")
    with pytest.raises(InputValueError, match="use Motion"):
        MotionSequence(robot, q).follow(curve, "quintic", duration=1, redundancy="global")


@pytest.mark.parametrize("limits", ["arm", np.zeros((3, 2)), np.zeros(7)])
def test_limits_of_another_shape_are_refused(limits):
    robot = chasles.load("panda")
    T = robot.fk(robot.limits.mean(1))[None]
    with pytest.raises(InputValueError, match="limits"):
        resolve_redundancy(robot, T, robot.limits.mean(1), limits=limits)


@pytest.mark.parametrize("spread", [0.3, 3.0], ids=["near", "far"])
@pytest.mark.parametrize("highest", [1.0, 200.0], ids=["equal costs", "different costs"])
def test_predecessors_are_the_cheapest_of_all_pairs(spread, highest):
    rng = np.random.default_rng(5)
    before, after = (rng.normal(0, spread, (count, 4)) for count in (300, 200))
    cost = np.where(rng.random(300) < 0.2, np.inf, rng.uniform(0, highest, 300))
    steps, found = global_redundancy._predecessors(cost, before, after, 10)
    squares = ((before[:, None] - after) ** 2).sum(2)
    total = cost[:, None] + np.where(squares <= 1, 10 * squares, np.inf)
    np.testing.assert_allclose(found, total.min(0), rtol=1e-12)
    reached = np.isfinite(found)
    np.testing.assert_array_equal(steps[reached], total.argmin(0)[reached])
    assert reached.any()
    assert reached.all() == (spread < 1)
