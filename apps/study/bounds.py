"""Bounds of the tool position along each axis, by optimization from the best of many samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import requires

from .samples import Samples

FloatArray = NDArray[np.float64]

_STARTS = 8
"""Number of start configurations for each bound. Few suffice, since local optima are few."""
_CALLS = 1000
"""Maximum number of evaluations of an optimization."""
_STEP = 1e-12
"""Step length below which an optimization stops, relative to the coordinate ranges."""
_SLOPE = 1e-14
"""Gradient below which an optimization stops, for coordinates relative to the ranges."""


def bounds_of(robot: Robot, points: Samples) -> FloatArray:
    """Return the smallest and largest coordinates of the tool origin in the box of the samples.

    Each bound is a local optimum, found with the exact Jacobian from the eight best of the first
    2^16 samples.

    Args:
        robot: The robot.
        points: Samples of the configurations of the robot.

    Returns:
        (2, 3) smallest and largest x, y, z [m].

    Raises:
        InputValueError: The loops do not close at any sample.
    """
    q = np.concatenate([block.copy() for block in points.blocks(0)])
    p = robot.fk(q)[:, :3, 3]
    closed = np.isfinite(p).all(-1)
    if not closed.any():
        raise InputValueError(
            f"{robot.name}: the loops close at none of {len(q)} samples; check the limits"
        )
    q, p = q[closed], p[closed]
    ends = np.empty((2, 3))
    for axis in range(3):
        for k, sign in enumerate((1, -1)):
            starts = q[np.argsort(sign * p[:, axis])[:_STARTS]]
            sampled = sign * p[:, axis].min() if sign > 0 else -p[:, axis].max()
            found = min(_least(robot, start, points, axis, sign) for start in starts)
            ends[k, axis] = sign * min(found, sampled)
    return ends


def _least(robot: Robot, start: FloatArray, points: Samples, axis: int, sign: int) -> float:
    """Minimize a coordinate of the tool from a start; for sign -1, maximize it."""
    with requires("chasles[study]"):
        from scipy.optimize import minimize  # noqa: PLC0415

    def value(q: FloatArray) -> tuple[float, FloatArray]:
        T, J = robot.fk_jacobian_mixed(q[None])
        p, gradient = T[0, axis, 3], J[0, axis]
        # Open loops get a large finite value, since the line search interpolates between values.
        return (sign * p, sign * gradient) if np.isfinite(p) else (wall, np.zeros_like(q))

    T = robot.fk(start[None])
    wall = sign * float(T[0, axis, 3]) + float(np.abs(T[0, :3, 3]).max())
    bounds = list(zip(points.lower, points.upper, strict=True))
    options = {"maxfun": _CALLS, "ftol": 0.0, "xtol": _STEP, "gtol": _SLOPE}
    # Other methods call BLAS on tiny matrices, which is slow because BLAS threads synchronize.
    with np.errstate(invalid="ignore"):
        found = minimize(value, start, jac=True, method="TNC", bounds=bounds, options=options)
    return float(found.fun)
