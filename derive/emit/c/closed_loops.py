"""Generates C constants for ``chasles_closure.h``, which closes kinematic loops by iteration."""

import math
import textwrap
from collections.abc import Iterable, Mapping

import numpy as np

from ...derivation import Derivation
from ...inverse.mechanisms import chain_inverse, mode_check
from ...inverse.polished_inverse import SOLVER as POLISHED
from ...loops.iterated.closure_equations import LoopClosure
from ...loops.parametric.parametric_loops import START, SYSTEM, ParametricLoops
from ...model.mechanism import Described
from ...terms.symbolic_function import NativeSolverFunction, systems_of
from .expressions import WIDTH, number
from .header import notice, own_copy, signature, support
from .written import written_file

SUPPORTS = (
    "chasles_closure.h",
    "chasles_closure_newton.h",
    "chasles_closure_rates.h",
    "chasles_closure_tolerances.h",
)
PARAMETRIC = (
    "chasles_closure_parametric.h",
    "chasles_closure_newton.h",
    "chasles_closure_tolerances.h",
)
"""Support files for kinematic loops whose geometry is an input of the C functions."""
MODES = ("chasles_closure_modes.h", "chasles_closure_tolerances.h")
"""Support files for inverse kinematics functions that check the assembly mode of each solution."""


def closure_files(derivation: Derivation) -> dict[str, str]:
    """Return the C files for kinematic loops that are closed by iteration, keyed by file name."""
    closure, robot = derivation.closure, derivation.robot
    own: dict[str, str] = {}
    needed: list[str] = []
    for system in systems_of(derivation.functions):
        if system == SYSTEM:
            assert derivation.parametric_loops is not None
            numbers = _parametric(robot.name, derivation.parametric_loops)
            needed += PARAMETRIC
        else:
            given = closure if system == "loops" or closure is None else closure.of_chain
            assert given is not None
            own_name = f"{robot.name}_{system}"
            resumes = system == "loops" and any(f.solver == POLISHED for f in derivation.written)
            macros = _macros(robot.name, own_name, given) | {"RESUMES": int(resumes)}
            numbers = [*_defined(macros), *_tables(own_name, given)]
            needed += SUPPORTS
        solver = PARAMETRIC[0] if system == SYSTEM else SUPPORTS[0]
        included = f'\n#include "{solver}"\n'
        own[loops_file(robot, system)] = "\n".join([notice(robot), *numbers, included])
    for function in derivation.written:
        if function.solver == mode_check.SOLVER:
            own[written_file(robot, function)] = _modes(robot, function)
            needed += MODES
        if function.solver == chain_inverse.SOLVER:
            own[written_file(robot, function)] = _through_chain(derivation, function)
            needed += MODES
    return own | {name: support(name) for name in needed}


def loops_file(robot: Described, system: str) -> str:
    """Return the name of the C file that contains the constants of the loop equations."""
    return f"{robot.name}_{system}.h"


def _modes(robot: Described, function: NativeSolverFunction) -> str:
    (T, *given), (q, residual, margin) = function.inputs, function.outputs
    legs, fk = (f"{robot.name}_{name}" for name in function.calls)
    tables = function.tables
    assert isinstance(tables, mode_check.ModeTables)
    size = number(tables.size)
    n = q.size // function.branches
    turns: list[str] = []
    if any(abs(angle) > 0 for angle in tables.angles):
        angles = ", ".join("NAN" if math.isnan(x) else number(x) for x in tables.angles)
        turns = [
            f"    static const double angles[] = {{{angles}}};",
            f"    chasles_mode_turns({q.name} + {n} * k, angles, {n});",
        ]
    inputs = ", ".join([f"own_{T.name}", *(argument.name for argument in given)])
    return "\n".join(
        [
            notice(robot),
            f'#include "{MODES[0]}"\n',
            *textwrap.wrap(signature(robot.name, function), WIDTH, subsequent_indent="    "),
            "{",
            *own_copy(T),
            f"  {legs}({inputs}, {q.name}, {residual.name}, {margin.name});",
            f"  for (int k = 0; k < {function.branches}; k++) {{",
            f"    if ({residual.name}[k] != {residual.name}[k])",
            "      continue;",
            *turns,
            "    double reached[16];",
            f"    {fk}({q.name} + {n} * k, reached);",
            f"    {residual.name}[k] =",
            f"        chasles_mode_residual(own_{T.name}, reached, {residual.name}[k], {size});",
            "  }",
            "}\n",
        ]
    )


