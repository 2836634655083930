"""Generates C for inverse kinematics that refines nominal solutions with Newton steps."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace

from ...derivation import Derivation
from ...inverse.polished_inverse import SOLVER, RefinedTables
from ...inverse.tasks.partial_poses import POSITION_ENTRIES
from ...inverse.tasks.slots import POSE_SYMBOLS
from ...model.mechanism import Described
from ...program.counting import count_operations
from ...program.programs import Programs
from ...terms.symbolic_function import Argument, NativeSolverFunction, Result, SymbolicFunction
from .batch import loads
from .expressions import WIDTH, number
from .header import notice, signature, support
from .lanes import kernel, offsets, sizes
from .scalar import branches_flag, statements
from .sections import summary
from .written import GENERAL, table_lines, written_file

PARTS = ("", "_deflated", "_equations", "_fold", "_general", "_lanes", "_search", "_steps")
SUPPORTS = tuple(f"chasles_polish{part}.h" for part in (*PARTS, "_tolerances"))


def polished_files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the C files for inverse kinematics that refines the nominal solutions of an arm.

    The result is empty if the robot has no refined inverse kinematics function.
    """
    robot = derivation.robot
    refined = [function for function in derivation.written if function.solver == SOLVER]
    own = {written_file(robot, f): _source(derivation, f, programs) for f in refined}
    general = GENERAL if any(_tables(f).general for f in refined) else ()
    return own | {name: support(name) for name in ((*SUPPORTS, *general) if own else ())}


def _source(derivation: Derivation, function: NativeSolverFunction, programs: Programs) -> str:
    robot = derivation.robot
    start, posed = function.calls
    nominal, pose = derivation.function(start), derivation.function(posed)
    tables, n = _tables(function), function.outputs[0].shape[-1]
    own = f"{robot.name}_{function.name}"
    started = _at("in", nominal.inputs) + _at("out", nominal.outputs)
    macros = {
        "POSE(q, at)": f"{robot.name}_{pose.name}(q, {', '.join(_at('at', pose.outputs))})",
        "NOMINAL(in, out)": f"{robot.name}_{nominal.name}({', '.join(started)})",
        "NAME(name)": f"{own}_##name",
        "N": n,
        "SLOTS": nominal.branches,
        "RESULTS": function.branches,
        "INPUTS": sum(sizes(nominal).inputs),
        "FREE": _numbers([k not in function.role.fixed for k in range(n)]),
        "MOVING": n - len(function.role.fixed),
        "TURNS": _numbers(tables.turns),
        "LENGTH": number(tables.length),
        "DEVIATION": number(tables.deviation),
        "MEETS": int(tables.meets),
        "IS_SEARCHED": int(tables.is_searched),
        "IS_POSITION": int(_is_position(function)),
    }
    alone, *others = (f"#define POLISH_{name} {value}" for name, value in macros.items())
    return "\n".join(
        [
            notice(robot),
            *_posed(robot, own, pose, programs, alone),
            *others,
            *_seeded(derivation, own, pose, programs),
            *_general_lines(derivation, function),
            '#include "chasles_polish.h"\n',
            *textwrap.wrap(signature(robot.name, function), WIDTH, subsequent_indent="    "),
            "{",
            *_call(own, function),
            "}\n",
        ]
    )


def _posed(
    robot: Described,
    own: str,
    pose: SymbolicFunction,
    programs: Programs,
    alone: str,
) -> list[str]:
    one_by_one = ["#define POLISH_ON_LANES 0", alone]
    if pose.calls:
        return one_by_one
    size, program = sizes(pose), programs.whole[pose.name]
    return [
        f"#if {branches_flag(robot)}",
        "#define POLISH_ON_LANES 1",
        f"#define POLISH_POSE LANES_NAME({own}_pose)\n",
        f"// {pose.name} on lanes: {summary(count_operations(program))}",
        "LANES_INLINE void POLISH_POSE(const lanes *in, lanes *out)",
        "{",
        *kernel(program, loads(program, size), size),
        "}\n",
        "#else",
        *one_by_one,
        "#endif",
    ]


def _seeded(
    derivation: Derivation, own: str, pose: SymbolicFunction, programs: Programs
) -> list[str]:
    """Print the pose computation for a robot whose loops are solved by Newton's method.

    Newton's iteration starts at the loop configuration w, or at the reference configuration if w is
    NaN or far from the coordinates q. The C function overwrites w with the loop configuration at
    the coordinates q.
    """
    closure = derivation.closure
    if not pose.calls or closure is None:
        return ["#define POLISH_SEEDS 0"]
    first, *others = pose.calls
    (w,) = first.outputs
    resumed = replace(first, entry="resumed", inputs=(*first.inputs, w.name), outputs=())
    from_seed = replace(pose, calls=(resumed, *others))
    results = ", ".join(f"double *{result.name}" for result in pose.outputs)
    return [
        f"#define POLISH_SEEDS {len(closure.names)}",
        f"#define POLISH_REFERENCE {{{', '.join(map(number, closure.start.q.tolist()))}}}",
        f"#define POLISH_FROM_SEED(q, w, at) {own}_from_seed(q, w, at, at + 16)\n",
        f"static void {own}_from_seed(const double *q, double *{w.name}, {results})",
        "{",
        *statements(derivation.robot, from_seed, programs.whole[pose.name]),
        "}\n",
    ]


def _tables(function: NativeSolverFunction) -> RefinedTables:
    assert isinstance(function.tables, RefinedTables)
    return function.tables


def _general_lines(derivation: Derivation, function: NativeSolverFunction) -> list[str]:
    robot, tables = derivation.robot, _tables(function)
    if tables.general is None:
        return ["#define POLISH_IS_GENERAL 0", "#define POLISH_IS_ASKED 0"]
    name = f"{robot.name}_{function.name}_tables"
    return [
        '#include "chasles_general.h"\n',
        *table_lines(robot, "chasles_general_arm", name, function.calls[1:], tables.general),
        "#define POLISH_IS_GENERAL 1",
        f"#define POLISH_IS_ASKED {int(tables.is_asked)}",
        f"#define POLISH_GENERAL {name}",
    ]


def _at(array: str, values: Sequence[Argument | Result]) -> list[str]:
    first = offsets([value.size for value in values])
    return [f"{array} + {k}" if k else array for k in first]


def _is_position(function: NativeSolverFunction) -> bool:
    return function.role.components == ("position",)


def _call(own: str, function: NativeSolverFunction) -> list[str]:
    if _is_position(function):
        (p,) = function.inputs
        places = [POSE_SYMBOLS.index(entry) for entry in POSITION_ENTRIES]
        placed = (f"[{place}] = {p.name}[{k}]" for k, place in enumerate(places))
        results = ", ".join(result.name for result in function.outputs)
        return [
            f"  const double in[{len(POSE_SYMBOLS)}] = {{{', '.join(placed)}}};",
            f"  {own}_polished(in, {results});",
        ]
    lines = [f"  double in[{sum(argument.size for argument in function.inputs)}];"]
    first = offsets([argument.size for argument in function.inputs])
    for k, argument in zip(first, function.inputs, strict=True):
        place = f"in + {k}" if k else "in"
        lines.append(f"  memcpy({place}, {argument.name}, {argument.size} * sizeof *in);")
    results = ", ".join(result.name for result in function.outputs)
    return [*lines, f"  {own}_polished(in, {results});"]


def _numbers(values: Sequence[float]) -> str:
    return f"{{{', '.join(number(float(value)) for value in values)}}}"
