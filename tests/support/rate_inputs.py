"""Random coordinates and twists for tests of joint rates."""

import numpy as np

from chasles import Robot

CLOSURE = 1e-12
"""Tolerance of J qd - V relative to |V|, for a Jacobian J, joint rates qd and a twist V."""
HELD = np.radians([[50, 170, -70], [92, 212, -28]])
"""Crank limits between which planar_3rrr is never singular, with couplers of 130 mm or 170 mm."""
WITH_RATES = [
    "board_installer",
    "bricklaying_gantry",
    "delta",
    "excavator",
    "five_bar",
    "iiwa14",
    "irb6640",
    "jaco2",
    "lynxmotion",
    "panda",
    "photo_robot",
    "puma560",
    "scara",
    "stanford",
    "ur5e",
    "well_manipulator",
]
"""Names of robots with Jacobians and joint rates."""


def sampling_limits(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper limits (n,) for random coordinates.

    For a robot without limits, the returned limits are `HELD`. The only tested robots without
    limits are planar_3rrr and its variants.
    """
    if np.isfinite(robot.lower).all() and np.isfinite(robot.upper).all():
        return robot.lower, robot.upper
    return HELD[0], HELD[1]


def span(robot: Robot, reach: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (lower, upper) limits (n,) of all coordinates.

    An unlimited coordinate has limits at the distance ``reach`` from its reference value, or from 0
    without a reference.
    """
    center = np.zeros(robot.n) if robot.reference is None else np.array(robot.reference.q)
    lower = np.where(np.isfinite(robot.lower), robot.lower, center - reach)
    upper = np.where(np.isfinite(robot.upper), robot.upper, center + reach)
    return lower, upper


def inside(robot, count, seed=0, margin=0.1):
    """Return configurations within limits, at which all loops close."""
    rng = np.random.default_rng(seed)
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    room = margin * (upper - lower)
    q = rng.uniform(lower + room, upper - room, (count, robot.n))
    return q[np.isfinite(robot.jacobian_mixed(q)).all((-2, -1))]


def twists(count, seed=1):
    return np.random.default_rng(seed).normal(size=(count, 6)) * [0.1, 0.1, 0.1, 0.3, 0.3, 0.3]


def pure(robot, q, length=None):
    """Return the dimensionless Jacobian, and the scales of its rows and coordinates."""
    length = robot.characteristic_length if length is None else length
    unit = np.where([c.kind == "revolute" for c in robot.coordinates], 1.0, length)
    row = np.repeat([1 / length, 1.0], 3)
    return row[:, None] * robot.jacobian_mixed(q) * unit, row, unit


def reached(robot, q, qd):
    return np.einsum("...ij,...j->...i", robot.jacobian_mixed(q), qd)
