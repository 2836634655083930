"""The compiler derives equations, LaTeX and C from a robot's description.

    >>> from chasles.derive import read, write
    >>> robot = read("my_robot.toml")
    >>> write(robot, "robots/my_robot")

Names are imported at their first use. The check for outdated robots therefore needs no SymPy.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING

from chasles.contract import requires

if TYPE_CHECKING:
    from .build.casadi_functions import casadi_function as casadi_function
    from .build.generate import files as files
    from .build.generate import write as write
    from .chain.poe import product_of_exponentials as product_of_exponentials
    from .checking import check as check
    from .conversion.conversions import Conversion as Conversion
    from .conversion.conversions import convert as convert
    from .derivation import Derivation as Derivation
    from .derivation import derive as derive
    from .description.checking import Finding as Finding
    from .description.conventions.suited import (
        with_suitable_conventions as with_suitable_conventions,
    )
    from .description.importers.ur_calibration import apply_calibration as apply_calibration
    from .description.robot_files import read as read
    from .description.robot_files import read_text as read_text
    from .description.templates import template as template
    from .inverse.explanation import Explanation as Explanation
    from .inverse.explanation import explain as explain
    from .loops.closing.mobility import Mobility as Mobility
    from .loops.closing.mobility import kutzbach as kutzbach
    from .loops.closing.mobility import mobility as mobility
    from .model.coupling import Coupling as Coupling
    from .model.coupling import Motor as Motor
    from .model.errors import ChaslesError as ChaslesError
    from .model.errors import DescriptionError as DescriptionError
    from .model.errors import LoopError as LoopError
    from .model.errors import NotInstalledError as NotInstalledError
    from .model.mechanism import Closure as Closure
    from .model.mechanism import Drive as Drive
    from .model.mechanism import Frame as Frame
    from .model.mechanism import Mechanism as Mechanism
    from .model.mechanism import Strut as Strut
    from .model.resting_springs import springs_at_rest as springs_at_rest
    from .model.robot import Joint as Joint
    from .model.robot import Parameter as Parameter
    from .model.robot import Rotation as Rotation
    from .model.robot import SerialRobot as SerialRobot
    from .model.robot import Translation as Translation
    from .quality.model_report import model_report as model_report
    from .quality.quality_report import ModelReport as ModelReport
    from .sympy_expressions import Expressions as Expressions
    from .sympy_expressions import expressions as expressions

# SymPy reads the size of its cache when it is imported. By default, this cache holds a thousand
# results, which is too few for a robot with loops. With the default cache, SymPy would rebuild
# equal expressions again and again.
os.environ.setdefault("SYMPY_CACHE_SIZE", "100000")

_ROOMS = {
    "build.casadi_functions": ("casadi_function",),
    "build.generate": (
        "files",
        "write",
    ),
    "chain.poe": ("product_of_exponentials",),
    "conversion.conversions": (
        "Conversion",
        "convert",
    ),
    "derivation": (
        "Derivation",
        "derive",
    ),
    "checking": ("check",),
    "description.checking": ("Finding",),
    "description.conventions.suited": ("with_suitable_conventions",),
    "description.importers.ur_calibration": ("apply_calibration",),
    "description.robot_files": (
        "read",
        "read_text",
    ),
    "description.templates": ("template",),
    "inverse.explanation": (
        "Explanation",
        "explain",
    ),
    "loops.closing.mobility": (
        "Mobility",
        "kutzbach",
        "mobility",
    ),
    "model.coupling": (
        "Coupling",
        "Motor",
    ),
    "model.errors": (
        "ChaslesError",
        "DescriptionError",
        "LoopError",
        "NotInstalledError",
    ),
    "model.mechanism": (
        "Closure",
        "Drive",
        "Frame",
        "Mechanism",
        "Strut",
    ),
    "model.resting_springs": ("springs_at_rest",),
    "model.robot": (
        "Joint",
        "Parameter",
        "Rotation",
        "SerialRobot",
        "Translation",
    ),
    "quality.model_report": ("model_report",),
    "quality.quality_report": ("ModelReport",),
    "sympy_expressions": (
        "Expressions",
        "expressions",
    ),
}
_ROOM_OF = {name: room for room, names in _ROOMS.items() for name in names}
__all__ = [*_ROOM_OF]  # noqa: PLE0604


def __getattr__(name: str) -> object:
    if name not in _ROOM_OF:
        raise AttributeError(
            f"chasles.derive has no name {name!r}; names: {', '.join(sorted(_ROOM_OF))}"
        )
    with requires("chasles[derive]"):
        room = import_module(f".{_ROOM_OF[name]}", __name__)
    return getattr(room, name)


def __dir__() -> list[str]:
    return sorted(_ROOM_OF)
