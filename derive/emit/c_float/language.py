"""Writes the functions of a robot as C in single precision."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

from ...derivation import Derivation
from ...model.robot import SerialRobot
from ...model.tolerances import REGULAR, SOLVED_SINGLE
from ...program.programs import Programs
from ...terms.symbolic_function import SymbolicFunction
from ..c.expressions import WIDTH
from ..c.header import description, notice
from ..precision.errors import SAMPLES, Errors, Measurement, with_errors
from ..precision.single import single, stack_bytes
from ..printed import coordinate_lines, missing_functions, printed_functions
from ..templates import filled
from .functions import definition, number, signature

SUPPORT = Path(__file__).parent / "support"
COMMON = "chasles_float.h"
"""Support file that all robots share."""


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the source files, the example and the README, keyed by path."""
    name = derivation.robot.name
    printed = printed_functions(derivation)
    prefix = f"{name}_float"
    sources = [definition(prefix, f, single(programs.whole[f.name])) for f in printed]
    included = f'#include "{prefix}.h"\n\n#include "{COMMON}"\n'
    return {
        f"{prefix}.c": "\n".join([notice(derivation.robot), included, *sources]),
        f"{prefix}.h": _header(derivation, programs, printed),
        COMMON: (SUPPORT / COMMON).read_text(encoding="utf-8"),
        **_example(derivation, printed),
    }


def _header(derivation: Derivation, programs: Programs, printed: Sequence[SymbolicFunction]) -> str:
    robot, measured = derivation.robot, Measurement(derivation, programs)
    prefix = f"{robot.name}_float"
    upper = prefix.upper()
    declared = [_declaration(prefix, f, programs, measured.errors(f)) for f in printed]
    lines = [*_conventions(upper), *_missing(derivation), "", *coordinate_lines(derivation)]
    comment = "\n".join(f" * {line}".rstrip() for line in lines).removeprefix(" * ")
    body = "\n\n".join(declared)
    return f"""\
{notice(robot)}
/* {comment}
 */
#ifndef CHASLES_ROBOT_{upper}_H
#define CHASLES_ROBOT_{upper}_H

#ifdef __cplusplus
extern "C" {{
#endif

#define {upper}_N {len(robot.coordinates)} /* coordinates */
#define {upper}_SOLVED {number(SOLVED_SINGLE)} /* largest residual of a solution */

{body}

#ifdef __cplusplus
}}
#endif

#endif
"""


def _conventions(upper: str) -> list[str]:
    text = f"""\
Meters, radians, seconds. Matrices are dense and row-major. Twists are (v, omega), linear first.
No function allocates memory, has state, fails or computes in double precision. The functions call
sqrtf and atan2f, and sinf and cosf for large angles; {COMMON} states how to replace
them. An output may overwrite an input.
A slot of an inverse is a solution if its residual is at most {upper}_SOLVED.

Errors: twice the largest difference from double precision at {SAMPLES} random inputs. Inputs are
rounded too. For an inverse, only solutions count whose Jacobian has a smallest singular value above
{REGULAR}. For a robot with loops, only inputs count whose margins are above {REGULAR}.
Stack: bound of a function's frame for a compiler that optimizes, without the called functions."""
    return text.split("\n")


def _missing(derivation: Derivation) -> list[str]:
    text = missing_functions(derivation, "double precision")
    return ["", *textwrap.wrap(text, WIDTH - 3)] if text else []


def _declaration(
    prefix: str, function: SymbolicFunction, programs: Programs, errors: Errors
) -> str:
    lines = with_errors(function, description(function, programs), errors)
    if errors.solutions:
        found = errors.solutions - errors.missed
        lines.append(f"Finds {found} of the {errors.solutions} solutions of the random inputs.")
    lines.append(f"Stack: {stack_bytes(single(programs.whole[function.name]))} bytes.")
    comment = "\n * ".join(lines)
    return f"/* {comment} */\n{signature(prefix, function)};"


def _example(derivation: Derivation, printed: Sequence[SymbolicFunction]) -> dict[str, str]:
    name = derivation.robot.name
    inverse = next((f for f in printed if _is_followed(derivation, f)), None)
    values = {"robot": name, "upper": f"{name}_float".upper(), "title": derivation.robot.title}
    found = {"README.md": filled(SUPPORT / "README.md", values)}
    if inverse is not None:
        target, joints = inverse.inputs[0], inverse.role.fixed
        values |= {
            "inverse": inverse.name,
            "target": f"const float {target.name}[{target.size}]",
            "inputs": ", ".join([target.name, *(f"&q[{k}]" for k in joints)]),
            "slots": str(inverse.branches),
        }
        return found | {"control_step.c": filled(SUPPORT / "nearest_step.c.in", values)}
    if any(function.name == "fk" for function in printed):
        return found | {"control_step.c": filled(SUPPORT / "forward_step.c.in", values)}
    return found


def _is_followed(derivation: Derivation, function: SymbolicFunction) -> bool:
    others = {argument.name for argument in function.inputs[1:]}
    robot, computed = derivation.robot, {f.name for f in derivation.functions}
    has_joints = isinstance(robot, SerialRobot) and not robot.couplings
    return function.role.is_inverse and (not others or (has_joints and not others & computed))
