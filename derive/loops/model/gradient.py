"""Least-squares closure of overconstrained loops: the gradient of closure errors as equations.

The closure errors c_i are in meters; errors of directions are multiplied by a length l. The
configuration with the smallest closure errors minimizes the sum of c_i^2 / 2, so its gradient with
respect to the unknown variables is zero:

    g_u = sum_i c_i dc_i/du = 0, with the unknown variables u.

The number of gradient equations equals the number of unknown variables. The Jacobian of the
gradient equations contains second derivatives of the closure errors. The Jacobian of the gradient
equations is regular if the closure errors are small and their derivative has full rank. Therefore,
Newton's iteration, joint rates and joint accelerations are computed in the same manner as for loops
that close.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.terms import Terms
from .constraints import LoopEquations, derivative_rows

UNIT = "m"
"""Unit of each entry of the gradient. Entries for angles are divided by the length l."""


def gradient(
    equations: Sequence[LoopEquations],
    terms: Terms,
    unknown: Sequence[sp.Symbol],
    is_length: Sequence[bool],
    length: float,
) -> tuple[sp.Expr, ...]:
    """Returns the gradient of half the sum of squared errors, one entry per unknown variable.

    Args:
        equations: The equations of all loops.
        terms: Names of all terms.
        unknown: The variables that the loops determine (radian or meter).
        is_length: Mask of the unknown variables that are lengths.
        length: The length (meter) that scales angles against lengths.
    """
    size = sp.Rational(f"{length:.3g}")
    weights = [size if unit == "1" else sp.S.One for loop in equations for unit in loop.units]
    residuals = [
        terms.let(weight * entry)
        for weight, entry in zip(
            weights, (e for loop in equations for e in loop.residual), strict=True
        )
    ]
    rows = derivative_rows(residuals, terms, unknown)
    return tuple(
        terms.let(
            sum(
                (residual * slope for residual, slope in zip(residuals, column, strict=True)),
                sp.S.Zero,
            )
            / (1 if is_long else size)
        )
        for column, is_long in zip(zip(*rows, strict=True), is_length, strict=True)
    )
