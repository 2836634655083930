"""Violations of coordinate, rate and acceleration limits by a trajectory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError
from chasles.contract import check_type

from ..arguments import real
from .trajectory import Trajectory

FloatArray = NDArray[np.float64]

_ROUNDING = 1e-9
"""Relative excess over a limit that counts as a rounding error."""


@dataclass(frozen=True, eq=False)
class LimitViolation:
    """A limit that a trajectory exceeds, with the largest excess.

    Attributes:
        coordinate: Name of the coordinate whose limit is exceeded.
        limit: The exceeded limit: "lower", "upper", "rate" or "acceleration".
        amount: Largest excess over the limit, in the unit of the limit (rad or m, per second for
            rates, per second squared for accelerations).
        t: Time of the largest excess [s].
    """

    coordinate: str
    limit: str
    amount: float
    t: float

    def __str__(self) -> str:
        """Return the violation of the limit as a sentence."""
        return (
            f"{self.coordinate} exceeds its {self.limit} limit by {self.amount:.3g} at "
            f"{self.t:.3f} s"
        )


def limit_violations(
    robot: Robot,
    trajectory: Trajectory,
    *,
    rate_limits: ArrayLike | None = None,
    acceleration_limits: ArrayLike | None = None,
) -> list[LimitViolation]:
    """Return the limits that a trajectory exceeds, each with the largest excess.

    Args:
        robot: The robot. The coordinate limits of the robot are always checked.
        trajectory: A trajectory of the robot.
        rate_limits: Maximum rate of each coordinate (n,), or one number for all [rad/s or m/s].
            None means that rates are not checked.
        acceleration_limits: Maximum acceleration of each coordinate (n,), or one number for all
            [rad/s^2 or m/s^2]. None means that accelerations are not checked.

    Raises:
        InputTypeError: `robot` is not a `Robot`, or `trajectory` is not a `Trajectory`.
        ShapeError: `trajectory` does not have n coordinates, or `rate_limits` or
            `acceleration_limits` is neither a number nor (n,).
        InputValueError: A rate or acceleration limit is not above 0.
    """
    check_type("limit_violations: robot", robot, Robot)
    check_type("limit_violations: trajectory", trajectory, Trajectory)
    if trajectory.q.shape[1:] != (robot.n,):
        raise ShapeError(
            f"limit_violations: trajectory: expected {robot.n} coordinates of {robot.name}, got "
            f"shape {trajectory.q.shape}"
        )
    bounds = [("lower", -trajectory.q, -robot.lower), ("upper", trajectory.q, robot.upper)]
    for name, values, limits in (
        ("rate", trajectory.qd, rate_limits),
        ("acceleration", trajectory.qdd, acceleration_limits),
    ):
        if limits is not None:
            bounds.append((name, np.abs(values), per_coordinate(f"{name}_limits", limits, robot.n)))
    found = []
    for name, values, limit in bounds:
        rounding = _ROUNDING * np.maximum(np.abs(limit), 1)
        allowed = np.where(np.isfinite(limit), limit + rounding, np.inf)
        for j in np.flatnonzero((values > allowed).any(0)):
            k = int(np.argmax(values[:, j]))
            amount, t = float(values[k, j] - limit[j]), float(trajectory.t[k])
            found.append(LimitViolation(trajectory.coordinate_names[j], name, amount, t))
    return found


def per_coordinate(name: str, limits: ArrayLike, n: int) -> FloatArray:
    """Return the limits (n,) of all coordinates from one number or n numbers.

    Raises:
        ShapeError: `limits` is neither a number nor (n,).
        InputValueError: A rate or acceleration limit is not above 0.
    """
    values = real(name, limits)
    if values.shape not in ((), (n,)):
        raise ShapeError(f"{name}: expected a number or ({n},), got shape {values.shape}")
    if not (values > 0).all():
        raise InputValueError(f"{name}: expected values above 0, got {values}")
    return np.broadcast_to(values, (n,))
