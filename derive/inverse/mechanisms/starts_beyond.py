"""Start values near dead points, where the closed form of a loop has no real root.

The loops of a robot as built can be closed slightly beyond the dead points of the design.
Therefore, the design has no solution beyond a dead point, where x in its equation h^2 = x is
slightly negative. The equation of the robot as built is h^2 = x + e, where e is about as large as
|x|. This equation has solutions on both sides of the dead point. The two square roots of |x| give
one start value on each side of the dead point.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.terms import Terms

ROOT = sp.Rational(1, 2)


def beyond_dead_points(terms: Terms, entries: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Replaces sqrt(x) by sqrt(|x|) in expressions; real values do not change.

    Args:
        terms: Table of named terms; receives the new terms.
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
    """Replaces known terms, and takes the absolute value under square roots."""
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
