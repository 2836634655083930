"""Start values near the dead points of loops.

The loops of a built robot can be closed slightly beyond the dead points of the design. The equation
of a loop of the design is h^2 = x, with x = 0 at the dead point. Beyond the dead point of the loop,
x is slightly negative, so the equation h^2 = x has no real solution. The errors of the built robot
change the loop equation to h^2 = x + e, where e is about as large as |x|. The equation h^2 = x + e
of the built robot has a solution on each side of the dead point. The two roots h of the equation
h^2 = |x| are start values for the solutions of the built robot.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.terms import Terms

ROOT = sp.Rational(1, 2)


def beyond_dead_points(terms: Terms, entries: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Replace sqrt(x) by sqrt(|x|) in expressions.

    For x >= 0, the value of sqrt(x) does not change.

    Args:
        terms: Table of named terms, to which the function adds the new terms.
        entries: The actuated coordinates as functions of the main-chain joints.
    """
    known: dict[sp.Basic, sp.Basic] = {}
    for symbol in terms.needed(entries):
        pair = terms.solved.get(symbol)
        if pair is not None:
            c, s = (_changed(terms, part, known) for part in pair)
            changed = terms.solved_angle(c, s) if (c, s) != pair else symbol
        else:
            definition = terms.definitions[symbol]
            found = _changed(terms, definition, known)
            changed = symbol if found == definition else terms.let(found)
        if changed != symbol:
            known[symbol] = changed
    return tuple(terms.let(_changed(terms, entry, known)) for entry in entries)


def _changed(terms: Terms, expression: sp.Expr, known: dict[sp.Basic, sp.Basic]) -> sp.Expr:
    if not expression.args:
        return known.get(expression, expression)
    args = [_changed(terms, argument, known) for argument in expression.args]
    if expression.is_Pow and args[1] == ROOT and not terms.is_constant(args[0]):
        return sp.sqrt(terms.let(sp.Abs(args[0])))
    if args == list(expression.args):
        return expression
    if isinstance(expression, sp.atan2 | sp.Min | sp.Max | sp.Piecewise):
        return expression.func(*args, evaluate=False)
    return expression.func(*args)
