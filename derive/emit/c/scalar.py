"""Generates C for functions that compute a single pose."""

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ...model.mechanism import Described
from ...program.counting import count_operations
from ...program.operations import Compute, Operand, Operation, Program, Statement, Store
from ...program.programs import Programs
from ...program.schedule import by_depth, levels
from ...terms.branches import branch
from ...terms.symbolic_function import (
    Argument,
    Call,
    NativeSolverFunction,
    Result,
    SymbolicFunction,
    systems_of,
)
from .closed_loops import loops_file
from .expressions import WIDTH, Naming, expression, naming
from .header import notice, own_copy, signature
from .sections import iteration_count, summary, title
from .written import written_file

SUPPORT = "chasles_cos_sin.h"
_TURNS = {Operation.COS: "c", Operation.SIN: "s"}


def source(
    robot: Described,
    functions: Sequence[SymbolicFunction],
    programs: Programs,
    written: Sequence[NativeSolverFunction] = (),
    further: Sequence[str] = (),
) -> str:
    """Return a C99 file that contains all functions of a robot and needs only libm.

    Args:
        robot: The robot, whose name is the prefix of all C names.
        functions: Functions that the C file defines, with documented arguments and results.
        programs: Sequences of operations that compute the functions.
        written: Functions whose C code is in separate files.
        further: Names of further C files that the file includes at its end.
    """
    included = f'#include "{robot.name}.h"\n\n#include "{SUPPORT}"'
    if any(function.signs for function in functions):
        included += f'\n#include "{branches_file(robot)}"'
    systems = systems_of(functions)
    included += "".join(f'\n#include "{loops_file(robot, system)}"' for system in systems)
    parts = [notice(robot), f"{included}\n"]
    parts += [_definition(robot, function, programs.alone(function)) for function in functions]
    own = dict.fromkeys(written_file(robot, function) for function in written)
    parts += [f'#include "{file}"\n' for file in (*own, *further)]
    return "\n".join(parts)


def branches_file(robot: Described) -> str:
    """Return the name of the C header that computes solution branches in parallel."""
    return f"{robot.name}_branches.h"


def branches_flag(robot: Described) -> str:
    """Return the name of the C macro that enables solution branches in SIMD lanes.

    The header ``<robot>_branches.h`` defines the macro as 1 if the compiler supports the SIMD code
    of the header.
    """
    return f"{robot.name.upper()}_BRANCHES"


def _definition(robot: Described, function: SymbolicFunction, program: Program) -> str:
    if function.signs:
        return _branched(robot, function, program)
    lines = statements(robot, function, program)
    head = f"{signature(robot.name, function)} {{"
    return "\n".join([_comment(function, program), head, *lines, "}\n"])


def _comment(function: SymbolicFunction, program: Program) -> str:
    lines = textwrap.wrap(function.summary, WIDTH - len("// "))
    counted = f"{summary(count_operations(program))}{iteration_count(function)}"
    return "\n".join(f"// {line}" for line in [*lines, counted])


def _branched(robot: Described, function: SymbolicFunction, program: Program) -> str:
    flag, name, one = branches_flag(robot), f"{robot.name}_{function.name}", branch(function)
    described: list[Argument | Result] = [*function.inputs, *function.outputs]
    n = len(function.signs)
    signs = ", ".join(f"b & {2 ** (n - 1 - i)} ? -1.0 : 1.0" for i in range(n))
    passed = [f"own_{a.name}" for a in function.inputs]
    passed += ["choice", *(f"{r.name} + {r.size} * b" for r in one.outputs)]
    return "\n".join(
        [
            f"#if !{flag}",
            _comment(replace(one, summary=f"One branch of {function.name}."), program),
            f"static {signature(robot.name, one)} {{",
            *statements(robot, one, program),
            "}",
            "#endif\n",
            f"{signature(robot.name, function)} {{",
            f"#if {flag}",
            f"  LANES_NAME({name}_branches)({', '.join(what.name for what in described)});",
            "#else",
            # The inputs are copied, because outputs of the first branch may overlap inputs that the
            # second branch reads.
            *(line for argument in function.inputs for line in own_copy(argument)),
            f"  for (int b = 0; b < {function.branches}; b++) {{",
            f"    const double choice[{n}] = {{{signs}}};",
            f"    {name}_branch({', '.join(passed)});",
            "  }",
            "#endif",
            "}\n",
        ]
    )


