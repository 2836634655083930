"""Substitution of expressions for symbols."""

from collections.abc import Mapping, Sequence

import sympy as sp

from ...terms.terms import Terms


def substituted(
    terms: Terms, entries: Sequence[sp.Expr], values: Mapping[sp.Symbol, sp.Expr]
) -> tuple[sp.Expr, ...]:
    """Replace symbols in expressions and in the terms that the expressions contain.

    The cosine and sine of a solved angle are reused, so no trigonometric function is added.

    Args:
        terms: Table of named terms, to which the function adds the new terms.
        entries: The expressions.
        values: Replacement expressions, keyed by symbol.
    """
    known: dict[sp.Symbol, sp.Expr] = dict(values)
    for symbol in terms.needed(entries):
        definition = terms.definitions[symbol]
        if known.keys().isdisjoint(definition.free_symbols):
            continue
        known[symbol] = _again(terms, symbol, definition, known)
    return tuple(terms.let(_replaced(terms, entry, known)) for entry in entries)


def symbols_behind(terms: Terms, entries: Sequence[sp.Expr]) -> set[sp.Symbol]:
    """Return the symbols on which expressions depend, directly or through terms."""
    found = [*entries, *(terms.definitions[symbol] for symbol in terms.needed(entries))]
    found += [part for s in terms.needed(entries) if s in terms.solved for part in terms.solved[s]]
    return {symbol for entry in found for symbol in entry.free_symbols}


def _again(
    terms: Terms, symbol: sp.Symbol, definition: sp.Expr, known: Mapping[sp.Symbol, sp.Expr]
) -> sp.Expr:
    if symbol in terms.solved:
        c, s = (_replaced(terms, part, known) for part in terms.solved[symbol])
        return terms.solved_angle(c, s)
    return terms.let(_replaced(terms, definition, known))


def _replaced(terms: Terms, expression: sp.Expr, known: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    if expression.func in (sp.cos, sp.sin):
        angle = sp.expand(_replaced(terms, expression.args[0], known))
        c, s = terms.cos_sin(angle)
        return c if expression.func is sp.cos else s
    if not expression.args:
        return known.get(expression, expression)
    if known.keys().isdisjoint(expression.free_symbols):
        return expression
    args = [_replaced(terms, argument, known) for argument in expression.args]
    if isinstance(expression, sp.atan2 | sp.Min | sp.Max | sp.Piecewise):
        return expression.func(*args, evaluate=False)
    return expression.func(*args)
