"""The inverse of robots with loops returns every solution exactly once.

For a delta robot, Newton's method with many start values finds all expected actuator values. For
random mechanisms, the target poses are computed from random configurations.
"""

import numpy as np
import pytest

from chasles.derive import derive, read
from chasles.derive.terms.branches import patterns
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import ROBOTS
from tests.support.generators.drawn_mechanisms import drawn_mechanism

SAME = 1e-7
AT_DEAD_POINT = 1e-6
"""Margin below which two solutions of the inverse kinematics nearly merge."""
FOUND = 1e-5
"""Tolerance of a solution (radian, or length relative to the mechanism size), which allows for
lower accuracy near dead points."""
POSES = 50
FUNCTIONS = ("fk", "ik")
SEEDS = (0, 1, 14)
"""Seeds of random mechanisms whose inverse kinematics has a closed form."""


def slots(functions, compiled, T):
    """Return coordinates (N, k, n), and margins and residuals (N, k), at poses (16, N)."""
    ik = next(f for f in functions if f.name == "ik")
    found = []
    for signs in patterns(ik) if ik.signs else [None]:
        choice = (
            [] if signs is None else [np.repeat(np.array(signs, float)[:, None], T.shape[1], 1)]
        )
        found.append([np.array(part) for part in compiled["ik"](T, *choice)])
    q = np.stack([q.T for q, _, _ in found], 1)
    residual, margin = (np.stack([part[k][0] for part in found], 1) for k in (1, 2))
    return q, margin, residual


def apart(q, other, turns, size):
    """Return the largest coordinate difference (radian, or length divided by ``size``)."""
    d = q - other
    return np.abs(np.where(turns, np.remainder(d + np.pi, 2 * np.pi) - np.pi, d / size)).max(-1)


def faults(functions, compiled, q, turns, size):
    """Count repeated solutions and missing configurations away from dead points."""
    T = np.array(compiled["fk"](q.T)).reshape(16, -1)
    closed = np.isfinite(T).all(0)
    q, T = q[closed][:POSES], T[:, closed][:, :POSES]
    found, margin, residual = slots(functions, compiled, T)
    solves = residual < 1e-9 * max(min(size, 1.0), 1e-3)
    pairs = np.triu(np.ones((solves.shape[1],) * 2, dtype=bool), 1)
    equal = apart(found[:, :, None], found[:, None], turns, size) <= SAME
    off = np.maximum(margin[:, :, None], margin[:, None]) > AT_DEAD_POINT
    twice = (equal & solves[:, :, None] & solves[:, None] & pairs & off).sum()
    is_found = (apart(found, q[:, None], turns, size) < FOUND) & solves
    return len(q), int(twice), int((~is_found.any(1)).sum()), int(solves.sum())


def evaluated(mechanism):
    """Return `fk` and `ik` as derived equations and as CasADi functions."""
    functions = derive(mechanism, functions=FUNCTIONS).functions
    assert {f.name for f in functions} == {*FUNCTIONS}
    return functions, dict(zip((f.name for f in functions), lower(functions, "drawn"), strict=True))


def drawn_faults(seed):
    """Count the faults of a random mechanism.

    The mechanism's `ik` must have the pose as its only input.
    """
    mechanism = drawn_mechanism(seed).mechanism
    functions, compiled = evaluated(mechanism)
    assert all(len(f.inputs) == 1 for f in functions)
    lengths = [
        float(abs(x))
        for j in mechanism.joints
        for p in j.before
        if hasattr(p, "vector")
        for x in p.vector
    ]
    size = max([*lengths, 1e-9])
    near = dict(mechanism.reference)
    middle = np.array([float(near.get(c.name, 0)) for c in mechanism.coordinates])
    turns = np.array([c.kind == "revolute" for c in mechanism.coordinates])
    reach = np.where(turns, np.pi, 0.3 * size)
    draws = np.random.default_rng(seed).uniform(-1, 1, (20 * POSES, len(middle)))
    return faults(functions, compiled, middle + reach * draws, turns, size)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_mechanism_solutions_appear_exactly_once(seed):
    poses, twice, missing, solutions = drawn_faults(seed)
    assert poses > 0
    assert (twice, missing) == (0, 0)
    assert solutions >= poses


# --- inverse of the delta robot ---

BASE, ARM, ROD, PLATFORM = 0.2, 0.26, 0.8, 0.05
PLATFORM_POSES = 4


def rods(q, p):
    """Return errors of the squared rod lengths for angles q (..., 3), and their derivatives."""
    f, slope = [], []
    for k in range(3):
        c, s = np.cos(2 * np.pi / 3 * k), np.sin(2 * np.pi / 3 * k)
        out, cross_p, up = c * p[0] + s * p[1], -s * p[0] + c * p[1], p[2]
        # Each arm of the delta robot rotates about the y axis of its frame, and a positive angle
        # lowers the arm.
        x = out + PLATFORM - BASE - ARM * np.cos(q[..., k])
        z = up + ARM * np.sin(q[..., k])
        f.append(x**2 + cross_p**2 + z**2 - ROD**2)
        slope.append(2 * ARM * (x * np.sin(q[..., k]) + z * np.cos(q[..., k])))
    return np.stack(f, -1), np.stack(slope, -1)


def holding(p, rng):
    """Find all actuator values at a platform position by Newton's method."""
    q = rng.uniform(-np.pi, np.pi, (400, 3))
    for _ in range(60):
        f, slope = rods(q, p)
        q = q - np.clip(f / np.where(slope == 0, 1e-12, slope), -0.5, 0.5)
    q = q[np.abs(rods(q, p)[0]).max(-1) < 1e-12]
    found = []
    for one in np.remainder(q + np.pi, 2 * np.pi) - np.pi:
        if all(apart(one, other, True, 1.0) > 1e-6 for other in found):
            found.append(one)
    return np.array(found)


def test_delta_ik_finds_every_elbow_solution_exactly_once():
    functions, compiled = evaluated(read(ROBOTS / "delta.toml"))
    rng = np.random.default_rng(1)
    checked = 0
    for known in np.radians(rng.uniform(-30, 70, (PLATFORM_POSES, 3))):
        T = np.array(compiled["fk"](known)).reshape(16, 1)
        every = holding(T.reshape(4, 4)[:3, 3], rng)
        assert len(every) == 8
        poses = np.array(compiled["fk"](every.T)).reshape(16, -1)
        # Some actuator values reach the target position only in a different assembly mode.
        wanted = every[np.abs(poses - T).max(0) < 1e-9]
        q, _, residual = slots(functions, compiled, T)
        found = q[0][residual[0] < 1e-9]
        assert len(found) == len(wanted)
        for one in wanted:
            assert (apart(found, one, True, 1.0) < 1e-8).sum() == 1
        checked += len(wanted)
    assert checked > 2 * PLATFORM_POSES
