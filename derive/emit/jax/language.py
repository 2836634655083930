"""Writes the functions of a robot as a JAX module."""

import textwrap
from importlib.metadata import version
from pathlib import Path

from ...derivation import Derivation
from ...program.programs import Programs
from ...terms.symbolic_function import SymbolicFunction
from ..c.header import description
from ..precision.errors import Measurement, with_errors
from ..printed import coordinate_lines, missing_functions, printed_functions
from ..templates import filled
from .functions import WIDTH, definition

TEMPLATE = Path(__file__).parent / "support" / "module.py.in"


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the files of the JAX module, keyed by name."""
    robot = derivation.robot
    printed = printed_functions(derivation)
    missing = missing_functions(derivation)
    values = {
        "title": robot.title.replace("\\", "/").replace('"', "'"),
        "version": version("chasles"),
        "missing": f"{textwrap.fill(missing, WIDTH)}\n\n" if missing else "",
        "coordinates": textwrap.indent("\n".join(coordinate_lines(derivation)), "  "),
    }
    measured = Measurement(derivation, programs)
    bodies = [_printed(f, programs, measured) for f in printed]
    return {f"{robot.name}_jax.py": "\n\n".join([filled(TEMPLATE, values).rstrip(), "", *bodies])}


def _printed(function: SymbolicFunction, programs: Programs, measured: Measurement) -> str:
    errors = measured.errors(function)
    described = with_errors(function, description(function, programs), errors)
    return definition(function, described, programs.alone(function))
