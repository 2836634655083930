"""Replaces expensive vector operations by cheaper ones (strength reduction).

Square roots, divisions and arc tangents dominate the cost of an inverse kinematics function. The
results are the original results up to rounding errors.
"""

import itertools
from dataclasses import replace
from typing import TypeGuard

from .operations import (
    Compute,
    Constant,
    Input,
    Operand,
    Operation,
    Program,
    Statement,
    Variable,
    variables,
)
from .schedule import by_depth, needed_only


def reduced(program: Program, sign: Input | None = None) -> Program:
    """Replace expensive operations of a program.

    A square root that is used only as a divisor becomes a reciprocal square root. For two points
    that differ only in the sign of x or y, only one arc tangent is computed.

    Each angle is computed from a point before the point is normalized, so the arc tangent does not
    wait for the square root. The identities are atan2(-y, x) = -atan2(y, x), and atan2(y, -x) = pi
    - atan2(y, x) for y > 0.

    Args:
        program: The program.
        sign: An input whose value is 1 or -1. Where possible, arc tangents are computed before the
            sign is applied.
    """
    program = _angles_before_lengths(_angles_of_opposites(_reciprocal_roots(program)))
    return by_depth(needed_only(_angles_before_sign(program, sign) if sign else program))


def _reciprocal_roots(program: Program) -> Program:
    roots = {
        s.result: s.operands[0]
        for s in program.computed
        if s.operation is Operation.SQRT and not isinstance(s.operands[0], Constant)
    }
    for statement in program.statements:
        divides = isinstance(statement, Compute) and statement.operation is Operation.DIVIDE
        for taken in variables(statement.operands[:1] if divides else statement.operands):
            roots.pop(taken, None)

    def cheap(statement: Statement) -> Statement:
        if not isinstance(statement, Compute):
            return statement
        if statement.result in roots:
            return replace(statement, operation=Operation.RECIPROCAL_SQRT)
        if statement.operation is Operation.DIVIDE and statement.operands[1] in roots:
            return replace(statement, operation=Operation.MULTIPLY)
        return statement

    return replace(program, statements=tuple(map(cheap, program.statements)))


def _angles_of_opposites(program: Program) -> Program:
    negatives = _negatives(program)

    def signed(operand: Operand) -> tuple[Operand, bool]:
        negative = False
        while operand in negatives:
            operand, negative = negatives[operand], not negative
        return operand, negative

    known: dict[tuple[Operand, Operand], tuple[Variable, bool, bool]] = {}

    def cheap(statement: Statement) -> Statement:
        if not _is_angle(statement):
            return statement
        (y, down), (x, left) = map(signed, statement.operands)
        angle, known_down, known_left = known.setdefault((y, x), (statement.result, down, left))
        if angle == statement.result:
            return statement
        if left != known_left:
            operands = (angle, statement.operands[0])
            return replace(statement, operation=Operation.SUPPLEMENT, operands=operands)
        assert down != known_down
        return replace(statement, operation=Operation.NEGATE, operands=(angle,))

    return replace(program, statements=tuple(map(cheap, program.statements)))


def _angles_before_lengths(program: Program) -> Program:
    lengths = [s.result for s in program.computed if s.operation is Operation.RECIPROCAL_SQRT]
    rewriting = _Rewriting(program)
    for statement in program.statements:
        if _is_angle(statement):
            y, x = statement.operands
            for length in lengths:
                bare_y, bare_x = rewriting.without(y, length), rewriting.without(x, length)
                if bare_y and bare_x:
                    y, x = bare_y, bare_x
                    break
            statement = replace(statement, operands=(y, x))  # noqa: PLW2901
        rewriting.statements.append(statement)
    return rewriting.program()


def _angles_before_sign(program: Program, sign: Input) -> Program:
    rewriting = _Rewriting(program)
    for statement in program.statements:
        if _is_angle(statement):
            operation, operands = _before_sign(rewriting, statement, sign)
            statement = Compute(statement.result, operation, operands)  # noqa: PLW2901
        rewriting.statements.append(statement)
    return rewriting.program()


def _before_sign(
    rewriting: "_Rewriting", angle: Compute, sign: Input
) -> tuple[Operation, tuple[Operand, ...]]:
    y, x = angle.operands
    bare_y, bare_x = rewriting.without(y, sign), rewriting.without(x, sign)
    point = (bare_y or y, bare_x or x)
    if bare_x:
        one = rewriting.named(Operation.ATAN2, point)
        other = rewriting.named(Operation.SUPPLEMENT, (one, y))
        positive = rewriting.named(Operation.LESS, (Constant(0.0), sign))
        return Operation.SELECT, (positive, one, other)
    if bare_y:
        return Operation.MULTIPLY, (sign, rewriting.named(Operation.ATAN2, point))
    return Operation.ATAN2, point


class _Rewriting:
    """Rewrites a program statement by statement."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._computed = {statement.result: statement for statement in program.computed}
        self._numbers = itertools.count(len(program.statements) + 1)
        self.statements: list[Statement] = []

    def program(self) -> Program:
        return replace(self._program, statements=tuple(self.statements))

    def named(self, operation: Operation, operands: tuple[Operand, ...]) -> Variable:
        result = Variable(next(self._numbers))
        self.statements.append(Compute(result, operation, operands))
        return result

    def without(self, product: Operand, factor: Operand) -> Operand | None:
        statement = self._computed.get(product) if isinstance(product, Variable) else None
        if statement is None:
            return None
        if statement.operation is Operation.NEGATE:
            rest = self.without(statement.operands[0], factor)
            if isinstance(rest, Constant):
                return Constant(-rest.value)
            return rest and self.named(Operation.NEGATE, (rest,))
        if statement.operation is not Operation.MULTIPLY:
            return None
        for one, other in itertools.permutations(statement.operands):
            if other == factor:
                return one
            if rest := self.without(one, factor):
                return self.named(Operation.MULTIPLY, (rest, other))
        return None


def _negatives(program: Program) -> dict[Operand, Operand]:
    return {
        s.result: s.operands[0]
        for s in program.computed
        if s.operation is Operation.NEGATE and not isinstance(s.operands[0], Constant)
    }


def _is_angle(statement: Statement) -> TypeGuard[Compute]:
    return isinstance(statement, Compute) and statement.operation is Operation.ATAN2
