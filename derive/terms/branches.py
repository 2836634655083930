"""All branches of a function of signs as one function without signs."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import replace

import sympy as sp

from .symbolic_function import Argument, SymbolicFunction
from .terms import Terms


def patterns(function: SymbolicFunction) -> Iterator[tuple[int, ...]]:
    """The signs of each branch, in the order of the branches."""
    return itertools.product((1, -1), repeat=len(function.signs))


def branch(function: SymbolicFunction) -> SymbolicFunction:
    """One branch as a function of its own, with the signs as the last input, ``choice``."""
    meaning = "1 or -1 for each choice"
    signs = Argument("choice", function.signs, (len(function.signs),), "1", meaning)
    return replace(
        function,
        name=f"{function.name}_branch",
        inputs=(*function.inputs, signs),
        outputs=tuple(replace(result, shape=result.shape[1:]) for result in function.outputs),
        signs=(),
    )


def unrolled(function: SymbolicFunction) -> SymbolicFunction:
    """The same function without signs, its branches one after the other.

    Terms that branches share, up to sign, are named once. Entry i of branch b of an output is entry
    i of the function's output at the signs of branch b.

    Args:
        function: A function with signs; a function without signs is returned as it is.

    Returns:
        A function over its own terms, whose results hold the entries of all branches.
    """
    if not function.signs:
        return function
    terms = Terms(function.terms.parameters)
    common: dict[sp.Basic, sp.Expr] = {}
    for symbol, constant in function.terms.constants.items():
        common[symbol] = terms.let(constant.xreplace(common))
    definitions = function.definitions()
    varying: set[sp.Basic] = set(function.signs)
    for symbol, term in definitions:
        if varying.isdisjoint(term.free_symbols):
            common[symbol] = terms.let(substituted(term, common))
        else:
            varying.add(symbol)
    entries: list[list[sp.Expr]] = [[] for _ in function.outputs]
    for signs in patterns(function):
        here = common | dict(zip(function.signs, map(sp.Integer, signs), strict=True))
        for symbol, term in definitions:
            if symbol in varying:
                here[symbol] = terms.let(substituted(term, here))
        for found, result in zip(entries, function.outputs, strict=True):
            found += [substituted(entry, here) for entry in result.entries]
    outputs = tuple(
        replace(result, entries=tuple(found))
        for result, found in zip(function.outputs, entries, strict=True)
    )
    return replace(function, outputs=outputs, terms=terms, signs=())


def substituted(expression: sp.Expr, values: Mapping[sp.Basic, sp.Expr]) -> sp.Expr:
    """An expression with symbols replaced, each atan2 kept but for its sign.

    SymPy would replace atan2(y, x) by atan(y / x) where it knows that x is positive.
    """
    if not expression.has(sp.atan2):
        return expression.xreplace(values)
    arguments = [substituted(argument, values) for argument in expression.args]
    if expression.func is not sp.atan2:
        return expression.func(*arguments)
    y, x = arguments
    if y.as_coeff_Mul()[0].is_negative:
        return -sp.atan2(-y, x, evaluate=False)
    return sp.atan2(y, x, evaluate=False)
