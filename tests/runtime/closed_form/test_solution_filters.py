"""Filters of solutions by weights, branches and limits."""

import re

import numpy as np
import pytest

import chasles

Q = np.array([0.3, -1.2, 1.5, -0.4, 0.9, 0.2])


@pytest.fixture(scope="module")
def solutions():
    robot = chasles.load("ur5e")
    return robot.ik(robot.fk(Q))


def test_weights_choose_the_joints_that_count(solutions):
    slots = solutions.q[solutions.valid]
    seed = Q + np.array([0.3, -0.4, 0.0, 0.2, -0.1, 0.6])
    moves = np.abs(solutions.distances_from(seed)[solutions.valid])
    for weights in (np.ones(6), [1, 0, 0, 0, 0, 0], [0.1, 3, 0, 1, 2, 0.5]):
        distance = (moves * weights).max(-1)
        nearest = solutions.nearest(seed, weights=weights)
        assert (distance[(slots == nearest).all(-1)] <= distance.min() + 1e-12).all()
        first = solutions.sorted_by_distance(seed, weights=weights)
        np.testing.assert_array_equal(first.q[0], nearest)
    for weights in (np.zeros(6), [1, -1, 1, 1, 1, 1]):
        with pytest.raises(chasles.InputValueError, match="must be finite and nonnegative"):
            solutions.nearest(seed, weights=weights)


def test_on_branch_keeps_the_slots_of_a_label():
    ur5e = chasles.load("ur5e")
    solutions = ur5e.ik(ur5e.fk(np.full((3, 6), 0.4)))
    parts = [label.split(", ") for label in solutions.labels]
    for part in dict.fromkeys(p for own in parts for p in own):
        kept = solutions.on_branch(part)
        expected = solutions.valid & [part in own for own in parts]
        np.testing.assert_array_equal(kept.valid, expected)
    one = solutions.on_branch(solutions.labels[3])
    np.testing.assert_array_equal(one.valid.sum(-1), solutions.valid[:, 3])
    with pytest.raises(chasles.InputValueError, match=f"branches: {re.escape(parts[0][0])}"):
        solutions.on_branch("elbow up")
    with pytest.raises(chasles.InputValueError, match="slots are sorted"):
        solutions.sorted_by_distance(np.zeros(6)).on_branch(parts[0][0])


def test_within_limits_without_limits_keeps_all_solutions(solutions):
    np.testing.assert_array_equal(solutions.within_limits(None).valid, solutions.valid)
    with pytest.raises(chasles.InputValueError, match='limits must be "robot", None or an array'):
        solutions.within_limits("own")
