"""Equations of overconstrained loops: the gradient of the sum of squared closure errors.

The closure errors c_i are in meters. Direction errors are multiplied by a length l to convert them
to meters. The least-squares configuration minimizes half the sum of the squared closure errors
c_i^2. In the least-squares configuration, the gradient g_u of half this sum with respect to the
unknown variables u is zero.

    g_u = sum_i c_i dc_i/du = 0.

The condition g_u = 0 consists of as many equations as there are unknown variables. The Jacobian of
g_u contains second derivatives of the closure errors. The Jacobian of g_u is regular if the closure
errors c_i are small and their Jacobian has full rank. If the Jacobian of g_u is regular, Newton's
method solves g_u = 0. The joint rates and accelerations then follow from the time derivatives of
g_u = 0.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.terms import Terms
from .constraints import ClosureEquations, derivative_rows

UNIT = "m"
"""Unit of each gradient entry, after the entries for angles are divided by the length l."""


def gradient(
    equations: Sequence[ClosureEquations],
    terms: Terms,
    unknown: Sequence[sp.Symbol],
    is_length: Sequence[bool],
    length: float,
) -> tuple[sp.Expr, ...]:
    """Return the gradient of half the sum of squared closure errors, one entry per variable.

    Args:
        equations: The equations of all loops.
        terms: Table of named terms.
        unknown: The unknown variables (radian or meter).
        is_length: Mask of the unknown variables that are lengths.
        length: The length l (meter) that converts direction errors to meters.
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
