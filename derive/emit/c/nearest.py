"""Generates the C function ``<function>_nearest``, which returns the solution nearest to a seed.

``<robot>_nearest.h`` contains the joint limits and one ``_nearest`` function for each inverse
kinematics function. The file `<robot>.c` includes ``<robot>_nearest.h`` last.
"""

import textwrap
from collections.abc import Sequence

from ...derivation import Derivation
from ...model.coupling import Limits
from ...model.mechanism import Described, Mechanism
from ...model.robot import SerialRobot
from ...terms.symbolic_function import Signature, SymbolicFunction
from ..seeds import counts, inverses, nearest_summary, periodic, seed_inputs, seeded, wraps_of
from .expressions import WIDTH, number
from .header import notice, support
from .lanes import sizes
from .passive_limits import PASSIVE, limited_names, limited_variables, passive_tables
from .scalar import branches_flag
from .windings import COUPLINGS, joint_limits, shares_limits, windings

LANES = "chasles_nearest_lanes.h"
BATCH = "chasles_nearest_batch.h"
SUPPORTS = ("chasles_nearest.h", LANES, BATCH, "chasles_distance.h")


def nearest_file(robot: Described) -> str:
    """Return the name of the C header that selects the solutions nearest to a seed."""
    return f"{robot.name}_nearest.h"


def nearest_files(derivation: Derivation) -> dict[str, str]:
    """Return the C header that selects the solutions nearest to a seed, and its support files."""
    robot, found = derivation.robot, inverses(derivation)
    if not found:
        return {}
    public = seeded(derivation)
    lines = [notice(robot), f'#include "{SUPPORTS[0]}"']
    passive = limited_variables(derivation)
    is_coupled = shares_limits(derivation, wraps_of(derivation))
    is_shared = is_coupled or bool(passive)
    if is_coupled:
        lines += [f'#include "{COUPLINGS}"', "", *windings(derivation)]
    elif passive:
        lines += passive_tables(derivation)
    elif any(_is_in_lanes(function) for function in found):
        lines += [f"#if {branches_flag(robot)}", f'#include "{LANES}"', "#endif"]
    lines += ["", *(_limits(derivation, is_shared=is_shared) if public else ())]
    for function in found:
        in_lanes = _is_in_lanes(function) and not is_shared
        lines += _in_lanes(derivation, function) if in_lanes else []
        lines += _by_moves(derivation, function, in_lanes=in_lanes, is_shared=is_shared)
        lines += (
            _definition(derivation, function, is_shared=is_shared) if function in public else []
        )
    needed = (*SUPPORTS, *[COUPLINGS] * is_coupled, *[PASSIVE] * bool(passive))
    return {nearest_file(robot): "\n".join(lines), **{name: support(name) for name in needed}}


def nearest_declarations(derivation: Derivation) -> list[str]:
    """Return commented C declarations of the ``_nearest`` functions for the robot's header."""
    return [_declaration(derivation, function) for function in seeded(derivation)]


def _own_inputs(derivation: Derivation, function: Signature) -> list[str]:
    prefix, own = derivation.robot.name, seed_inputs(derivation, function)
    assert own is not None
    if own.function in own.names:
        name = own.function
        return [f"  double {name};", f"  {prefix}_{name}(q_seed, &{name});"]
    pairs = list(zip(own.names, own.entries, strict=True))
    if own.function is None:
        return [f"  const double {name} = q_seed[{k}];" for name, k in pairs]
    values = [f"  const double {name} = theta[{k}];" for name, k in pairs]
    call = f"  {prefix}_{own.function}(q_seed, theta);"
    return [f"  double theta[{own.size}];", call, *values]


