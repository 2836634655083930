"""Converts the constants of expression graphs to single precision."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...model.tolerances import ARTICLE_ZERO, FLOOR_EXPONENT, LARGEST_SINGLE, MAX_THRESHOLD
from ...program.operations import (
    Compute,
    Constant,
    Operand,
    Operation,
    Program,
    Statement,
    Store,
)

ROUNDING_RATIO = float(np.finfo(np.float32).eps / np.finfo(np.float64).eps)
"""Ratio of the rounding errors in single and double precision: 2^29."""
FRAME = 128
"""Stack size of the saved registers and addresses (byte), for 32-bit and 64-bit processors."""


def single(program: Program) -> Program:
    """Return the single-precision version of an expression graph.

    A rounding threshold is a tiny constant that occurs only in conditions. Rounding thresholds are
    multiplied by the ratio of the rounding errors of the two precisions. A tiny lower bound that
    prevents a division by zero is replaced by a number that single precision can represent.
    """
    stored = _reaching_results(program)

    def converted(statement: Statement) -> Statement:
        if isinstance(statement, Store):
            return replace(statement, value=_replaced(statement.value, _floored))
        only_compared = statement.is_condition or statement.result not in stored
        rule = _threshold if only_compared else _floored
        operands = tuple(_replaced(operand, rule) for operand in statement.operands)
        return replace(statement, operands=operands)

    return replace(program, statements=tuple(map(converted, program.statements)))


def _reaching_results(program: Program) -> set[Operand]:
    """Return the operands that affect the value of a result.

    Operands that affect only a condition are excluded.
    """
    found: set[Operand] = set()
    for statement in reversed(program.statements):
        if isinstance(statement, Store):
            found.add(statement.value)
        elif not statement.is_condition and statement.result in found:
            is_choice = statement.operation is Operation.SELECT
            found.update(statement.operands[1:] if is_choice else statement.operands)
    return found


def _replaced(operand: Operand, rule: Callable[[float], float]) -> Operand:
    return Constant(rule(operand.value)) if isinstance(operand, Constant) else operand


def _threshold(value: float) -> float:
    is_threshold = ARTICLE_ZERO < abs(value) < MAX_THRESHOLD
    return value * ROUNDING_RATIO if is_threshold else _floored(value)


def _floored(value: float) -> float:
    if 0 < abs(value) <= ARTICLE_ZERO:
        return float(np.copysign(abs(value) ** FLOOR_EXPONENT, value))
    return float(np.clip(value, -LARGEST_SINGLE, LARGEST_SINGLE))


def stack_bytes(program: Program) -> int:
    """Return an upper bound of a function's stack size (byte).

    The bound on the stack size holds only if the compiler optimizes the code.
    """
    last = {operand: k for k, s in enumerate(program.statements) for operand in s.operands}
    alive: set[Operand] = set(program.inputs)
    most = len(alive)
    for k, statement in enumerate(program.statements):
        if isinstance(statement, Compute):
            alive.add(statement.result)
            most = max(most, len(alive))
        alive -= {operand for operand in statement.operands if last[operand] == k}
    return 4 * most + FRAME
