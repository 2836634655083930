"""Redundancy resolution of a camera robot on random camera paths.

The camera moves on a spline through random points for 10 s, and points at a fixed target. The joint
limits are random. If a search on a dense grid finds a continuous motion, the redundancy resolution
must also find a motion along the path within the limits.
"""

import numpy as np
from scipy.interpolate import CubicSpline

import chasles
from chasles.study.motion import resolve_redundancy
from tests.support.oracles.self_motion import look_at, reached_poses

from .campaign import Campaign, Outcome

SAMPLES, CELLS = 400, 48
"""Number of poses on a camera path, and number of grid points per redundancy parameter in the
reference solution."""
ORACLE = 51
"""Number of path poses that the reference solution tests, including the first and last pose."""
ON_PATH = 1e-9
"""Maximum pose difference between motion and path (meter, rotation matrix entries)."""


def trial(number: int) -> Outcome:
    robot, rng = chasles.load("photo_robot"), np.random.default_rng(number)
    limits, T, q_seed = drawn_path(robot, rng)
    try:
        path = resolve_redundancy(robot, T, q_seed, limits=limits)
    except chasles.OutOfReachError as error:
        chosen = T[np.linspace(0, SAMPLES - 1, ORACLE).round().astype(int)]
        if reached_poses(robot, chosen, limits, CELLS) == ORACLE:
            return Outcome({"missed": 1}, failures=(f"a motion exists: {error}",))
        return Outcome({"out of reach": 1})
    outside = ~((path.q >= limits[:, 0]) & (path.q <= limits[:, 1]))
    failures: tuple[str, ...] = ()
    if not path.complete or outside.any():
        failures = (f"the motion leaves the limits or the path: {path}",)
    elif np.abs(robot.fk(path.q) - T).max() > ON_PATH:
        failures = ("the motion leaves the path",)
    return Outcome({"resolved": 1}, failures=failures)


def drawn_path(robot, rng):
    """Return joint limits (n, 2), camera poses (m, 4, 4) and a seed configuration (n,)."""
    half = np.where([c.unit == "m" for c in robot.coordinates], 0.4, rng.uniform(0.6, 2.8))
    half = half * rng.uniform(0.6, 1.4, robot.n)
    middle = rng.uniform(-0.4, 0.4, robot.n)
    limits = np.clip(np.stack([middle - half, middle + half], -1), -3.1, 3.1)
    q_seed = middle + rng.uniform(-0.3, 0.3, robot.n) * half
    start = robot.fk(q_seed)
    knots = start[:3, 3] + rng.uniform(-0.6, 0.6, (5, 3)) * np.linspace(0, 1, 5)[:, None]
    eye = CubicSpline(np.linspace(0, 1, 5), knots)(np.linspace(0, 1, SAMPLES))
    target = start[:3, 3] + rng.uniform(2, 5) * start[:3, 2]
    return limits, look_at(eye, target), q_seed


CAMPAIGN = Campaign(
    "redundancy",
    "A redundancy that some motion within the limits resolves is resolved within the limits.",
    trial,
)