def _through_chain(derivation: Derivation, function: NativeSolverFunction) -> str:
    robot = derivation.robot
    chain, every, _ = (derivation.signature(name) for name in function.calls)
    called = [f"{robot.name}_{name}" for name in function.calls]
    T, (q, residual, margin) = function.inputs[0], function.outputs
    (slots, joints), (branches, n) = chain.outputs[0].shape, every.outputs[0].shape
    margins = every.outputs[1].shape[-1]
    assert isinstance(function.tables, mode_check.ModeTables)
    inputs = ", ".join(f"own_{argument.name}" for argument in function.inputs)
    return "\n".join(
        [
            notice(robot),
            f'#include "{MODES[0]}"\n',
            *textwrap.wrap(signature(robot.name, function), WIDTH, subsequent_indent="    "),
            "{",
            *(line for argument in function.inputs for line in own_copy(argument)),
            f"  double theta[{slots * joints}], theta_residual[{slots}], theta_margin[{slots}];",
            f"  {called[0]}({inputs}, theta, theta_residual, theta_margin);",
            f"  for (int k = 0; k < {slots}; k++) {{",
            f"    double margins[{branches * margins}];",
            f"    {called[1]}(theta + {joints} * k, {q.name} + {branches * n} * k, margins);",
            f"    for (int b = 0; b < {branches}; b++) {{",
            f"      const int at = {branches} * k + b;",
            "      double reached[16];",
            f"      {called[2]}({q.name} + {n} * at, reached);",
            f"      {residual.name}[at] = chasles_mode_residual(",
            f"          own_{T.name}, reached, theta_residual[k], {number(function.tables.size)});",
            f"      {margin.name}[at] = theta_margin[k];",
            f"      for (int i = 0; i < {margins}; i++) {{",
            f"        const double own = margins[{margins} * b + i];",
            f"        {margin.name}[at] = own < {margin.name}[at] ? own : {margin.name}[at];",
            "      }",
            "    }",
            "  }",
            "}\n",
        ]
    )


def _macros(robot: str, own: str, closure: LoopClosure) -> dict[str, object]:
    determinant = closure.start.determinant
    is_square = len(closure.units) == len(closure.unknown)
    return {
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


def _defined(macros: Mapping[str, object]) -> list[str]:
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
    return _tabled(own, numbers, indices)


def _tabled(
    own: str, numbers: Mapping[str, Iterable[float]], indices: Mapping[str, Iterable[int]]
) -> list[str]:
    return [
        *(table(f"double {own}_{key}", map(number, v)) for key, v in numbers.items()),
        *(table(f"int {own}_{key}", map(str, v)) for key, v in indices.items()),
    ]


def _parametric(robot: str, loops: ParametricLoops) -> list[str]:
    n, z = len(loops.hybrid.q), [variable.name for variable in loops.hybrid.variables]
    own, lengths = f"{robot}_{SYSTEM}", {"m": loops.size}
    macros = {
        "NAME(name)": f"{own}_##name",
        "Q": n,
        "W": loops.arguments["w"].size,
        "U": len(loops.unknown),
        "M": len(loops.units),
        "P": loops.arguments["p"].size,
        "AT(s)": f"{robot}_closure_p((s)->w, (s)->p, (s)->c, (s)->D)",
        "Z": len(z),
        "CONFIGURATION(q, z)": f"{robot}_{START}(q, z)",
    }
    numbers = {
        "ratio": [1.0] * n,
        "size_u": [lengths.get(variable.unit, 1.0) for variable in loops.unknown],
        "size_c": [lengths.get(unit, 1.0) for unit in loops.units],
    }
    indices = {
        "actuated": range(n),
        "unknown": range(n, n + len(loops.unknown)),
        "of_z": [z.index(variable.name) for variable in loops.unknown],
    }
    return [*_defined(macros), *_tabled(own, numbers, indices)]


def table(name: str, values: Iterable[str]) -> str:
    """Return the C definition of a constant array."""
    own = list(values)
    text = f"static const {name}[{len(own)}] = {{{', '.join(own)}}};"
    return textwrap.fill(text, WIDTH, subsequent_indent="    ")
