"""Levenberg-Marquardt search for the smallest closure errors of loops."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...model.tolerances import DIFFERENCE_STEP, NUMERICALLY_CLOSED

Floats = NDArray[np.float64]
ITERATIONS = 80
START, WEAKEST, STRONGEST, FACTOR = 1e-4, 1e-15, 1e8, 2
"""Initial, minimum and maximum damping, and the factor of the first damping increase."""
MAX_POOR = 2
"""Number of consecutive steps with little gain after which the search ends."""


def least(
    residual: Callable[[Floats], Floats],
    x: Floats,
    apart: NDArray[np.bool_],
    worthwhile: float,
) -> Floats:
    """Minimize a sum of squared residuals by the Levenberg-Marquardt method.

    The damping follows from the ratio of actual to predicted decrease of the sum of squares
    (Nielsen 1999). The damping falls to a third if the linear model holds. If a step does not
    decrease the sum of squares, the damping grows by increasing factors.

    Args:
        residual: Maps values (n,) to residuals (m,), or a batch (k, n) to (k, m).
        x: The start values (n,).
        apart: Mask (n,) of values that must be equal in all rows of a batch.
        worthwhile: Minimum relative decrease of the sum of squared residuals that counts as
            progress.

    Returns:
        The values (n,) with the smallest sum of squared residuals that the search found.

    Source:
        Nielsen 1999, Damping parameter in Marquardt's method.
    """
    if len(x) == 0:
        return x
    r, J = _linear(residual, x, apart)
    damping, growth, poor = START, FACTOR, 0
    for _ in range(ITERATIONS):
        if r @ r < (NUMERICALLY_CLOSED / 10) ** 2 or damping > STRONGEST:
            break
        g = J.T @ r
        try:
            step = -np.linalg.solve(J.T @ J + damping * np.eye(len(x)), g)
        except np.linalg.LinAlgError:
            # If the damping is as small as the rounding errors, the damped normal matrix may be
            # singular.
            damping, growth = damping * growth, growth * FACTOR
            continue
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
        if poor == MAX_POOR:
            break
    return x


def _linear(
    residual: Callable[[Floats], Floats], x: Floats, apart: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """Return the residuals (m,) at x (n,), and their Jacobian (m, n) by forward differences.

    Args:
        residual: Maps values (n,) to residuals (m,), or a batch (k, n) to (k, m).
        x: The values.
        apart: Mask (n,) of values that must be equal in all rows of a batch.
    """
    steps = DIFFERENCE_STEP * np.eye(len(x))
    r, *ahead = residual(np.concatenate([x[None], x + steps[~apart]]))
    J = np.zeros((len(x), len(r)))
    J[~apart] = ahead
    for k in np.flatnonzero(apart):
        J[k] = residual(x + steps[k])
    return r, (J - r).T / DIFFERENCE_STEP
