"""Writes a CMake package with the generated C, its C++17 header and a control loop."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from ...derivation import Derivation
from ...program.programs import Programs
from ...terms.symbolic_function import Signature
from ..c import language as c
from ..printed import example_start
from ..reserved import safe
from ..seeds import seeded
from ..templates import filled
from .header import header

SUPPORT = Path(__file__).parent / "support"
_AMPLITUDE = 0.05
"""Amplitude of the example's motion (radian, meter)."""


def files(derivation: Derivation, programs: Programs) -> dict[str, str]:
    """Return the files of the CMake package, keyed by path."""
    name = derivation.robot.name
    in_c = c.files(derivation, programs)
    public = {f"{name}.h", f"{name}_batch.h"}
    folders = {file: "include/chasles" if file in public else "src" for file in in_c}
    example = "nearest_loop.cpp.in" if _nearest_of_pose(derivation) else "forward_loop.cpp.in"
    templates = {
        "CMakeLists.txt": "CMakeLists.txt",
        f"chasles_{name}.pc.in": "package.pc.in",
        "README.md": "README.md",
        "include/chasles/kinematics.hpp": "kinematics.hpp",
        "include/chasles/eigen.hpp": "eigen.hpp",
        "examples/control_loop.cpp": example,
    }
    values = _values(derivation, [f"src/{file}" for file in in_c if file.endswith(".c")])
    return {
        **{f"{folders[file]}/{file}": text for file, text in in_c.items()},
        f"include/chasles/{name}.hpp": header(derivation, programs),
        **{file: filled(SUPPORT / template, values) for file, template in templates.items()},
    }


def _values(derivation: Derivation, sources: Sequence[str]) -> dict[str, str]:
    nearest, start = _nearest_of_pose(derivation), example_start(derivation, _AMPLITUDE)
    fixed = nearest.role.fixed if nearest else ()
    moved = next((k for k in range(len(start)) if k not in fixed), 0)
    return {
        "robot": derivation.robot.name,
        "namespace": safe(derivation.robot.name),
        "title": derivation.robot.title,
        "version": version("chasles"),
        "sources": " ".join(sources),
        "start": ", ".join(map(repr, start)),
        "moved": str(moved),
        "middle": repr(start[moved]),
        "amplitude": repr(_AMPLITUDE),
    }


def _nearest_of_pose(derivation: Derivation) -> Signature | None:
    return next((f for f in seeded(derivation) if f.role.domain == "pose"), None)
