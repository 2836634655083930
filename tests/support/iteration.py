"""Configurations and pose errors for tests of iterative inverse kinematics."""

import numpy as np

from chasles import se3
from tests.support.rate_inputs import span

TOLERANCE = 1e-9
ROUNDING = 1e-13
"""Tolerance of a recomputed residual (meter, radian)."""
POSITION = (1, 1, 1, 0, 0, 0)
PLATFORMS = ("stewart_gough", "planar_3rrr")


def configurations(robot, count, seed=3):
    """Return random configurations within the joint limits at which all loops close."""
    reach = np.array([np.pi if c.unit == "rad" else 1.0 for c in robot.coordinates])
    q = np.random.default_rng(seed).uniform(*span(robot, reach), (50 * count, robot.n))
    q = q[np.isfinite(robot.fk(q)).all((1, 2))][:count]
    assert len(q) == count
    return q


def within(robot, q):
    return ((q >= robot.lower) & (q <= robot.upper)).all()


def distance(A, B):
    return np.linalg.norm(A[..., :3, 3] - B[..., :3, 3], axis=-1)


def away(A, B, unit=1.0):
    """Return the larger of two errors: the distance, and the rotation angle times a unit length."""
    turn = se3.log(se3.inverse(A) @ B)[..., 3:]
    return np.maximum(distance(A, B), unit * np.linalg.norm(turn, axis=-1))


def same(a, b):
    """Test whether arrays are equal bit by bit, including NaN."""
    return all(
        np.array_equal(x, y, equal_nan=x.dtype.kind == "f") for x, y in zip(a, b, strict=True)
    )