def statements(robot: Described, function: SymbolicFunction, program: Program) -> list[str]:
    """Return the C lines of a function's body."""
    plain, filled = naming(program), _filled(function)
    used = {program.arguments[entry.argument] for entry in program.inputs}
    used |= {name for call in function.calls for name in call.inputs}
    lines = [f"  (void){a.name};" for a in function.inputs if a.name not in used]
    lines += _called(robot, function.calls, filled)
    if len(filled) == len(function.outputs):
        return lines
    # All inputs are read before an output is written, because output arrays may overlap input
    # arrays.
    lines += _section(
        "inputs",
        [
            f"  const double {plain(entry)} = {program.arguments[entry.argument]}[{entry.entry}];"
            for entry in program.inputs
        ],
    )
    ordered = by_depth(program)
    parts = _together(ordered)
    lines += _section("shared terms", [_computed(s, plain) for s in parts.before])
    if parts.angles:
        count, angles = len(parts.angles), ", ".join(map(plain, parts.angles))
        lines += [
            "  // cosines and sines",
            *_wrapped(f"const double angle[{count}] = {{{angles}}};"),
            f"  double c[{count}], s[{count}];",
            f"  chasles_cos_sin({count}, angle, c, s);",
        ]

    def name(operand: Operand) -> str:
        return parts.turns.get(operand) or plain(operand)

    rest = set(parts.after)
    for section in _sections([s for s in level if s in rest] for level in levels(ordered)):
        written = [_written(statement, function, name) for statement in section]
        lines += _section(title(section, function.outputs), written)
    return lines


def _filled(function: SymbolicFunction) -> dict[str, str]:
    """Return the result that receives each output array of a called function, keyed by array.

    A called function writes its outputs directly to the results of its caller, without a copy.

    A called function must not write a result before all inputs of its caller are read.
    """
    given, calls = {argument.name for argument in function.inputs}, list(enumerate(function.calls))
    read = max((k for k, call in calls if not given.isdisjoint(call.inputs)), default=-1)
    # A generated function reads all its inputs before it writes a result.
    last = [call for k, call in calls if k > read or (k == read and not call.system)]
    arrays = {output.symbols: output.name for call in last for output in call.outputs}
    found = {arrays.get(r.entries, ""): r.name for r in function.outputs}
    return {} if "" in found else found


def _called(robot: Described, calls: Sequence[Call], filled: Mapping[str, str]) -> list[str]:
    lines = [f"  {robot.name}_{call.system}_closed loops;" for call in calls[:1]]
    arrays = [a for call in calls for a in call.outputs if a.name not in filled]
    lines += [f"  double {a.name}[{a.size}];" for a in arrays]
    for call in calls:
        state, of = (["&loops"], f"{call.system}_") if call.system else ([], "")
        names = [*call.inputs, *(output.name for output in call.outputs)]
        passed = ", ".join([*state, *(filled.get(name, name) for name in names)])
        lines += _wrapped(f"{robot.name}_{of}{call.entry}({passed});")
    return lines


def _section(name: str, lines: list[str]) -> list[str]:
    return [f"  // {name}", *lines] if lines else []


def _sections(levels_of: Iterable[list[Statement]]) -> Iterator[list[Statement]]:
    section: list[Statement] = []
    for level in levels_of:
        section += level
        if any(isinstance(statement, Store) for statement in level):
            yield section
            section = []
    if section:
        yield section


def _written(statement: Statement, function: SymbolicFunction, name: Naming) -> str:
    match statement:
        case Compute():
            return _computed(statement, name)
        case Store(i, entry, value):
            return f"  {function.outputs[i].name}[{entry}] = {name(value)};"


def _computed(statement: Compute, name: Naming) -> str:
    kind = "int" if statement.is_condition else "double"
    return f"  const {kind} {name(statement.result)} = {expression(statement, name)};"


def _wrapped(line: str) -> list[str]:
    """Break a line of C into lines of at most ``WIDTH`` columns."""
    return textwrap.wrap(line, WIDTH, initial_indent="  ", subsequent_indent="    ")


@dataclass(frozen=True)
class _Parts:
    """Operations of a function, split at the call that computes several cosines and sines.

    Attributes:
        before: Statements before the call that computes cosines and sines.
        angles: Angles whose cosines and sines the call computes.
        turns: Names ``c[k]`` and ``s[k]`` of the cosine and the sine of angle k.
        after: Statements after the call that computes cosines and sines.
    """

    before: tuple[Compute, ...]
    angles: tuple[Operand, ...]
    turns: Mapping[Operand, str]
    after: tuple[Statement, ...]


def _together(program: Program) -> _Parts:
    turns: dict[Operand, str] = {}
    angles: dict[Operand, int] = {}
    before: list[Compute] = []
    after: list[Statement] = []
    late: set[Operand] = set()
    for statement in program.statements:
        if isinstance(statement, Store):
            after.append(statement)
        elif not (
            late.isdisjoint(statement.operands) and turns.keys().isdisjoint(statement.operands)
        ):
            late.add(statement.result)
            after.append(statement)
        elif statement.operation in _TURNS:
            k = angles.setdefault(statement.operands[0], len(angles))
            turns[statement.result] = f"{_TURNS[statement.operation]}[{k}]"
        else:
            before.append(statement)
    return _Parts(tuple(before), tuple(angles), turns, tuple(after))