def _limits(derivation: Derivation, *, is_shared: bool) -> list[str]:
    robot = derivation.robot
    limits: list[Limits] = [coordinate.limits for coordinate in robot.coordinates]
    if is_shared and isinstance(robot, SerialRobot):
        limits += joint_limits(robot)
    elif is_shared and isinstance(robot, Mechanism):
        limits += [robot.members[name].limits for name in limited_names(derivation)]
    lower, upper = zip(*map(bounds, limits), strict=True)
    n = len(limits)
    return [
        *_wrapped(f"static const double {robot.name}_lower[{n}] = {{{', '.join(lower)}}};"),
        *_wrapped(f"static const double {robot.name}_upper[{n}] = {{{', '.join(upper)}}};"),
        "",
    ]


def bounds(limits: Limits) -> tuple[str, str]:
    """Return the lower and the upper limit of a coordinate as C expressions."""
    low, high = limits
    return (
        "-INFINITY" if low is None else number(float(low)),
        "INFINITY" if high is None else number(float(high)),
    )


def turns(derivation: Derivation, function: Signature) -> list[str]:
    """Return a C expression for the period of each coordinate.

    The expression is ``0`` for a coordinate without a period.
    """
    return ["CHASLES_FULL_TURN" if wraps else "0" for wraps in periodic(derivation, function)]


def _signature(derivation: Derivation, function: Signature) -> str:
    n, target = len(derivation.robot.coordinates), function.inputs[0]
    parameters = [f"const double {target.name}[{target.size}]", f"const double q_seed[{n}]"]
    parameters += [f"const double {name}[{n}]" for name in ("lower", "upper", "weights")]
    parameters += [f"double q[{n}]", "double *residual", "double *margin"]
    return f"int {derivation.robot.name}_{function.name}_nearest({', '.join(parameters)})"


def _is_in_lanes(function: Signature) -> bool:
    return isinstance(function, SymbolicFunction) and bool(function.signs)


def _definition(derivation: Derivation, function: Signature, *, is_shared: bool) -> list[str]:
    prefix = derivation.robot.name
    name, n = f"{prefix}_{function.name}", len(derivation.robot.coordinates)
    target, *more = function.inputs
    ones = ", ".join(str(int(is_counted)) for is_counted in counts(derivation, function))
    inputs = ", ".join([target.name, *(f"&{a.name}" for a in more)])
    return [
        *_wrapped(f"static const double {name}_counts[{n}] = {{{ones}}};"),
        *_wrapped(
            f"static const double {name}_turn[{n}] = {{{', '.join(turns(derivation, function))}}};"
        ),
        "",
        *_wrapped(_signature(derivation, function)),
        "{",
        f"  double scale[{n}];",
        *_own_inputs(derivation, function),
        f"  chasles_moves moves = {{{prefix}_lower, {prefix}_upper, {name}_counts, {name}_turn}};",
        *(_own_limits(prefix, n) if is_shared else _LIMITS),
        f"  for (int j = 0; weights && j < {n}; j++) {{",
        f"    scale[j] = weights[j] * {name}_counts[j];",
        "    moves.scale = scale;",
        "  }",
        f"  return {name}_nearest_by({inputs}, &moves, CHASLES_SOLVED, q_seed, q,",
        "      residual, margin);",
        "}\n",
    ]


_LIMITS = (
    "  moves.lower = lower ? lower : moves.lower;",
    "  moves.upper = upper ? upper : moves.upper;",
)


def _own_limits(prefix: str, n: int) -> list[str]:
    lines = []
    for side in ("lower", "upper"):
        own = f"{prefix}_{side}"
        lines += [
            f"  double own_{side}[sizeof {own} / sizeof *{own}];",
            f"  memcpy(own_{side}, {own}, sizeof {own});",
            f"  memcpy(own_{side}, {side} ? {side} : {own}, {n} * sizeof *{own});",
            f"  moves.{side} = own_{side};",
        ]
    return lines


