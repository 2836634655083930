"""Levenberg-Marquardt iteration on normal equations, for many errors and few variables.

    (J^T W J + mu I) step = -J^T v

These damped normal equations give each step in scaled variables. W contains the weights of the
errors in a robust loss, and v contains the weighted errors. A robust loss reduces the influence of
large errors. Normal equations cost a fifth of a singular value decomposition. Normal equations are
less accurate, but the next step of the iteration corrects the inaccuracy.

Source:
    K. Madsen, H. B. Nielsen, O. Tingleff, Methods for non-linear least squares problems, 2004, 3.2,
    for the damping; B. Triggs et al., Bundle adjustment, a modern synthesis, 2000, 4.3, for the
    loss.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_FIRST = 1e-10
"""Initial damping of the iteration, relative to the largest curvature at the start values. The
initial damping is small because the start values are near the solution."""
_MIN_WEIGHT = 1e-10
"""Minimum weight of an error in the matrix of the normal equations. The weight of an error is the
curvature of Cauchy's loss at this error, relative to the curvature at zero error."""
_MIN_FACTOR = 0.1
"""Smallest factor by which an accepted step multiplies the damping."""
_MAX_DAMPING = 1e12
"""Maximum damping of the iteration, relative to the largest curvature at the start values. With
more damping, steps change the sum of squares only by rounding errors."""


class Errors(NamedTuple):
    """The errors (M,) of a least-squares problem, and a function for their derivative (M, k)."""

    values: FloatArray
    derivative: Callable[[], FloatArray]


def least_squares(
    errors: Callable[[FloatArray], Errors],
    x: FloatArray,
    scale: float | FloatArray,
    *,
    loss_from: float = 0.0,
    step: float,
    evaluations: int,
) -> FloatArray:
    """Return the (k,) variables that minimize the sum of squared errors, or a robust loss.

    Args:
        errors: Function that returns the `Errors` for given variables (k,).
        x: (k,) start values of the iteration.
        scale: One scale for all variables, or (k,) scales with one scale per variable.
        loss_from: Error size s in Cauchy's loss log(1 + (e / s)^2) of an error e, or 0 for the sum
            of squares.
        step: The iteration stops if the relative change of the variables or the relative decrease
            of the cost is at most this value.
        evaluations: Maximum number of evaluations of the errors.
    """
    at = errors(x)
    cost, H, g = _equations(at, scale, loss_from)
    damping, faster = _FIRST, 2.0
    unit = float(np.diag(H).max(initial=1e-300))
    for _ in range(evaluations - 1):
        move = scale * _solved(H, damping * unit, g)
        after = errors(x + move)
        found = _cost(after.values, loss_from)
        expected = float((move / scale) @ (damping * unit * move / scale - g)) / 2
        is_small = np.linalg.norm(move) <= step * (step + np.linalg.norm(x))
        is_less = found < cost
        if is_less:
            gain = (cost - found) / max(expected, 1e-300)
            damping *= max(_MIN_FACTOR, 1 - (2 * gain - 1) ** 3)
            faster, x = 2.0, x + move
        if is_small or (is_less and cost - found <= step * cost) or damping > _MAX_DAMPING:
            return x
        if is_less:
            cost, H, g = _equations(after, scale, loss_from)
        else:
            damping, faster = damping * faster, 2 * faster
    return x


def _cost(e: FloatArray, size: float) -> float:
    return float((np.log1p((e / size) ** 2) * size**2).sum() if size else e @ e) / 2


def _equations(
    at: Errors, scale: float | FloatArray, size: float
) -> tuple[float, FloatArray, FloatArray]:
    """Return (cost, matrix, right-hand side) of the scaled normal equations."""
    J, e = scale * at.derivative(), at.values
    cost = _cost(e, size)
    if not size:
        return cost, J.T @ J, J.T @ e
    weight = 1 / (1 + (e / size) ** 2)
    curved = np.maximum(weight - 2 * (weight * e / size) ** 2, _MIN_WEIGHT)
    return cost, (J.T * curved) @ J, J.T @ (weight * e)


def _solved(H: FloatArray, damping: float, g: FloatArray) -> FloatArray:
    """Return the step that solves the damped normal equations.

    Rounding errors can make the matrix H of the normal equations indefinite.
    """
    damped = H + damping * np.eye(len(H))
    try:
        factor = scipy.linalg.cho_factor(damped, check_finite=False)
        return np.asarray(-scipy.linalg.cho_solve(factor, g), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.asarray(-np.linalg.lstsq(damped, g)[0], dtype=np.float64)
