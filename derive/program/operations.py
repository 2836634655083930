"""Typed intermediate representation of a function.

A ``Program`` is in single assignment form: each ``Variable`` is computed once, before its
use. The statements of a program do not depend on the output language. A printer converts the
statements to text.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto


class Operation(Enum):
    """An operation. A condition is 1 or 0 in scalar code and a mask in vector code."""

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
    """The sign -1 or 1 of the operand. The operands 0 and NaN are returned unchanged."""
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
    """``SELECT(condition, x, y)`` is x if the condition holds, otherwise y.

    The value that is not selected has no effect, even if this value is NaN.
    """
    RECIPROCAL_SQRT = auto()
    """The operation 1 / sqrt(x), which only the strength reduction inserts."""
    SUPPLEMENT = auto()
    """``SUPPLEMENT(a, y)`` is pi - |a| with the sign of y."""


COMPARISONS = frozenset(
    {Operation.LESS, Operation.LESS_EQUAL, Operation.EQUAL, Operation.NOT_EQUAL}
)
LOGIC = frozenset({Operation.NOT, Operation.AND, Operation.OR})
CONDITIONS = COMPARISONS | LOGIC
"""Operations whose result is Boolean."""
CALLS = frozenset({Operation.SIN, Operation.COS, Operation.TAN, Operation.ATAN, Operation.ATAN2})
"""Operations that every target machine computes by a call of the mathematical library."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A constant."""

    value: float

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Constant) and repr(self.value) == repr(other.value)

    def __hash__(self) -> int:
        return hash(repr(self.value))


@dataclass(frozen=True, slots=True)
class Input:
    """Entry ``entry`` of the function argument ``argument``, in row-major order."""

    argument: int
    entry: int


@dataclass(frozen=True, slots=True)
class Variable:
    """The result of a statement. A variable is identified by its number in the program."""

    number: int

    def __hash__(self) -> int:
        return self.number


Operand = Constant | Input | Variable


@dataclass(frozen=True, slots=True)
class Compute:
    """A statement ``result = operation(operands)``."""

    result: Variable
    operation: Operation
    operands: tuple[Operand, ...]

    def __hash__(self) -> int:
        # No two statements of a program have the same result variable.
        return self.result.number

    @property
    def is_condition(self) -> bool:
        """Whether the result is Boolean."""
        return self.operation in CONDITIONS


@dataclass(frozen=True, slots=True)
class Store:
    """A statement ``output[entry] = value``."""

    output: int
    entry: int
    value: Operand

    @property
    def operands(self) -> tuple[Operand, ...]:
        """The stored value as a tuple with one element.

        ``Compute.operands`` has the same type.
        """
        return (self.value,)


Statement = Compute | Store


@dataclass(frozen=True)
class Program:
    """One function as a list of statements.

    Attributes:
        name: The name of the function with the prefix of the robot.
        arguments: Names of the arguments. An ``Input`` contains an index into ``arguments``.
        results: Names of the outputs. A ``Store`` contains an index into ``results``.
        inputs: All argument entries that the program reads, in order.
        statements: All statements, in the order of execution.
    """

    name: str
    arguments: tuple[str, ...]
    results: tuple[str, ...]
    inputs: tuple[Input, ...]
    statements: tuple[Statement, ...]

    @property
    def computed(self) -> list[Compute]:
        """The statements that compute a value."""
        return [statement for statement in self.statements if isinstance(statement, Compute)]

    @property
    def stored(self) -> list[Store]:
        """The statements that store a value."""
        return [statement for statement in self.statements if isinstance(statement, Store)]

    def has(self, operation: Operation) -> bool:
        """Whether the program contains the given operation."""
        return any(statement.operation is operation for statement in self.computed)


def variables(operands: Sequence[Operand]) -> Iterator[Variable]:
    """Return the variables of a list of operands."""
    return (operand for operand in operands if isinstance(operand, Variable))
