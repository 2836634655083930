"""Between two solutions, the error has saddle points.

The iteration continues past these points.

A UR5e with a nearly straight elbow has two nearly equal solutions.
"""

from itertools import product

import numpy as np
import pytest

import chasles
from chasles import so3
from chasles.closed_form import refinement
from chasles.closed_form.refinement import DescentStarts, Refinement, descent_starts
from tests.support.generators.drawn_arms import cases_of, random_arm
from tests.support.oracles.verdict import residuals

ARM = 93553
ALL = list(range(6))
ELBOW = 2


@pytest.fixture(scope="module")
def ur5e():
    return Refinement(chasles.load("ur5e").fk_jacobian_mixed, ())


def stretched(bend):
    """Configurations (60, 6) of a UR5e with a slightly bent elbow."""
    rng = np.random.default_rng(3)
    q = rng.uniform(-3, 3, (60, 6))
    q[:, ELBOW] = bend
    q[:, 4] = rng.uniform(0.5, 2.5, 60)
    return q


def size_and_slope(iteration, T, q):
    """Return half the squared pose errors (N,) at q (N, 6), and their gradients (N, 6)."""
    pose, J = iteration.fk_jacobian_mixed(q)
    _, error, _ = iteration.task(pose, J, T)
    return (error**2).sum(-1) / 2, -np.einsum("Nij,Ni->Nj", J, error)


def stationary(iteration, T, q):
    """Find stationary points (N, 6) of the squared error by Newton's method on its gradient."""
    for _ in range(8):
        _, g = size_and_slope(iteration, T, q)
        slopes = [
            (size_and_slope(iteration, T, q + h)[1] - size_and_slope(iteration, T, q - h)[1]) / 2e-6
            for h in 1e-6 * np.eye(6)
        ]
        q = q - np.linalg.solve(np.stack(slopes, -1), g[..., None])[..., 0]
    return q


def ways_of(iteration, T, q):
    return descent_starts(lambda row, q: size_and_slope(iteration, T[row], q), q, ALL)


@pytest.mark.parametrize("bend", [0.2, 0.05, 0.01, 0.002])
def test_descent_from_saddle_reaches_both_solutions(ur5e, bend):
    q = stretched(bend)
    T = ur5e.fk_jacobian_mixed(q)[0]
    between = stationary(ur5e, T, np.where(np.arange(6) == ELBOW, 0.0, q))
    half, slope = size_and_slope(ur5e, T, between)
    stands = np.flatnonzero((np.sqrt(half) > bend**2 / 100) & (np.abs(slope).max(-1) < 1e-12))
    assert len(stands) >= 30
    starts = ways_of(ur5e, T[stands], between[stands])
    np.testing.assert_array_equal(starts.row, np.tile(np.arange(len(stands)), 2))
    found, left = ur5e.newton(T[stands[starts.row]], starts.q)
    assert left.max() < 1e-13
    elbows = np.sort(found[:, ELBOW].reshape(2, -1), axis=0)
    np.testing.assert_allclose(elbows, np.outer([-bend, bend], np.ones(len(stands))), atol=1e-8)


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6])
def test_descent_starts_exist_only_inside_reach_boundary(ur5e, distance):
    """For a target beyond reach, the stretched arm is a minimum of the pose error.

    For a reachable target, the stretched arm is a saddle point of the pose error.
    """
    q = stretched(0.0)
    T, J = ur5e.fk_jacobian_mixed(q)
    inward = np.linalg.svd(J)[0][:, :, -1]
    bent, _ = ur5e.fk_jacobian_mixed(stretched(1e-3))
    bends = ur5e.task(T, J, bent)[1]
    inward *= np.sign((bends * inward).sum(-1))[:, None]
    beyond, within = (moved(T, sign * distance * inward) for sign in (-1, 1))
    assert len(ways_of(ur5e, beyond, q).row) == 0
    assert len(ways_of(ur5e, within, q).row) == 2 * len(q)


def test_descent_starts_skip_points_with_open_loops():
    def saddles(row, q):
        f = (1.0 + (q**2 * [-1.0, 1.0, 1.0]).sum(-1)) / 2
        is_open = (row == 1) & (q != 0.0).any(-1)
        return f, np.where(is_open[:, None], np.nan, q * [-1.0, 1.0, 1.0])

    starts = descent_starts(saddles, np.zeros((2, 3)), [0, 1, 2])
    np.testing.assert_array_equal(starts.row, [0, 0])
    np.testing.assert_allclose(np.sort(starts.q, axis=0), [[-1.0, 0, 0], [1.0, 0, 0]], atol=1e-12)


def moved(T, twist):
    """Move poses (N, 4, 4) by twists (N, 6) at the tip in base axes."""
    there = T.copy()
    there[:, :3, 3] += twist[:, :3]
    there[:, :3, :3] = so3.exp(twist[:, 3:]) @ T[:, :3, :3]
    return there


@pytest.fixture(scope="module")
def drawn():
    (case,) = (case for case in cases_of(random_arm(ARM)) if case.function == "ik")
    return case


def test_saddle_answers_are_refined_to_solutions(drawn, monkeypatch):
    quarters = np.arange(-1, 3) * (np.pi / 2)
    turning = [quarters if turns else [0.0] for turns in drawn.turns]
    q = np.array(list(product(*turning)))
    at_once = drawn.found(q)
    lost = q[~at_once.valid.any(axis=1)]
    found = drawn.refined(q)
    errors = residuals(drawn, q, found)
    assert (errors[found.claimed] <= 1e-9).all()
    assert found.claimed.any(axis=1).all()

    def none(gradients, q, free):
        return DescentStarts(np.zeros(0, int), q[:0])

    monkeypatch.setattr(refinement, "descent_starts", none)
    assert not drawn.refined(lost).claimed.any(axis=1).all()
