"""Sizes of expressions, counted without expanding them."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import sympy as sp

MANY = 10_000
"""Maximum value that ``addends`` and ``size`` return."""
_NONE: Mapping[sp.Symbol, int] = MappingProxyType({})


def addends(expression: sp.Expr, known: Mapping[sp.Symbol, int] = _NONE) -> int:
    """Return an upper bound of the number of terms after expansion, limited to ``MANY``.

    Args:
        expression: An expression.
        known: For each symbol that stands for a sum: the number of terms of this sum.
    """
    if expression.is_Symbol:
        return known.get(expression, 1)
    if expression.is_Add:
        count = sum(addends(addend, known) for addend in expression.args)
    elif expression.is_Mul:
        count = math.prod(addends(factor, known) for factor in expression.args)
    elif expression.is_Pow and expression.exp.is_Integer and expression.exp > 0:
        count = addends(expression.base, known) ** int(expression.exp)
    else:
        count = 1
    return min(count, MANY)


def size(expression: sp.Expr, known: Mapping[sp.Symbol, int]) -> int:
    """Return the number of symbols and numbers in an expression, limited to ``MANY``.

    Args:
        expression: An expression.
        known: For each symbol that stands for an expression, the size of the expression.
    """
    if expression.is_Symbol:
        return known.get(expression, 1)
    return min(sum(size(part, known) for part in expression.args) or 1, MANY)
