"""Equal forms of expressions that are shorter to read: sums multiplied out, factors in front."""

import sympy as sp
from sympy.simplify.fu import TR10i

from ...model.sizes import addends, size

MOST_MULTIPLIED = 60
"""Most addends of a product of sums that is multiplied out to see whether it becomes shorter."""
MOST_GATHERED = 4
"""Most terms of a sum whose common root is written in front of it; a longer sum breaks lines."""


def reduced(constant: sp.Expr) -> sp.Expr:
    """A constant of parameters, multiplied out and its angles added where that makes it shorter."""
    if constant.is_Atom or addends(constant) > MOST_MULTIPLIED:
        return constant
    forms = [constant, sp.expand(constant)]
    if any(isinstance(e, sp.cos | sp.sin) for e in forms[1].atoms(sp.Function)):
        forms.append(TR10i(forms[1]))
    return min(forms, key=lambda form: size(form, {}))


def gathered(expression: sp.Expr) -> sp.Expr:
    """An expression with the root that all terms of a short sum have in front of the sum."""
    if not any(power.base.is_Rational for power in expression.atoms(sp.Pow)):
        return expression
    if expression.is_Mul:
        return sp.Mul(*map(gathered, expression.args))
    if not expression.is_Add or len(expression.args) > MOST_GATHERED:
        return expression
    terms = [gathered(addend) for addend in expression.args]
    roots = {abs(_number(term)) for term in terms}
    common = roots.pop()
    if roots or common.is_Rational:
        return expression
    return sp.Mul(common, sp.Add(*(term / common for term in terms)))


def _number(term: sp.Expr) -> sp.Expr:
    """The factor of a term that is a number."""
    return sp.Mul(*(factor for factor in sp.Mul.make_args(term) if factor.is_number))
