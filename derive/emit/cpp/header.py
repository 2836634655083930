"""Generates a C++17 header that wraps the C functions of a robot."""

from collections.abc import Sequence

from ...derivation import Derivation
from ...model.mechanism import Coordinate
from ...model.robot import Joint, Motor
from ...program.programs import Programs
from ...terms.symbolic_function import (
    Argument,
    NativeSolverFunction,
    Result,
    Signature,
    SymbolicFunction,
)
from ..c.expressions import wrapped
from ..c.header import description, notice
from ..c.nearest import bounds
from ..reserved import safe
from ..seeds import nearest_summary, seeded

SLOTS = ["q", "residual", "margin"]
"""Output names of the inverse functions that return `Solutions` in C++."""


def header(derivation: Derivation, programs: Programs) -> str:
    """Return the C++ header of a robot."""
    robot = derivation.robot
    guard = f"CHASLES_ROBOT_{robot.name.upper()}_HPP"
    functions: Sequence[SymbolicFunction | NativeSolverFunction] = (
        *derivation.functions,
        *derivation.written,
    )
    results = [_result(function) for function in functions if _has_own_result(function)]
    definitions = [_definition(robot.name, f, description(f, programs)) for f in functions]
    nearest = [_nearest(derivation, function) for function in seeded(derivation)]
    body = "\n\n".join([_constants(robot.coordinates), *results, *definitions, *nearest])
    return f"""\
{notice(robot)}
/* Meters, radians, seconds. Matrices are dense and row-major. Twists are (v, omega), linear first.
 * No function allocates, has state or throws. An out-of-reach pose has solutions with NaN or a
 * residual.
 */
#ifndef {guard}
#define {guard}

#include <string_view>

#include "{robot.name}.h"
#include "kinematics.hpp"

namespace chasles::{safe(robot.name)} {{

{body}

}}  // namespace chasles::{safe(robot.name)}

#endif
"""


def _constants(coordinates: Sequence[Joint | Motor | Coordinate]) -> str:
    n = len(coordinates)
    names = ", ".join(f'"{coordinate.name}"' for coordinate in coordinates)
    units = ", ".join(f'"{coordinate.unit}"' for coordinate in coordinates)
    limits = zip(*(bounds(coordinate.limits) for coordinate in coordinates), strict=True)
    lower, upper = (", ".join(side).lower() for side in limits)
    texts = f"inline constexpr std::array<std::string_view, {n}>"
    return "\n".join(
        [
            f"inline constexpr std::size_t coordinate_count = {n};",
            *wrapped(f"{texts} coordinate_names = {{{names}}};"),
            *wrapped(f"{texts} coordinate_units = {{{units}}};"),
            "/** Lower and upper limits of the coordinates. */",
            *wrapped(
                f"inline constexpr Limits<{n}> coordinate_limits = {{{{{lower}}}, {{{upper}}}}};"
            ),
        ]
    )


def _definition(prefix: str, function: Signature, lines: Sequence[str]) -> str:
    arguments = [_input(argument) for argument in function.inputs]
    kind, outputs = _returned(function)
    passed = ", ".join([*(_passed(argument) for argument in function.inputs), *outputs])
    call = f"{prefix}_{function.name}({passed});"
    return _function(lines, kind, safe(function.name), arguments, call)


def _function(
    lines: Sequence[str], kind: str, name: str, arguments: Sequence[str], call: str
) -> str:
    head = f"inline {kind} {name}({', '.join(arguments)}) noexcept {{"
    body = [f"  {kind} result;", *wrapped(call, "  "), "  return result;", "}"]
    return "\n".join([_comment(lines), *wrapped(head), *body])


def _returned(function: Signature) -> tuple[str, list[str]]:
    outputs = function.outputs
    if len(outputs) == 1:
        return _type(outputs[0]), ["&result" if outputs[0].size == 1 else "result.data()"]
    members = [
        f"&result.{safe(o.name)}"
        if o.size == 1 and not _is_slots(function)
        else f"result.{safe(o.name)}.data()"
        for o in outputs
    ]
    if _is_slots(function):
        return f"Solutions<{outputs[0].shape[0]}, {outputs[0].shape[1]}>", members
    return _result_name(function), members


def _is_slots(function: Signature) -> bool:
    return function.role.is_inverse and [output.name for output in function.outputs] == SLOTS


def _has_own_result(function: Signature) -> bool:
    return len(function.outputs) > 1 and not _is_slots(function)


def _result_name(function: Signature) -> str:
    return "".join(word.capitalize() for word in function.name.split("_"))


def _result(function: Signature) -> str:
    members = [
        f"  {_type(output)} {safe(output.name)}; /**< {output.meaning} ({output.unit}) */"
        for output in function.outputs
    ]
    opening = f"/** Results of {function.name}. */\nstruct {_result_name(function)} {{"
    return "\n".join([opening, *members, "};"])


def _type(value: Result) -> str:
    if value.size == 1:
        return "double"
    if len(value.shape) == 1:
        return f"std::array<double, {value.size}>"
    return f"Array<{', '.join(map(str, value.shape))}>"


def _input(argument: Argument) -> str:
    kind = "double" if argument.size == 1 else f"View<{argument.size}>"
    return f"{kind} {safe(argument.name)}"


def _passed(argument: Argument) -> str:
    name = safe(argument.name)
    return f"&{name}" if argument.size == 1 else f"{name}.data()"


def _nearest(derivation: Derivation, function: Signature) -> str:
    n, name = len(derivation.robot.coordinates), f"{function.name}_nearest"
    target = function.inputs[0]
    arguments = [
        *(_input(target), f"View<{n}> q_seed"),
        f"const Limits<{n}>& limits = coordinate_limits",
        f"const std::array<double, {n}>* weights = nullptr",
    ]
    passed = [_passed(target), "q_seed.data()", "limits.lower.data()", "limits.upper.data()"]
    passed += ["weights ? weights->data() : nullptr", "result.q.data()"]
    passed += ["&result.residual", "&result.margin"]
    lines = [
        *nearest_summary(function),
        f"  {target.name}: {target.meaning} ({target.unit})",
        f"  q_seed: the start configuration, {n}",
        f"  weights: weight of each coordinate's displacement in the distance, {n}; 1 by default",
    ]
    call = f"result.slot = {derivation.robot.name}_{name}({', '.join(passed)});"
    return _function(lines, f"Nearest<{n}>", name, arguments, call)


def _comment(lines: Sequence[str]) -> str:
    return "/** " + "\n * ".join(lines) + " */"
