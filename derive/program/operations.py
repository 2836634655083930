"""The typed program of a function: what is read, computed and stored, one operation a statement.

A :class:`Program` is in single assignment: each :class:`Variable` is computed once, before it is
used. No statement holds text of any language; printers give it one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto


class Operation(Enum):
    """What a statement computes of its operands; conditions are 1 or 0, or what masks are."""

    ADD = auto()
    SUBTRACT = auto()
    MULTIPLY = auto()
    SQUARE = auto()
    DIVIDE = auto()
    NEGATE = auto()
    SQRT = auto()
    SIN = auto()
    COS = auto()
    TAN = auto()
    ATAN = auto()
    ATAN2 = auto()
    ABS = auto()
    SIGN = auto()
    """-1, 1, or the operand itself where it is 0 or NaN."""
    MIN = auto()
    MAX = auto()
    LESS = auto()
    LESS_EQUAL = auto()
    EQUAL = auto()
    NOT_EQUAL = auto()
    NOT = auto()
    AND = auto()
    OR = auto()
    SELECT = auto()
    """``SELECT(condition, x, y)`` is x where the condition holds, else y; the other is not seen."""
    RECIPROCAL_SQRT = auto()
    """1 / sqrt(x); it comes from strength reduction alone."""
    SUPPLEMENT = auto()
    """``SUPPLEMENT(a, y)``: the angle whose size and that of a are together pi, with the sign of y;
    it comes from strength reduction alone."""


COMPARISONS = frozenset(
    {Operation.LESS, Operation.LESS_EQUAL, Operation.EQUAL, Operation.NOT_EQUAL}
)
LOGIC = frozenset({Operation.NOT, Operation.AND, Operation.OR})
CONDITIONS = COMPARISONS | LOGIC
"""Operations whose result is true or false."""
CALLS = frozenset({Operation.SIN, Operation.COS, Operation.TAN, Operation.ATAN, Operation.ATAN2})
"""Operations that are calls of a library on any machine."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A number; -0.0 and 0.0 are two."""

    value: float

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Constant) and repr(self.value) == repr(other.value)

    def __hash__(self) -> int:
        return hash(repr(self.value))


@dataclass(frozen=True, slots=True)
class Input:
    """Entry ``entry`` of argument ``argument`` of the function, in row-major order."""

    argument: int
    entry: int


@dataclass(frozen=True, slots=True)
class Variable:
    """The result of a statement, by its number in the program."""

    number: int


Operand = Constant | Input | Variable


@dataclass(frozen=True, slots=True)
class Compute:
    """``result = operation(operands)``."""

    result: Variable
    operation: Operation
    operands: tuple[Operand, ...]

    @property
    def is_condition(self) -> bool:
        """Whether the result is true or false."""
        return self.operation in CONDITIONS


@dataclass(frozen=True, slots=True)
class Store:
    """``output[entry] = value``."""

    output: int
    entry: int
    value: Operand

    @property
    def operands(self) -> tuple[Operand, ...]:
        """The value alone, as of a statement that computes."""
        return (self.value,)


Statement = Compute | Store


@dataclass(frozen=True)
class Program:
    """One function as statements.

    Attributes:
        name: The function's name with the robot's prefix.
        arguments: Names of the arguments, by the number that an :class:`Input` has.
        results: Names of the outputs, by the number that a :class:`Store` has.
        inputs: Everything that is read, in order.
        statements: What is computed and stored, in order.
    """

    name: str
    arguments: tuple[str, ...]
    results: tuple[str, ...]
    inputs: tuple[Input, ...]
    statements: tuple[Statement, ...]

    @property
    def computed(self) -> list[Compute]:
        """The statements that compute."""
        return [statement for statement in self.statements if isinstance(statement, Compute)]

    @property
    def stored(self) -> list[Store]:
        """The statements that store."""
        return [statement for statement in self.statements if isinstance(statement, Store)]

    def has(self, operation: Operation) -> bool:
        """Whether an operation occurs."""
        return any(statement.operation is operation for statement in self.computed)


def variables(operands: Sequence[Operand]) -> Iterator[Variable]:
    """The variables among operands."""
    return (operand for operand in operands if isinstance(operand, Variable))
