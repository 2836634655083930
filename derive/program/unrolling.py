"""Writes the program of all branches from the program of a single branch.

In the copy for each branch, the branch signs are replaced by 1 or -1. Terms that several branches
share are computed once. A value and its negative share a variable. All rules are exact in floating
point: (-a) b = -(a b), a + (-b) = a - b, atan2(-y, x) = -atan2(y, x).
"""

import itertools
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from .operations import (
    COMPARISONS,
    Compute,
    Constant,
    Input,
    Operand,
    Operation,
    Program,
    Statement,
    Store,
    Variable,
)
from .schedule import calls_first, needed_only

_EVEN = frozenset({Operation.SQUARE, Operation.COS, Operation.ABS})
_ODD = frozenset({Operation.SIN, Operation.TAN, Operation.ATAN, Operation.SIGN})
_COMMUTING = frozenset(
    {Operation.ADD, Operation.MULTIPLY, Operation.AND, Operation.OR, Operation.EQUAL}
)
_FOLDED: Mapping[Operation, Callable[..., float]] = {
    Operation.ADD: operator.add,
    Operation.SUBTRACT: operator.sub,
    Operation.MULTIPLY: operator.mul,
    Operation.SQUARE: lambda x: x * x,
    Operation.ABS: abs,
    Operation.MIN: min,
    Operation.MAX: max,
    Operation.LESS: operator.lt,
    Operation.LESS_EQUAL: operator.le,
    Operation.EQUAL: operator.eq,
    Operation.NOT_EQUAL: operator.ne,
    Operation.NOT: operator.not_,
    Operation.AND: lambda x, y: bool(x and y),
    Operation.OR: lambda x, y: bool(x or y),
}
"""Operations whose result for constants is equal in Python and C."""
_OPPOSITE = {Operation.MIN: Operation.MAX, Operation.MAX: Operation.MIN}


def unrolled(branch: Program, signs: Iterable[Sequence[int]], name: str) -> Program:
    """Return one program that computes all solution branches in order.

    Args:
        branch: The program that computes a single solution branch. Its last argument contains the
            branch signs.
        signs: The signs (1 or -1) of each branch.
        name: The name of the program.
    """
    choice = len(branch.arguments) - 1
    sizes = [
        1 + max(s.entry for s in branch.stored if s.output == k) for k in range(len(branch.results))
    ]
    writer = _Writer()
    for b, chosen in enumerate(signs):
        known: dict[Operand, _Signed] = {
            Input(choice, k): _Signed(Constant(1.0), sign < 0) for k, sign in enumerate(chosen)
        }
        for statement in branch.statements:
            operands = [known.get(o, _Signed(o, False)) for o in statement.operands]
            if isinstance(statement, Compute):
                known[statement.result] = writer.value(statement.operation, operands)
            else:
                entry = statement.entry + b * sizes[statement.output]
                value = writer.plain(operands[0])
                writer.statements.append(Store(statement.output, entry, value))
    return calls_first(
        needed_only(
            replace(
                branch,
                name=name,
                arguments=branch.arguments[:choice],
                inputs=tuple(i for i in branch.inputs if i.argument != choice),
                statements=tuple(writer.statements),
            )
        )
    )


@dataclass(frozen=True)
class _Signed:
    operand: Operand
    negative: bool

    def times(self, negative: bool) -> "_Signed":
        return replace(self, negative=self.negative != negative)


def _number(value: _Signed) -> float | None:
    if not isinstance(value.operand, Constant):
        return None
    return -value.operand.value if value.negative else value.operand.value


_ONE = Constant(1.0)
_MINUS_ONE = Constant(-1.0)


