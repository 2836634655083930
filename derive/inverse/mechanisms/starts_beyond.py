"""Starts beside dead points: the formulas of loops where their roots have no real value.

The loops of a robot as built close a little further than those of its design, so that the design
has no solution beside a dead point. Its equation there is h^2 = x, with x a little below zero. The
true robot then has h^2 = x + e, where e is about as large as x, and solutions to both sides of the
dead point. The square root of |x| gives a start to each side, as far from it as they may be.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.terms import Terms

ROOT = sp.Rational(1, 2)


def beyond_dead_points(terms: Terms, entries: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """The formulas with sqrt(|x|) in place of sqrt(x), which are the same where they are real.

    Args:
        terms: Holds the terms, and receives the new ones.
        entries: The actuated coordinates, in the joints of the main chain.
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
    """An expression with other terms, and with the magnitudes of what is below its roots."""
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
