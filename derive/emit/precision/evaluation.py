"""Evaluates the expression graphs of functions in single or double precision for many inputs."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...program.operations import Constant, Input, Operand, Operation, Program, Store

Array = NDArray[Any]


def evaluate(program: Program, inputs: Sequence[Array], kind: type[np.floating]) -> list[Array]:
    """Return the results of an expression graph for m sets of inputs.

    The arrays of inputs and results have the shape (m, entries).

    Every operation rounds its result to the chosen number type. Functions such as the sine are
    computed in double precision and then rounded.
    """
    m = len(inputs[0])
    known: dict[Operand, Array] = {}

    def value(operand: Operand) -> Array:
        if isinstance(operand, Constant):
            return np.asarray(operand.value, dtype=kind)
        if isinstance(operand, Input):
            return inputs[operand.argument][:, operand.entry].astype(kind)
        return known[operand]

    sizes = [
        1 + max((s.entry for s in program.stored if s.output == k), default=-1)
        for k in range(len(program.results))
    ]
    results = [np.empty((m, size), dtype=kind) for size in sizes]
    with np.errstate(all="ignore"):
        for statement in program.statements:
            if isinstance(statement, Store):
                results[statement.output][:, statement.entry] = value(statement.value)
            else:
                operands = map(value, statement.operands)
                known[statement.result] = _RULES[statement.operation](*operands)
    return results


def _rounded(function: Callable[..., Array]) -> Callable[..., Array]:
    def rounded(*operands: Array) -> Array:
        found = function(*(operand.astype(np.float64) for operand in operands))
        return found.astype(operands[0].dtype)

    return rounded


def _selected(condition: Array, x: Array, y: Array) -> Array:
    return np.asarray(np.where(condition, x, y))


_RULES: Mapping[Operation, Callable[..., Array]] = {
    Operation.ADD: np.add,
    Operation.SUBTRACT: np.subtract,
    Operation.MULTIPLY: np.multiply,
    Operation.SQUARE: np.square,
    Operation.DIVIDE: np.divide,
    Operation.NEGATE: np.negative,
    Operation.SQRT: np.sqrt,
    Operation.SIN: _rounded(np.sin),
    Operation.COS: _rounded(np.cos),
    Operation.TAN: _rounded(np.tan),
    Operation.ATAN: _rounded(np.arctan),
    Operation.ATAN2: _rounded(np.arctan2),
    Operation.ABS: np.abs,
    Operation.SIGN: np.sign,
    Operation.MIN: np.fmin,
    Operation.MAX: np.fmax,
    Operation.LESS: np.less,
    Operation.LESS_EQUAL: np.less_equal,
    Operation.EQUAL: np.equal,
    Operation.NOT_EQUAL: np.not_equal,
    Operation.NOT: np.logical_not,
    Operation.AND: np.logical_and,
    Operation.OR: np.logical_or,
    Operation.SELECT: _selected,
}
