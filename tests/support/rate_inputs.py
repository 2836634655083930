"""Ranges of coordinates, coordinates and twists at random, and what rates make of them."""

import numpy as np

from chasles import Robot

CLOSURE = 1e-12
"""J qd against V, relative to the size of V: rounding by the condition of J."""
HELD = np.radians([[50, 170, -70], [92, 212, -28]])
"""Lowest and highest angles of the cranks at which the platform of planar_3rrr is held everywhere,
with couplers of 130 and of 170 mm."""
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
"""Robots with Jacobians, which have joint rates."""


def held(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """The limits (n,), or for three cranks without limits `HELD`."""
    if np.isfinite(robot.lower).all() and np.isfinite(robot.upper).all():
        return robot.lower, robot.upper
    return HELD[0], HELD[1]


def span(robot: Robot, reach: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The limits (n,); without limits, the reach to both sides of the reference or of 0."""
    centre = np.zeros(robot.n) if robot.reference is None else np.array(robot.reference.q)
    lower = np.where(np.isfinite(robot.lower), robot.lower, centre - reach)
    upper = np.where(np.isfinite(robot.upper), robot.upper, centre + reach)
    return lower, upper


def inside(robot, count, seed=0, margin=0.1):
    """Configurations within the limits, or within a turn, where loops close."""
    rng = np.random.default_rng(seed)
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    room = margin * (upper - lower)
    q = rng.uniform(lower + room, upper - room, (count, robot.n))
    return q[np.isfinite(robot.jacobian_mixed(q)).all((-2, -1))]


def twists(count, seed=1):
    return np.random.default_rng(seed).normal(size=(count, 6)) * [0.1, 0.1, 0.1, 0.3, 0.3, 0.3]


def pure(robot, q, length=None):
    """The Jacobian in pure numbers, and the units of the coordinates."""
    length = robot.characteristic_length if length is None else length
    unit = np.where([c.kind == "revolute" for c in robot.coordinates], 1.0, length)
    row = np.repeat([1 / length, 1.0], 3)
    return row[:, None] * robot.jacobian_mixed(q) * unit, row, unit


def reached(robot, q, qd):
    return np.einsum("...ij,...j->...i", robot.jacobian_mixed(q), qd)
