"""The order of the statements of a program."""

from collections.abc import Sequence
from dataclasses import replace

from .operations import CALLS, Compute, Operand, Program, Statement, Store, Variable, variables


def by_depth(program: Program) -> Program:
    """Move each statement to the earliest position that its operands allow."""
    return _numbered(program, [s for level in levels(program) for s in level])


def levels(program: Program) -> list[list[Statement]]:
    """Return the statements of a program, grouped by depth.

    The depth of a statement is the length of the longest chain of statements that must precede it.
    """
    depth: dict[Variable, int] = {}
    found: dict[int, list[Statement]] = {}
    for statement in program.statements:
        own = max((depth[v] for v in variables(statement.operands)), default=0)
        found.setdefault(own, []).append(statement)
        if isinstance(statement, Compute):
            depth[statement.result] = own + 1
    return [found[own] for own in sorted(found)]


def needed_only(program: Program) -> Program:
    """Drop statements whose results are not used.

    The remaining variables are not renumbered.
    """
    needed: set[Variable] = set()
    kept: list[Statement] = []
    for statement in reversed(program.statements):
        if isinstance(statement, Store) or statement.result in needed:
            needed.update(variables(statement.operands))
            kept.append(statement)
    return replace(program, statements=tuple(kept[::-1]))


def calls_first(program: Program) -> Program:
    """Move library calls as early as possible.

    Each call stays after the statements that compute its arguments.

    A library call overwrites the vector registers. Values that are computed after the last call can
    stay in registers.
    """
    needed: set[Variable] = set()
    early: set[Variable] = set()
    for statement in reversed(program.computed):
        if statement.result in needed or statement.operation in CALLS:
            early.add(statement.result)
            needed.update(variables(statement.operands))
    first = [s for s in program.computed if s.result in early]
    rest = [s for s in program.statements if isinstance(s, Store) or s.result not in early]
    return _numbered(program, [*first, *rest])


def _numbered(program: Program, statements: Sequence[Statement]) -> Program:
    names: dict[Variable, Variable] = {}

    def renamed(operand: Operand) -> Operand:
        return names[operand] if isinstance(operand, Variable) else operand

    numbered: list[Statement] = []
    for statement in statements:
        if isinstance(statement, Store):
            numbered.append(replace(statement, value=renamed(statement.value)))
            continue
        operands = tuple(map(renamed, statement.operands))
        names[statement.result] = Variable(len(names) + 1)
        numbered.append(Compute(names[statement.result], statement.operation, operands))
    return replace(program, statements=tuple(numbered))
