"""A formula of one derivation with its arguments replaced by what another derivation found."""

from collections.abc import Mapping, Sequence

import sympy as sp

from ..scope import Scope


def substituted(
    scope: Scope, entries: Sequence[sp.Expr], values: Mapping[sp.Symbol, sp.Expr]
) -> tuple[sp.Expr, ...]:
    """Entries in terms of a scope, with symbols replaced in all the terms that they rest on.

    Cosines and sines of solved angles come from the pairs that gave them, and angles that were
    solved in the formula are solved again: no trigonometric function is added.

    Args:
        scope: Holds the terms, and receives the new ones.
        entries: The formula.
        values: What its arguments become.
    """
    known: dict[sp.Symbol, sp.Expr] = dict(values)
    for symbol in scope.needed(entries):
        definition = scope.terms[symbol]
        if known.keys().isdisjoint(definition.free_symbols):
            continue
        known[symbol] = _again(scope, symbol, definition, known)
    return tuple(scope.let(_replaced(scope, entry, known)) for entry in entries)


def _again(
    scope: Scope, symbol: sp.Symbol, definition: sp.Expr, known: Mapping[sp.Symbol, sp.Expr]
) -> sp.Expr:
    if symbol in scope.solved:
        c, s = (_replaced(scope, part, known) for part in scope.solved[symbol])
        return scope.solved_angle(c, s)
    return scope.let(_replaced(scope, definition, known))


def _replaced(scope: Scope, expression: sp.Expr, known: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The expression with its symbols replaced, cosines and sines by their pairs."""
    if expression.func in (sp.cos, sp.sin):
        angle = sp.expand(_replaced(scope, expression.args[0], known))
        c, s = scope.cos_sin(angle)
        return c if expression.func is sp.cos else s
    if not expression.args:
        return known.get(expression, expression)
    if known.keys().isdisjoint(expression.free_symbols):
        return expression
    args = [_replaced(scope, argument, known) for argument in expression.args]
    if isinstance(expression, sp.atan2 | sp.Min | sp.Max | sp.Piecewise):
        return expression.func(*args, evaluate=False)
    return expression.func(*args)