def _by_moves(
    derivation: Derivation, function: Signature, *, in_lanes: bool, is_shared: bool
) -> list[str]:
    name, n = f"{derivation.robot.name}_{function.name}", len(derivation.robot.coordinates)
    k, names = function.outputs[0].shape[0], [argument.name for argument in function.inputs]
    inputs = ", ".join(names)
    kind, table = "coupled", "couplings"
    if not isinstance(derivation.robot, SerialRobot):
        kind, table = "passive", "passive_limits"
    coupled = f"_{kind}(&{derivation.robot.name}_{table}, &of," if is_shared else "(&of,"
    plain = [
        f"  double slots[{n * k}], residuals[{k}], margins[{k}];",
        f"  const chasles_slots of = {{{n}, {k}, slots, residuals, margins, tolerance}};",
        f"  {name}({inputs}, slots, residuals, margins);",
        f"  return chasles_nearest{coupled} moves, q_seed, q, residual, margin);",
    ]
    if in_lanes:
        call = f"  return LANES_NAME({name}_nearest_lanes)("
        arguments = f"      {inputs}, moves, tolerance, q_seed, q, residual, margin);"
        flag = branches_flag(derivation.robot)
        plain = [f"#if {flag}", call, arguments, "#else", *plain, "#endif"]
    return [
        f"static inline int {name}_nearest_by(",
        *_parameters_by(names),
        "{",
        *plain,
        "}\n",
    ]


def _in_lanes(derivation: Derivation, function: Signature) -> list[str]:
    name, n = f"{derivation.robot.name}_{function.name}", len(derivation.robot.coordinates)
    k, names = function.outputs[0].shape[0], [argument.name for argument in function.inputs]
    width = sum(sizes(function).outputs) // k
    return [
        f"#if {branches_flag(derivation.robot)}",
        f"static LANES_SCHEDULED LANES_TARGET int LANES_NAME({name}_nearest_lanes)(",
        *_parameters_by(names),
        "{",
        f"  lanes out[{k} / LANES_COUNT({k})][{width}];",
        f"  double slots[{n * k}], residuals[{k}], margins[{k}];",
        f"  const chasles_slots of = {{{n}, {k}, slots, residuals, margins, tolerance}};",
        f"  LANES_NAME({name}_lanes)({', '.join([*names, 'out'])});",
        f"  const int best = LANES_NAME(chasles_nearest_lanes)({n}, {k}, {width}, out[0], moves,",
        "      tolerance, q_seed, q, residual, margin);",
        "  if (best >= 0) {",
        "    return best;",
        "  }",
        f"  LANES_NAME({name}_rows)((const lanes (*)[{width}])out, slots, residuals, margins);",
        "  return chasles_nearest(&of, moves, q_seed, q, residual, margin);",
        "}",
        "#endif\n",
    ]


def _parameters_by(names: Sequence[str]) -> list[str]:
    inputs = ", ".join(f"const double *{name}" for name in names)
    return [
        f"    {inputs}, const chasles_moves *moves, double tolerance, const double *q_seed,",
        "    double *q, double *residual, double *margin)",
    ]


def _wrapped(line: str) -> list[str]:
    return textwrap.wrap(line, WIDTH, subsequent_indent="    ")


def _declaration(derivation: Derivation, function: Signature) -> str:
    n, target = len(derivation.robot.coordinates), function.inputs[0]
    shape = " x ".join(map(str, target.shape))
    is_shared = shares_limits(derivation, wraps_of(derivation)) or limited_variables(derivation)
    lines = [
        *nearest_summary(function),
        "Returns its slot; -1 if out of reach, -2 if outside the limits, -3 if T or q_seed is NaN.",
        f"  {target.name}: {target.meaning}, {shape} ({target.unit})",
        f"  q_seed: the start configuration, {n}",
        f"  lower, upper: limits, {n} each; NULL for the robot's limits, infinite for no limit",
        *(["    Dependent joints keep the limits of the robot."] if is_shared else []),
        f"  weights: weight of each coordinate's displacement in the distance, {n}; NULL for 1",
        f"  q: the solution, shifted by full turns towards q_seed, {n}; NaN without a solution",
        "  residual, margin: of this slot; without a solution, of the slot of smallest residual",
    ]
    comment = "\n * ".join(lines)
    text = "\n".join(_wrapped(f"{_signature(derivation, function)};"))
    return f"/* {comment} */\n{text}"
