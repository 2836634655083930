"""Generates C for functions that a handwritten solver computes from tables."""

import textwrap
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from ...model.mechanism import Described
from ...terms.symbolic_function import NativeSolverFunction, Tables
from .expressions import WIDTH, number
from .header import notice, own_copy, signature, support

CIRCLE = ("chasles_circle_roots.h", "chasles_circle_tolerances.h", "chasles_vectors.h")
CARRIED = (
    *CIRCLE,
    "chasles_carried_platform.h",
    "chasles_carried_tolerances.h",
    "chasles_closure_modes.h",
    "chasles_closure_tolerances.h",
)
GENERAL = (
    *CIRCLE,
    "chasles_general.h",
    "chasles_general_back.h",
    "chasles_general_equations.h",
    "chasles_general_newton.h",
    "chasles_general_roots.h",
    "chasles_solve_six.h",
)
HEXAPOD = (
    *CIRCLE,
    "chasles_double_joints.h",
    "chasles_hexapod_paths.h",
    "chasles_hexapod_system.h",
    "chasles_hexapod_tolerances.h",
    "chasles_solve_six.h",
)
SUPPORTS = {
    "carried_arm": (
        "chasles_carried_arm.h",
        "chasles_carried_dixon.h",
        "chasles_carried_elimination.h",
        *CARRIED,
    ),
    "carried_wrist": ("chasles_carried_wrist.h", *CARRIED),
    "general": ("chasles_general.h", *GENERAL),
    "general_tool": ("chasles_general_tool.h", *GENERAL),
    "hexapod": ("chasles_hexapod.h", *HEXAPOD),
    "triad": ("chasles_triad.h", "chasles_triad_tolerances.h", *CIRCLE),
}
"""Support files of each handwritten C solver. For each handwritten solver, the generated C code
includes the first listed file, which includes the other files."""


def written_files(robot: Described, written: Sequence[NativeSolverFunction]) -> dict[str, str]:
    """Return the C files of functions with handwritten solvers, keyed by file name."""
    tabled = [function for function in written if function.solver in SUPPORTS]
    own = {written_file(robot, function): _source(robot, function) for function in tabled}
    names = {name for function in tabled for name in SUPPORTS[function.solver]}
    return own | {name: support(name) for name in sorted(names)}


def written_file(robot: Described, function: NativeSolverFunction) -> str:
    """Return the name of the file that contains a function with a handwritten solver."""
    return f"{robot.name}_{function.name}.h"


def _source(robot: Described, function: NativeSolverFunction) -> str:
    """Return the C tables of a function and the C function that calls its handwritten solver.

    The generated file is included after the functions that the solver calls.
    """
    prefix, solver = f"chasles_{function.solver}", SUPPORTS[function.solver][0]
    table = f"{robot.name}_{function.name}_tables"
    is_arm = function.role.finds_coordinates
    kind, entry = ("arm", "ik") if is_arm else ("platform", function.name)
    copies = [line for argument in function.inputs for line in own_copy(argument)]
    first, *given = (f"own_{argument.name}" for argument in function.inputs)
    passed = [f"&{table}", first]
    if given and is_arm:
        values = ", ".join(f"*{name}" for name in given)
        copies.append(f"  const double given[] = {{{values}}};")
    if is_arm:
        passed.append("given" if given else "NULL")
    passed += [result.name for result in function.outputs]
    return "\n".join(
        [
            notice(robot),
            f'#include "{solver}"\n',
            *table_lines(robot, f"{prefix}_{kind}", table, function.calls, function.tables),
            *textwrap.wrap(f"{signature(robot.name, function)}", WIDTH, subsequent_indent="    "),
            "{",
            *copies,
            f"  {prefix}_{entry}({', '.join(passed)});",
            "}\n",
        ]
    )


def table_lines(
    robot: Described, kind: str, name: str, calls: Sequence[str], tables: Tables
) -> list[str]:
    """Return the definition of a constant C structure."""
    lines = [f"  {robot.name}_{called}," for called in calls]
    for field in fields(tables):
        text = f"{_braces(getattr(tables, field.name))},"
        lines += textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="    ")
    return [f"static const {kind} {name} = {{", *lines, "};\n"]


def _braces(values: Any) -> str:
    match values:
        case tuple():
            return f"{{{', '.join(map(_braces, values))}}}"
        case int():
            return str(int(values))
        case _:
            return number(values + 0.0)
