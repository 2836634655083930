"""Writes MATLAB and Octave functions, a Simulink S-function and a build script."""

from importlib.metadata import version
from pathlib import Path

from ...derivation import Derivation
from ...program.programs import Programs
from ..c import language as c
from ..templates import filled
from .table import functions, help_file, table

SUPPORT = Path(__file__).parent / "support"
SHARED = ("chasles_functions.h", "chasles_mex.h")
"""Files that are the same for every robot."""


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the files for MATLAB and Simulink, including the C source, keyed by path."""
    name, listed = derivation.robot.name, functions(derivation)
    values = {
        "robot": name,
        "ROBOT": name.upper(),
        "title": derivation.robot.title.replace("*/", "* /"),
        "version": version("chasles"),
        "count": str(len(listed)),
        "in_size": str(max(sum(a.size for a in f.inputs) for f in listed)),
        "out_size": str(max(sum(a.size for a in f.outputs) for f in listed)),
    }
    templates = {
        "README.md": "README.md",
        f"make_chasles_{name}.m": "make.m.in",
        f"src/chasles_{name}.c": "gateway.c.in",
        f"src/chasles_{name}_sfunction.c": "sfunction.c.in",
        **{f"src/{file}": file for file in SHARED},
    }
    in_c = c.files(derivation, programs)
    return {
        **{f"src/{file}": text for file, text in in_c.items() if "_batch." not in file},
        f"src/{name}_functions.h": table(derivation, listed),
        **{f"{name}_{f.name}.m": help_file(derivation, f) for f in listed},
        **{file: filled(SUPPORT / template, values) for file, template in templates.items()},
    }
