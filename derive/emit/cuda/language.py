"""Writes CUDA C++ functions, kernels and an example."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

from ...derivation import Derivation
from ...model.tolerances import REGULAR, SOLVED_SINGLE
from ...program.programs import Programs
from ...terms.symbolic_function import SymbolicFunction
from ..c.expressions import WIDTH
from ..c.header import description, notice
from ..c_float import language as c_float
from ..c_float.functions import number
from ..precision.errors import SAMPLES, Measurement, with_errors
from ..printed import coordinate_lines, example_inverse, missing_functions, printed_functions
from ..reserved import safe
from ..seeds import missing_nearest, nearest_summary, printed_nearest
from ..templates import filled
from .functions import PRECISIONS, Nearest, device_function, kernel, renamed

SUPPORT = Path(__file__).parent / "support"
COMMON = "chasles_cuda.cuh"
"""Support file that all robots share."""
CONVENTIONS = f"""\
Meters, radians, seconds. Matrices are row-major. Twists are (v, omega), linear first.

NAME_kernel<float> and NAME_kernel<double> compute `poses` poses, one per thread, in blocks of at
most CHASLES_THREADS threads. Entry k of pose i is at [k * poses + i] of an array, so that threads
access adjacent numbers. NAME computes one pose in a thread of another kernel; a plain array is a
column. A slot of an inverse is a solution if its residual is at most precision<Real>::solved. An
output may overwrite an input of the same pose.

Errors: of single precision, twice the largest difference from double precision at {SAMPLES} random
inputs. For an inverse, only solutions count whose Jacobian has a smallest singular value above
{REGULAR}. For a robot with loops, only inputs count whose margins are above {REGULAR}.""".split(
    "\n"
)
"""Conventions and error definitions, as lines of the comment at the top of the generated CUDA
header."""


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the CUDA header, the support files, the README and the example, keyed by file name."""
    name = derivation.robot.name
    printed = printed_functions(derivation)
    absent = (missing_functions(derivation), missing_nearest(derivation, printed))
    missing = " ".join(filter(None, absent))
    values = {"robot": name, "title": derivation.robot.title, "missing": missing}
    found = {
        f"{name}.cuh": _header(derivation, programs, printed, missing),
        COMMON: (SUPPORT / COMMON).read_text(encoding="utf-8"),
        c_float.COMMON: (c_float.SUPPORT / c_float.COMMON).read_text(encoding="utf-8"),
        "README.md": f"{filled(SUPPORT / 'README.md', values).rstrip()}\n",
    }
    return found | _example(derivation, printed, values)


def _header(
    derivation: Derivation, programs: Programs, printed: Sequence[SymbolicFunction], absent: str
) -> str:
    robot, measured = derivation.robot, Measurement(derivation, programs)
    guard = f"CHASLES_ROBOT_{robot.name.upper()}_CUH"
    parts = [_printed(f, programs, measured) for f in printed]
    parts += [
        _nearest(Nearest(derivation, inverse, inputs))
        for inverse, inputs in printed_nearest(derivation, printed)
    ]
    missing = textwrap.wrap(absent, WIDTH - 3)
    lines = [*CONVENTIONS, *(["", *missing] if missing else []), "", *coordinate_lines(derivation)]
    body = "\n".join(parts)
    return f"""\
{notice(robot)}
{_comment(lines)}
#ifndef {guard}
#define {guard}

#define CHASLES_SOLVED_SINGLE {number(SOLVED_SINGLE)}
#include "{COMMON}"

namespace chasles
{{
namespace {safe(robot.name)}
{{

{body}
}} // namespace {safe(robot.name)}
}} // namespace chasles

#endif
"""


def _comment(lines: Sequence[str]) -> str:
    text = "\n".join(f" * {line}".rstrip() for line in lines).removeprefix(" * ")
    return f"/* {text}\n */" if len(lines) > 1 else f"/* {text} */"


def _printed(function: SymbolicFunction, programs: Programs, measured: Measurement) -> str:
    own, program = renamed(function), programs.whole[function.name]
    lines = with_errors(function, description(own, programs), measured.errors(function))
    definitions = [device_function(own, program, precision) for precision in PRECISIONS]
    return "\n".join([_comment(lines), *definitions, kernel(own)])


def _nearest(nearest: Nearest) -> str:
    described = [
        *nearest_summary(nearest.inverse),
        "Its slot, or -1 if out of reach, -2 if outside the limits, -3 if T or q_seed is NaN.",
        "lower, upper and weights have a number per coordinate, the same for all poses. NULL means",
        "the limits of the robot, and the weights 1.",
    ]
    device_functions = map(nearest.device_function, PRECISIONS)
    return "\n".join([_comment(described), *device_functions, nearest.kernel()])


def _example(
    derivation: Derivation, printed: Sequence[SymbolicFunction], values: dict[str, str]
) -> dict[str, str]:
    inverse = example_inverse(derivation, printed)
    if inverse is None or not any(function.name == "fk" for function in printed):
        return {}
    inputs = ["T", *(f"q + {k} * poses" for k in inverse.role.fixed)]
    values |= {
        "namespace": safe(derivation.robot.name),
        "inverse": inverse.name,
        "inputs": ", ".join(inputs),
        "n": str(len(derivation.robot.coordinates)),
        "slots": str(inverse.branches),
    }
    return {"example.cu": filled(SUPPORT / "example.cu.in", values)}
