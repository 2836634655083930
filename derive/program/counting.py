"""Operation counts of programs, by kind."""

from collections import Counter
from dataclasses import asdict, dataclass

from .operations import CALLS, Operation, Program

_KINDS = {
    Operation.MULTIPLY: "multiply",
    Operation.SQUARE: "multiply",
    Operation.ADD: "add",
    Operation.SUBTRACT: "add",
    Operation.NEGATE: "negate",
    **dict.fromkeys(CALLS, "trig"),
}


@dataclass(frozen=True)
class Operations:
    """Number of operations of each kind in the generated C code of a function."""

    multiply: int = 0
    add: int = 0
    negate: int = 0
    trig: int = 0
    other: int = 0

    @property
    def total(self) -> int:
        """The number of all operations."""
        return self.multiply + self.add + self.negate + self.trig + self.other

    def as_dict(self) -> dict[str, int]:
        """Operation counts keyed by name, with their total."""
        return {**asdict(self), "total": self.total}


def count_operations(program: Program) -> Operations:
    """Count the operations of a program by kind. Loads, stores and constants do not count."""
    kinds = (_KINDS.get(statement.operation, "other") for statement in program.computed)
    return Operations(**Counter(kinds))
