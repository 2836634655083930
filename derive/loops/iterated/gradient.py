"""Overconstrained loops in the least-squares sense: the gradient of their gaps as equations.

With the gaps c_i (metre; entries of rotations times the length l) the configuration nearest to
closure has the least sum of c_i^2 / 2, so that its gradient by the unknown variables is zero:

    g_u = sum_i c_i dc_i/du = 0

These are as many equations as unknown variables. Their derivative holds the second derivatives of
the gaps, and is regular where the gaps are small and their derivative has full rank. So Newton's
iteration, rates and accelerations are those of loops that close.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.terms import Terms
from ..constraints import LoopEquations, derivative_rows

UNIT = "m"
"""Unit of each entry of the gradient: where the variable is an angle, the entry is divided by the
length."""


def gradient(
    equations: Sequence[LoopEquations],
    terms: Terms,
    unknown: Sequence[sp.Symbol],
    is_length: Sequence[bool],
    length: float,
) -> tuple[sp.Expr, ...]:
    """The gradient of half the sum of squared gaps, named, one entry for each unknown variable.

    Args:
        equations: The equations of all loops.
        terms: Names of all terms.
        unknown: The variables that the loops have to determine (radian or metre).
        is_length: Which of them are lengths.
        length: The length (metre) that compares angles with lengths.
    """
    size = sp.Rational(f"{length:.3g}")
    weights = [size if unit == "1" else sp.S.One for loop in equations for unit in loop.units]
    gaps = [
        terms.let(weight * entry)
        for weight, entry in zip(
            weights, (e for loop in equations for e in loop.residual), strict=True
        )
    ]
    rows = derivative_rows(gaps, terms, unknown)
    return tuple(
        terms.let(
            sum((gap * slope for gap, slope in zip(gaps, column, strict=True)), sp.S.Zero)
            / (1 if is_long else size)
        )
        for column, is_long in zip(zip(*rows, strict=True), is_length, strict=True)
    )
