"""The C of functions of the geometry of loops, solved by ``chasles_closure_parametric.h``."""

import textwrap

from ...chain.parametric import REPRESENTATION
from ...derivation import Derivation
from ...loops.parametric.parametric_loops import SOLVER, START, ParametricLoops
from ...terms.symbolic_function import WrittenFunction
from .closed_loops import table
from .expressions import WIDTH, number
from .header import notice, signature, support
from .written import written_file

SUPPORTS = (
    "chasles_closure_newton.h",
    "chasles_closure_parametric.h",
    "chasles_closure_tolerances.h",
)


def parametric_files(derivation: Derivation) -> dict[str, str]:
    """The file of these functions, with their solver, by name; none for another robot."""
    written = [function for function in derivation.written if function.solver == SOLVER]
    loops = derivation.parametric_loops
    if loops is None or not written:
        return {}
    robot = derivation.robot
    macros = _macros(robot.name, loops)
    lines = [
        notice(robot),
        *(f"#define CLOSURE_{name} {value}" for name, value in macros.items()),
        *_tables(robot.name, loops),
        '\n#include "chasles_closure_parametric.h"\n',
        *(_definition(robot.name, loops, function) for function in written),
        *(f"#undef CLOSURE_{name.partition('(')[0]}" for name in macros),
    ]
    own = {written_file(robot, written[0]): "\n".join(lines) + "\n"}
    return own | {name: support(name) for name in SUPPORTS}


def _macros(robot: str, loops: ParametricLoops) -> dict[str, str | int]:
    return {
        "NAME(name)": f"{robot}_loops_p_##name",
        "Q": loops.arguments["q"].size,
        "W": loops.arguments["w"].size,
        "U": len(loops.unknown),
        "M": len(loops.units),
        "P": loops.arguments["p"].size,
        "AT(s)": f"{robot}_closure_p((s)->w, (s)->p, (s)->c, (s)->D)",
        "Z": len(loops.hybrid.variables),
        "POSTURE(q, z)": f"{robot}_{START}(q, z)",
    }


def _tables(robot: str, loops: ParametricLoops) -> list[str]:
    n, z = len(loops.hybrid.q), [variable.name for variable in loops.hybrid.variables]
    numbers = {
        "ratio": [1.0] * n,
        "size_u": [loops.size if variable.unit == "m" else 1.0 for variable in loops.unknown],
        "size_c": [loops.size if unit == "m" else 1.0 for unit in loops.units],
    }
    indices = {
        "actuated": range(n),
        "unknown": range(n, n + len(loops.unknown)),
        "of_z": [z.index(variable.name) for variable in loops.unknown],
    }
    own = f"{robot}_loops_p"
    return [
        *(table(f"double {own}_{key}", map(number, values)) for key, values in numbers.items()),
        *(table(f"int {own}_{key}", map(str, values)) for key, values in indices.items()),
    ]


def _definition(robot: str, loops: ParametricLoops, function: WrittenFunction) -> str:
    head = textwrap.wrap(signature(robot, function), WIDTH, subsequent_indent="    ")
    body = [f"{robot}_loops_p_closed s;", f"{robot}_loops_p_posed(q, p, &s);"]
    (result,) = function.outputs
    if function.name == "fk_p":
        body += [_called(robot, "tool_p", result.name)]
    else:
        body += _through(robot, loops, function, result.name)
    return "\n".join([*head, "{", *(f"  {line}" for line in body), "}\n"])


def _through(
    robot: str, loops: ParametricLoops, function: WrittenFunction, result: str
) -> list[str]:
    """A Jacobian, with the part that goes through the loops."""
    w, m = loops.arguments["w"].size, len(loops.units)
    lines = [
        f"double J_w[{6 * w}], L[{6 * m}];",
        _called(robot, "tool_p_D_w", "J_w"),
        f"{robot}_loops_p_levers(&s, J_w, L);",
    ]
    if function.name == "jacobian_p":
        n = loops.arguments["q"].size
        return [*lines, f"{robot}_loops_p_through(J_w, L, s.D, {w}, {n}, {result});"]
    count = loops.arguments["p"].size
    lines += [
        f"double J_p[{6 * count}], c_p[{m * count}];",
        _called(robot, "tool_p_D_p", "J_p"),
        _called(robot, "closure_p_D_p", "c_p"),
    ]
    representation = REPRESENTATION[function.name]
    if representation != "mixed":
        lines += ["double T[16];", _called(robot, "tool_p", "T")]
    lines += [f"{robot}_loops_p_through(J_p, L, c_p, {count}, {count}, {result});"]
    if representation != "mixed":
        lines += [f"{robot}_loops_p_in_{representation}(T, {result});"]
    return lines


def _called(robot: str, name: str, result: str) -> str:
    return f"{robot}_{name}(s.w, s.p, {result});"
