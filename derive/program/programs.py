"""The programs of all functions of a derivation, for all output languages."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ..model.tolerances import GREATEST_NUMBER
from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .operations import Compute, Constant, Input, Operand, Operation, Program, Store, Variable
from .reading import programs as read_programs
from .unrolling import unrolled

COORDINATES, RESIDUAL = 0, 1
"""Output indices of the coordinates and of the residual in every inverse function."""


@dataclass(frozen=True)
class Programs:
    """The programs that compute the functions of a robot.

    Attributes:
        whole: The program of each function, keyed by the function name. A function with branches
            has a program that computes all branches in order.
        branch: For each function with branches, the program that computes a single branch. The last
            argument ``choice`` of this program contains the signs of the branch.
    """

    whole: Mapping[str, Program]
    branch: Mapping[str, Program]

    def alone(self, function: SymbolicFunction) -> Program:
        """Return the program of a single branch, or of the whole function if it has no branches."""
        return self.branch.get(function.name) or self.whole[function.name]


NO_PROGRAMS = Programs({}, {})
"""An empty collection of programs, for output languages that print equations."""


def programs(functions: Sequence[SymbolicFunction], prefix: str) -> Programs:
    """Translate functions to CasADi and read the generated programs.

    Args:
        functions: Functions whose entries share terms.
        prefix: The name of the robot, which is the prefix of the program names.

    Raises:
        LoweringError: An expression or an operation has no conversion rule.
    """
    read = [
        with_input_check(program) if f.role.finds_coordinates else program
        for f, program in zip(functions, read_programs(lower(functions, prefix)), strict=True)
    ]
    branch = {f.name: program for f, program in zip(functions, read, strict=True) if f.signs}
    whole = {
        f.name: unrolled(program, patterns(f), f"{prefix}_{f.name}") if f.signs else program
        for f, program in zip(functions, read, strict=True)
    }
    return Programs(whole, branch)


def with_input_check(program: Program) -> Program:
    """Make the residual NaN or infinite if an input that affects the coordinates is not finite.

    If a prismatic joint is parallel to a base axis, the joint coordinate cancels the target
    coordinate x in the residual. CasADi therefore removes x from the residual. Without the input
    check, a target with x = NaN would count as solved.

    Args:
        program: The program of an inverse function that computes one solution or all solutions.

    Returns:
        A program whose residual depends on all inputs that affect the coordinates.
    """
    inputs = _inputs_behind(program)
    unseen = inputs[COORDINATES] - inputs[RESIDUAL]
    if not unseen:
        return program
    ordered = sorted(unseen, key=lambda entry: (entry.argument, entry.entry))
    used = (s.result.number for s in program.computed)
    unused = map(Variable, itertools.count(1 + max(used, default=0)))
    size, computed = _total_size(ordered, unused)
    finite = next(unused)
    computed.append(Compute(finite, Operation.LESS_EQUAL, (size, Constant(GREATEST_NUMBER))))
    kept = [s for s in program.statements if not (isinstance(s, Store) and s.output == RESIDUAL)]
    stored: list[Store] = []
    for store in program.stored:
        if store.output == RESIDUAL:
            chosen = next(unused)
            computed.append(Compute(chosen, Operation.SELECT, (finite, store.value, size)))
            stored.append(replace(store, value=chosen))
    return replace(program, statements=(*kept, *computed, *stored))


def _total_size(
    entries: Sequence[Input], unused: Iterator[Variable]
) -> tuple[Variable, list[Compute]]:
    sizes = [Compute(next(unused), Operation.ABS, (entry,)) for entry in entries]
    total, computed = sizes[0].result, [*sizes]
    for size in sizes[1:]:
        computed.append(Compute(next(unused), Operation.ADD, (total, size.result)))
        total = computed[-1].result
    return total, computed


def _inputs_behind(program: Program) -> dict[int, set[Input]]:
    behind: dict[Operand, set[Input]] = {entry: {entry} for entry in program.inputs}
    outputs: dict[int, set[Input]] = {}
    for statement in program.statements:
        found = set().union(*(behind.get(operand, set()) for operand in statement.operands))
        if isinstance(statement, Store):
            outputs.setdefault(statement.output, set()).update(found)
        else:
            behind[statement.result] = found
    return outputs
