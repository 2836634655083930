"""The C of loops without a closed form: the numbers of a robot, solved by ``chasles_closure.h``."""

import textwrap
from collections.abc import Iterable

import numpy as np

from ...derivation import Derivation
from ...inverse.mechanisms import mode_check
from ...loops.iterated.closure_equations import LoopClosure
from ...model.mechanism import Described
from ...terms.symbolic_function import WrittenFunction
from .expressions import WIDTH, number
from .header import notice, own_copy, signature, support
from .written import written_file

SUPPORTS = (
    "chasles_closure.h",
    "chasles_closure_newton.h",
    "chasles_closure_rates.h",
    "chasles_closure_tolerances.h",
)
MODES = ("chasles_closure_modes.h", "chasles_closure_tolerances.h")
"""The files of robots whose inverse by legs is compared with the forward kinematics."""


def closure_files(derivation: Derivation) -> dict[str, str]:
    """The files of iterated loops, with their solver, by name; none for another robot."""
    closure, robot = derivation.closure, derivation.robot
    systems = {call.system for function in derivation.functions for call in function.calls}
    own, needed = {}, [*(SUPPORTS if systems else ())]
    for system in sorted(systems):
        given = closure if system == "loops" or closure is None else closure.of_chain
        assert given is not None
        own[loops_file(robot, system)] = _source(robot, system, given)
    for function in derivation.written:
        if function.solver == mode_check.SOLVER:
            own[written_file(robot, function)] = _modes(robot, function)
            needed += MODES
    return own | {name: support(name) for name in needed}


def loops_file(robot: Described, system: str) -> str:
    """Name of the file with the numbers of the equations of loops."""
    return f"{robot.name}_{system}.h"


def _source(robot: Described, system: str, closure: LoopClosure) -> str:
    """The numbers of the equations as macros and tables, and the solver."""
    own = f"{robot.name}_{system}"
    return "\n".join(
        [
            notice(robot),
            *_macros(robot.name, own, closure),
            *_tables(own, closure),
            '\n#include "chasles_closure.h"\n',
        ]
    )


def _modes(robot: Described, function: WrittenFunction) -> str:
    """The inverse by legs; the residual of each slot is by the forward kinematics."""
    (T,), (q, residual, margin) = function.inputs, function.outputs
    legs, fk = (f"{robot.name}_{name}" for name in function.calls)
    size = number(float(str(function.tables[0])))
    n = q.size // function.branches
    return "\n".join(
        [
            notice(robot),
            f'#include "{MODES[0]}"\n',
            *textwrap.wrap(signature(robot.name, function), WIDTH, subsequent_indent="    "),
            "{",
            *own_copy(T),
            f"  {legs}(own_{T.name}, {q.name}, {residual.name}, {margin.name});",
            f"  for (int k = 0; k < {function.branches}; k++) {{",
            f"    if ({residual.name}[k] != {residual.name}[k])",
            "      continue;",
            "    double reached[16];",
            f"    {fk}({q.name} + {n} * k, reached);",
            f"    {residual.name}[k] =",
            f"        chasles_mode_residual(own_{T.name}, reached, {residual.name}[k], {size});",
            "  }",
            "}\n",
        ]
    )


def _macros(robot: str, own: str, closure: LoopClosure) -> list[str]:
    determinant = closure.start.determinant
    is_square = len(closure.units) == len(closure.unknown)
    macros = {
        "NAME(name)": f"{own}_##name",
        "Q": len(closure.given),
        "W": len(closure.names),
        "U": len(closure.unknown),
        "M": len(closure.units),
        "AT(s)": f"{robot}_closure((s)->w, (s)->c, (s)->D)",
        "BEND(w, wd, D)": f"{robot}_closure_D_w_dot(w, wd, D)",
        "SENSE": number(float(np.sign(determinant) * is_square)),
        "DETERMINANT": number(abs(determinant)),
    }
    return [f"#define CLOSURE_{name} {value}" for name, value in macros.items()]


def _tables(own: str, closure: LoopClosure) -> list[str]:
    start = closure.start
    lengths = [closure.size if is_length else 1.0 for is_length in closure.is_length]
    numbers = {
        "ratio": closure.ratios,
        "size_u": [lengths[k] for k in closure.unknown],
        "size_c": [closure.size if unit == "m" else 1.0 for unit in closure.units],
        "start_q": start.q.tolist(),
        "start_w": start.w.tolist(),
        "tangent": start.tangent.ravel().tolist(),
    }
    z = [variable.name for variable in closure.hybrid.variables]
    indices = {
        "actuated": closure.given,
        "unknown": closure.unknown,
        "of_z": [z.index(name) for name in closure.names],
    }
    return [
        *(table(f"double {own}_{key}", map(number, v)) for key, v in numbers.items()),
        *(table(f"int {own}_{key}", map(str, v)) for key, v in indices.items()),
    ]


def table(name: str, values: Iterable[str]) -> str:
    """The definition of an array of constants."""
    own = list(values)
    text = f"static const {name}[{len(own)}] = {{{', '.join(own)}}};"
    return textwrap.fill(text, WIDTH, subsequent_indent="    ")
