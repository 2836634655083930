"""Shortens expressions."""

import sympy as sp
from sympy.simplify.fu import TR10i

from ...model.sizes import addends, size

MAX_MULTIPLIED = 60
"""A constant is expanded only if it has at most this number of terms after expansion."""
MAX_ADDED = 400
"""Maximum number of operations in an expression to which angle addition theorems are applied,
because SymPy compares all pairs of angles."""
MAX_GATHERED = 4
"""Maximum number of terms in a sum from which a common root is factored out."""


def reduced(constant: sp.Expr) -> sp.Expr:
    """Shorten a constant that contains parameters."""
    if constant.is_Atom or addends(constant) > MAX_MULTIPLIED:
        return constant
    forms = [constant, sp.expand(constant)]
    has_angles = any(isinstance(e, sp.cos | sp.sin) for e in forms[1].atoms(sp.Function))
    if has_angles and forms[1].count_ops() <= MAX_ADDED:
        forms.append(TR10i(forms[1]))
    return min(forms, key=lambda form: size(form, {}))


def gathered(expression: sp.Expr) -> sp.Expr:
    """Factor a common root out of a short sum."""
    if not any(power.base.is_Rational for power in expression.atoms(sp.Pow)):
        return expression
    if expression.is_Mul:
        return sp.Mul(*map(gathered, expression.args))
    if not expression.is_Add or len(expression.args) > MAX_GATHERED:
        return expression
    terms = [gathered(addend) for addend in expression.args]
    roots = {abs(_number(term)) for term in terms}
    common = roots.pop()
    if roots or common.is_Rational:
        return expression
    return sp.Mul(common, sp.Add(*(term / common for term in terms)))


def _number(term: sp.Expr) -> sp.Expr:
    return sp.Mul(*(factor for factor in sp.Mul.make_args(term) if factor.is_number))
