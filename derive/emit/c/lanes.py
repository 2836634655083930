"""Prints operations as C for SIMD lanes, with the types and macros of ``chasles_lanes.h``."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ...program.operations import (
    COMPARISONS,
    Compute,
    Constant,
    Operand,
    Operation,
    Program,
    Store,
    Variable,
    variables,
)
from ...terms.symbolic_function import Signature
from .expressions import FUNCTIONS, WIDTH, expression, naming

SUPPORT = "chasles_lanes.h"
_COMPARISONS = {
    Operation.LESS: "LT",
    Operation.LESS_EQUAL: "LE",
    Operation.EQUAL: "EQ",
    Operation.NOT_EQUAL: "NE",
}
_CONNECTIONS = {Operation.AND: "AND", Operation.OR: "OR"}
_EXTREMES = {Operation.MIN: "MIN", Operation.MAX: "MAX"}
_CALLED = {
    **FUNCTIONS,
    Operation.SIGN: "sign",
    Operation.RECIPROCAL_SQRT: "rsqrt",
    Operation.SUPPLEMENT: "supplement",
}
_PAIR = 2
_CONSTANT = "const lanes "


@dataclass(frozen=True)
class Sizes:
    """Number of doubles in each input and each output of a function."""

    inputs: tuple[int, ...]
    outputs: tuple[int, ...]


def sizes(function: Signature) -> Sizes:
    """Return the number of doubles in each input and each output of a function."""
    inputs = tuple(argument.size for argument in function.inputs)
    return Sizes(inputs, tuple(result.size for result in function.outputs))


def offsets(lengths: Sequence[int]) -> list[int]:
    """Return the start index of each array in a concatenation of arrays."""
    return [sum(lengths[:k]) for k in range(len(lengths))]


def kernel(
    program: Program, loads: Sequence[str], size: Sizes, alike: Sequence[Variable] = ()
) -> list[str]:
    """Return the body lines of a C function that stores its outputs in the array ``out``.

    Args:
        program: Sequence of operations that the C function computes.
        loads: C lines that load the inputs of the function into named variables.
        size: Number of doubles in each input and each output of the function.
        alike: Arc tangents whose values in the SIMD lanes 2 k and 2 k + 1 are equal. One C call
            computes two arc tangents of ``alike``: the first in even SIMD lanes, the second in odd
            lanes.
    """
    first = offsets(size.outputs)
    writer = _Writer(program)
    given = {**writer.cosines_and_sines(), **writer.angles_at_once(alike)}
    lines = list(loads)
    for statement in program.statements:
        match statement:
            case Compute(result) if result in given:
                lines += given[result]
            case Compute():
                lines += writer.computed(statement)
            case Store(i, entry, value):
                lines.append(f"  out[{first[i] + entry}] = {writer.vector(value)};")
    return _filled(lines)


def _filled(lines: Iterable[str]) -> list[str]:
    filled: list[str] = []
    declaring = False
    for line in map(str.strip, lines):
        constant = line.startswith(_CONSTANT)
        piece, goes_on = line, constant and declaring
        if goes_on:
            filled[-1] = f"{filled[-1][:-1]},"
            piece = line.removeprefix(_CONSTANT)
        may_join = goes_on or not (constant or declaring)
        if filled and may_join and len(filled[-1]) + len(piece) < WIDTH:
            filled[-1] += f" {piece}"
        else:
            filled.append(f"{'      ' if goes_on else '  '}{piece}")
        declaring = constant
    return filled


class _Writer:
    """Prints statements.

    A condition is printed as a mask with one entry for each SIMD lane.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._name = naming(program)
        self._conditions = {s.result for s in program.computed if s.is_condition}
        self._numbers = _taken_as_numbers(program)

    def computed(self, statement: Compute) -> list[str]:
        name, operation = self._name(statement.result), statement.operation
        if statement.is_condition:
            lines = [f"  const lanes_where {name} = {self._condition(statement)};"]
            if statement.result in self._numbers:
                lines.append(f"  const lanes {name}_number = LANES_NUMBER({name});")
            return lines
        if operation in _CALLED:
            return self._called(name, statement)
        if operation is Operation.SELECT:
            condition, *values = statement.operands
            terms = ", ".join((self._where(condition), *map(self.number, values)))
            return [f"  const lanes {name} = LANES_CHOICE({terms});"]
        return [f"  const lanes {name} = {expression(statement, self.number)};"]

    def number(self, operand: Operand) -> str:
        """Return the C expression of an operand, with 1 for a true and 0 for a false condition."""
        name = self._name(operand)
        return f"{name}_number" if operand in self._conditions else name

    def vector(self, operand: Operand) -> str:
        """Return the C expression of an operand as a SIMD vector."""
        number = self.number(operand)
        return f"LANES_OF({number})" if isinstance(operand, Constant) else number

    def cosines_and_sines(self) -> dict[Variable, list[str]]:
        found: dict[Operand, dict[Operation, Variable]] = {}
        for statement in self._program.computed:
            if statement.operation in (Operation.COS, Operation.SIN):
                results = found.setdefault(statement.operands[0], {})
                results[statement.operation] = statement.result
        calls: dict[Variable, list[str]] = {}
        for angle, results in found.items():
            if len(results) == _PAIR:
                first, second = results.values()
                both = (results[Operation.COS], results[Operation.SIN], angle)
                calls[first] = [f"  LANES_COS_SIN({', '.join(map(self._name, both))});"]
                calls[second] = []
        return calls

    def angles_at_once(self, alike: Sequence[Variable]) -> dict[Variable, list[str]]:
        points = {s.result: s.operands for s in self._program.computed}
        calls: dict[Variable, list[str]] = {}
        for first, second in zip(alike[::2], alike[1::2], strict=False):
            named = [self._name(o) for o in (*points[first], *points[second], first, second)]
            addresses = ", ".join(f"&{name}" for name in named)
            declared = ", ".join(named[-_PAIR:])
            calls[first] = []
            calls[second] = [f"  lanes {declared}; LANES_NAME(lanes_two_atan2)({addresses});"]
        return calls

    def _where(self, operand: Operand) -> str:
        name = self._name(operand)
        return name if operand in self._conditions else f"LANES_NE({name}, 0.0)"

    def _condition(self, statement: Compute) -> str:
        operation = statement.operation
        if operation is Operation.NOT:
            return f"LANES_NOT({self._where(statement.operands[0])})"
        if operation in _CONNECTIONS:
            sides = ", ".join(map(self._where, statement.operands))
            return f"LANES_{_CONNECTIONS[operation]}({sides})"
        sides = ", ".join(map(self.number, statement.operands))
        return f"LANES_{_COMPARISONS[operation]}({sides})"

    def _called(self, name: str, statement: Compute) -> list[str]:
        operation, operands = statement.operation, statement.operands
        if operation in _EXTREMES and any(isinstance(o, Constant) for o in operands):
            # The minimum or maximum instruction returns its second argument if the first argument
            # is NaN. A constant is passed as the second argument of the instruction, so that the
            # instruction returns the constant if the other operand is NaN.
            first, second = sorted(operands, key=lambda o: isinstance(o, Constant))
            value = f"LANES_{_EXTREMES[operation]}({self.number(first)}, {self._name(second)})"
            return [f"  const lanes {name} = {value};"]
        lines: list[str] = []
        names: list[str] = []
        for k, operand in enumerate(operands):
            if isinstance(operand, Constant):
                lines.append(f"  const lanes {name}_{k} = {self.vector(operand)};")
                names.append(f"{name}_{k}")
            else:
                names.append(self.number(operand))
        terms = ", ".join((name, _CALLED[operation], *names))
        return [*lines, f"  LANES_LET{len(names)}({terms});"]


def _taken_as_numbers(program: Program) -> set[Operand]:
    found: set[Operand] = set()
    for statement in program.statements:
        if isinstance(statement, Compute) and statement.operation is Operation.SELECT:
            found.update(variables(statement.operands[1:]))
        elif isinstance(statement, Store) or not (
            statement.is_condition and statement.operation not in COMPARISONS
        ):
            found.update(variables(statement.operands))
    return found