class _Writer:
    """Writes statements.

    If an earlier statement has the same value or its negative, that statement is reused.
    """

    def __init__(self) -> None:
        self.statements: list[Statement] = []
        self._known: dict[tuple[Operation, tuple[Operand, ...]], Variable] = {}
        self._computed: dict[Operand, Compute] = {}
        self._opposites: dict[Operand, Operand] = {}
        self._count = 0
        self._rules: dict[Operation, Callable[..., _Signed]] = {
            Operation.NEGATE: self._opposite,
            Operation.ADD: self._sum,
            Operation.SUBTRACT: lambda a, b: self._sum(a, b.times(True)),
            Operation.MULTIPLY: self._product,
            Operation.DIVIDE: self._quotient,
            Operation.ATAN2: self._angle,
            Operation.SELECT: self._choice,
            **{operation: partial(self._even, operation) for operation in _EVEN},
            **{operation: partial(self._odd, operation) for operation in _ODD},
            **{operation: partial(self._extreme, operation) for operation in _OPPOSITE},
            **{operation: partial(self._comparison, operation) for operation in COMPARISONS},
        }

    def value(self, operation: Operation, operands: Sequence[_Signed]) -> _Signed:
        operands = [self._kept(operand) for operand in operands]
        numbers = [number for number in map(_number, operands) if number is not None]
        if operation in _FOLDED and len(numbers) == len(operands):
            return _Signed(Constant(float(_FOLDED[operation](*numbers))), False)
        return self._rules.get(operation, partial(self._unsigned, operation))(*operands)

    def plain(self, value: _Signed) -> Operand:
        if not value.negative:
            return value.operand
        if isinstance(value.operand, Constant):
            return Constant(-value.operand.value)
        return self._named(Operation.NEGATE, value.operand)

    def _unsigned(self, operation: Operation, *operands: _Signed) -> _Signed:
        return _Signed(self._named(operation, *map(self.plain, operands)), False)

    def _even(self, operation: Operation, value: _Signed) -> _Signed:
        return _Signed(self._named(operation, value.operand), False)

    def _odd(self, operation: Operation, value: _Signed) -> _Signed:
        return _Signed(self._named(operation, value.operand), value.negative)

    def _quotient(self, a: _Signed, b: _Signed) -> _Signed:
        quotient = self._named(Operation.DIVIDE, a.operand, b.operand)
        return _Signed(quotient, a.negative != b.negative)

    def _angle(self, y: _Signed, x: _Signed) -> _Signed:
        return _Signed(self._named(Operation.ATAN2, y.operand, self.plain(x)), y.negative)

    def _extreme(self, operation: Operation, a: _Signed, b: _Signed) -> _Signed:
        if a.negative and b.negative:
            return _Signed(self._named(_OPPOSITE[operation], a.operand, b.operand), True)
        return self._unsigned(operation, a, b)

    def _comparison(self, operation: Operation, a: _Signed, b: _Signed) -> _Signed:
        if a.negative or b.negative:
            a, b = b.times(True), a.times(True)
        return self._unsigned(operation, a, b)

    def _sum(self, a: _Signed, b: _Signed) -> _Signed:
        if a.negative == b.negative:
            return _Signed(self._named(Operation.ADD, a.operand, b.operand), a.negative)
        plus, minus = (b, a) if a.negative else (a, b)
        opposite = self._known.get((Operation.SUBTRACT, (minus.operand, plus.operand)))
        if opposite is not None:
            return _Signed(opposite, True)
        return _Signed(self._named(Operation.SUBTRACT, plus.operand, minus.operand), False)

    def _product(self, a: _Signed, b: _Signed) -> _Signed:
        negative = a.negative != b.negative
        for one, other in ((a, b), (b, a)):
            if one.operand in (_ONE, _MINUS_ONE):
                return _Signed(other.operand, negative != (one.operand == _MINUS_ONE))
        return _Signed(self._named(Operation.MULTIPLY, a.operand, b.operand), negative)

    def _choice(self, condition: _Signed, this: _Signed, other: _Signed) -> _Signed:
        if this == other:
            return this
        where = self.plain(condition)
        if isinstance(where, Constant):
            return this if where.value else other
        if this.negative and other.negative:
            chosen = self._named(Operation.SELECT, where, this.operand, other.operand)
            return _Signed(chosen, True)
        return _Signed(
            self._named(Operation.SELECT, where, self.plain(this), self.plain(other)), False
        )

    def _opposite(self, value: _Signed) -> _Signed:
        opposite = None if value.negative else self._turned(value.operand)
        if opposite is None or opposite in self._opposites:
            return value.times(True)
        self._opposites[value.operand] = opposite
        return _Signed(opposite, False)

    def _turned(self, operand: Operand) -> Operand | None:
        statement = self._computed.get(operand)
        if statement is None:
            return None
        if statement.operation is Operation.SUBTRACT:
            return self._named(Operation.SUBTRACT, *statement.operands[::-1])
        if statement.operation is Operation.ADD:
            for one, other in itertools.permutations(statement.operands):
                inner = self._computed.get(one)
                if inner is not None and inner.operation is Operation.SUBTRACT:
                    opposite = self._opposite(_Signed(one, False))
                    if opposite.negative:
                        return None
                    return self._named(Operation.SUBTRACT, opposite.operand, other)
        return None

    def _kept(self, value: _Signed) -> _Signed:
        opposite = self._opposites.get(value.operand)
        return value if opposite is None else _Signed(opposite, not value.negative)

    def _named(self, operation: Operation, *operands: Operand) -> Variable:
        key = (operation, operands)
        if key not in self._known and operation in _COMMUTING:
            key = (operation, operands[::-1])
        if key not in self._known:
            self._count += 1
            key = (operation, operands)
            result = self._known[key] = Variable(self._count)
            self._computed[result] = Compute(result, operation, operands)
            self.statements.append(self._computed[result])
        return self._known[key]
