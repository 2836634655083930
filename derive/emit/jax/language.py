"""Writes the functions of a robot as a module of JAX."""

import textwrap
from importlib.metadata import version
from pathlib import Path

from ...derivation import Derivation
from ...program.programs import Programs
from ...terms.symbolic_function import SymbolicFunction
from ..c.header import description
from ..c_float.errors import Measurement
from ..c_float.language import with_error
from ..templates import filled
from .functions import WIDTH, definition

TEMPLATE = Path(__file__).parent / "support" / "module.py.in"


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Returns the module, keyed by name."""
    robot = derivation.robot
    printed = [f for f in derivation.functions if not (f.calls or f.role.is_intermediate)]
    values = {
        "title": robot.title.replace("\\", "/").replace('"', "'"),
        "version": version("chasles"),
        "missing": _missing(derivation),
        "coordinates": "\n".join(
            f"    q[{k}]  {joint.name} ({joint.kind}, {joint.unit})"
            for k, joint in enumerate(robot.coordinates)
        ),
    }
    measured = Measurement(derivation, programs)
    bodies = [_printed(f, programs, measured) for f in printed]
    return {f"{robot.name}_jax.py": "\n\n".join([filled(TEMPLATE, values).rstrip(), "", *bodies])}


def _printed(function: SymbolicFunction, programs: Programs, measured: Measurement) -> str:
    """Returns a function; its docstring states the errors of float32."""
    lines, count = description(function, programs), len(function.outputs)
    bounds = measured.errors(function).bounds
    described = [*lines[:-count], *map(with_error, lines[-count:], bounds)]
    return definition(function, described, programs.alone(function))


def _missing(derivation: Derivation) -> str:
    """Names the functions that the module lacks, or returns ""."""
    solved = [*(f for f in derivation.functions if f.calls), *derivation.written]
    names = ", ".join(f.name for f in solved if not f.role.is_intermediate)
    text = f"Only in C, because of an iterative solver: {names}." if names else ""
    return f"{textwrap.fill(text, WIDTH)}\n\n" if text else ""
