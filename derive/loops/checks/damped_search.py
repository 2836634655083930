"""The search for the smallest gaps of loops: Levenberg and Marquardt's iteration by differences."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...model.tolerances import DIFFERENCE_STEP, GAP

Floats = NDArray[np.float64]
ITERATIONS = 80
START, WEAKEST, STRONGEST, FACTOR = 1e-4, 1e-15, 1e8, 2
"""Damping of the search at its start and at least and most, and its first growth."""
MOST_POOR = 2
"""Steps in succession without a worthwhile gain that end the search."""


def least(
    residual: Callable[[Floats], Floats],
    x: Floats,
    apart: NDArray[np.bool_],
    worthwhile: float,
) -> Floats:
    """Levenberg and Marquardt's iteration on the sum of squares, until gains are not worthwhile.

    The damping follows the part of the gain that the linear equations promise (Nielsen 1999): it
    falls to a third where they hold and grows ever faster where they do not.

    Args:
        residual: The residuals (m,) of values (n,), or (k, m) of (k, n).
        x: The values (n,) to start from.
        apart: Whether a value must be the same in all postures of one call, (n,).
        worthwhile: The part of the sum by which steps have to lower it.

    Returns:
        The values (n,) of the smallest sum that was found.

    Source:
        Nielsen 1999, Damping parameter in Marquardt's method.
    """
    if len(x) == 0:
        return x
    r, J = _linear(residual, x, apart)
    damping, growth, poor = START, FACTOR, 0
    for _ in range(ITERATIONS):
        if r @ r < (GAP / 10) ** 2 or damping > STRONGEST:
            break
        g = J.T @ r
        step = -np.linalg.solve(J.T @ J + damping * np.eye(len(x)), g)
        promised = float(step @ (damping * step - g))
        there, J_there = _linear(residual, x + step, apart)
        gained = float(r @ r - there @ there)
        if not gained > 0:
            damping, growth = damping * growth, growth * FACTOR
            continue
        poor = 0 if gained > worthwhile * (r @ r) else poor + 1
        x, r, J = x + step, there, J_there
        damping = max(damping * max(1 / 3, 1 - (2 * gained / promised - 1) ** 3), WEAKEST)
        growth = FACTOR
        if poor == MOST_POOR:
            break
    return x


def _linear(
    residual: Callable[[Floats], Floats], x: Floats, apart: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """Residuals (m,) at x (n,), and their Jacobian (m, n) by forward differences.

    Args:
        residual: The residuals (m,) of values (n,), or (k, m) of (k, n).
        x: The values.
        apart: Whether a value must be the same in all postures of one call, (n,).
    """
    steps = DIFFERENCE_STEP * np.eye(len(x))
    r, *ahead = residual(np.concatenate([x[None], x + steps[~apart]]))
    J = np.zeros((len(x), len(r)))
    J[~apart] = ahead
    for k in np.flatnonzero(apart):
        J[k] = residual(x + steps[k])
    return r, (J - r).T / DIFFERENCE_STEP


def differences(
    residual: Callable[[Floats], Floats], x: Floats, apart: NDArray[np.bool_]
) -> Floats:
    """The Jacobian of residuals by central differences, (m, n).

    Args:
        residual: The residuals (m,) of values (n,), or (k, m) of (k, n).
        x: The values.
        apart: Whether a value must be the same in all postures of one call, (n,).
    """
    steps = DIFFERENCE_STEP * np.eye(len(x))
    J = np.zeros((len(x), len(residual(x))))
    together = steps[~apart]
    if len(together):
        ahead, behind = np.split(residual(x + np.concatenate([together, -together])), 2)
        J[~apart] = ahead - behind
    for k in np.flatnonzero(apart):
        J[k] = residual(x + steps[k]) - residual(x - steps[k])
    return J.T / (2 * DIFFERENCE_STEP)
