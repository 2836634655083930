"""Closed-form robot kinematics, generated as C and called on NumPy arrays.

Examples:
    >>> robot = chasles.load("ur5e")
    >>> robot.fk(q)            # q (..., 6) [rad] -> T_0_ee (..., 4, 4)
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from . import se3, so3
from .call._call import Function, release_memory
from .call.hints import missing_attribute
from .call.threads import count_cores
from .closed_form.assembly_modes import AssemblyModes, PlanarAssemblyModes
from .closed_form.closures import ActuatorBranches, ChainBranches
from .closed_form.nearest_solution import NearestSolution
from .closed_form.paths import JointPath
from .closed_form.solutions import LeastSquares, Solutions
from .contract import ChaslesError, ManifestError, UnknownRobotError, read_manifest
from .errors import (
    CacheError,
    CompileError,
    CompilerNotFoundError,
    DerivationError,
    DescriptionError,
    InputError,
    InputTypeError,
    InputValueError,
    KernelError,
    LoopError,
    MismatchError,
    MissingFunctionError,
    NotInstalledError,
    OutOfReachError,
    ShapeError,
    SingularityError,
)
from .iterative.newton import LoopSolution
from .iterative.numeric_inverse import NumericSolution
from .library import find_folder, options_of, shelf, shipped_folders
from .robot import Robot
from .velocity.manipulability import Ellipsoid, Manipulability
from .velocity.rates import Accelerations, Rates
from .velocity.singular_directions import Determinants, SingularityDistance
from .velocity.singularity import Singularity
from .velocity.track import Track

__all__ = [
    "Accelerations",
    "ActuatorBranches",
    "AssemblyModes",
    "CacheError",
    "ChainBranches",
    "ChaslesError",
    "CompileError",
    "CompilerNotFoundError",
    "DerivationError",
    "DescriptionError",
    "Determinants",
    "Ellipsoid",
    "Function",
    "InputError",
    "InputTypeError",
    "InputValueError",
    "JointPath",
    "KernelError",
    "LeastSquares",
    "LoopError",
    "LoopSolution",
    "ManifestError",
    "Manipulability",
    "MismatchError",
    "MissingFunctionError",
    "NearestSolution",
    "NotInstalledError",
    "NumericSolution",
    "OutOfReachError",
    "PlanarAssemblyModes",
    "Rates",
    "Robot",
    "ShapeError",
    "Singularity",
    "SingularityDistance",
    "SingularityError",
    "Solutions",
    "Track",
    "UnknownRobotError",
    "animate",
    "count_cores",
    "draw",
    "load",
    "release_memory",
    "robots",
    "se3",
    "shelf_robots",
    "so3",
]

if TYPE_CHECKING:
    from .drawing import animate, draw


def robots() -> list[str]:
    """Return the names of all installed robots, from chasles and the package chasles-robots."""
    return list(shipped_folders())


def shelf_robots() -> list[str]:
    """Return the names of well-known arms that `load` derives on first use."""
    installed = shipped_folders()
    return [name for name in shelf() if name not in installed]


def load(
    robot: str | os.PathLike[str],
    *,
    base: str | None = None,
    tip: str | None = None,
    group: str | None = None,
    name: str | None = None,
    arguments: Sequence[str] = (),
    exact: bool = False,
    parametric: bool = False,
) -> Robot:
    """Load a robot from its name, its description file or its folder of generated code.

    The first use of an arm in `shelf_robots()`, or of a description file, derives and compiles the
    robot in seconds and caches it. This requires the packages of `pip install 'chasles[derive]'`,
    or `pip install 'chasles[derive,files]'` for xacro and MJCF files.

    Args:
        robot: A name in `robots()` or `shelf_robots()`, a description file (.toml, .urdf, .xacro,
            .xml (MJCF) or .sdf), or the folder of a generated robot. A folder is a path object, or
            a string with a path separator ("./mine").
        base: The base link. The default is the root of the link tree, or the base in a .toml file.
        tip: The tip link, anywhere in the tree. The default is the end of the longest chain.
        group: Name of a planning group that defines base and tip. The group is read from the SRDF
            file in the folder of the description file.
        name: A new name for the robot. The default is the name in the description file.
        arguments: Values for the arguments of a xacro file, each as "name:=value".
        exact: If True, rounded numbers such as 1.5708 are used as written in the file. If False,
            exact values such as pi/2 replace rounded numbers.
        parametric: Whether the robot also has the functions for calibration, such as `fk_p`, whose
            inputs include the geometry of the robot. These functions are derived on first use.

    Returns:
        The robot.

    Raises:
        UnknownRobotError: If no robot is found for the argument `robot`.
        DerivationError: If the compiler is not installed or rejects the description.
        ChaslesError: If the robot cannot be read, compiled or opened; the message states why.
    """
    options = options_of(exact, parametric, base=base, tip=tip, group=group, name=name)
    return Robot(read_manifest(find_folder(robot, (*arguments, *options))))


_IMPORTED_BY_NAME = ("autodiff", "calibration", "cuda", "derive", "generated", "study", "view")
"""Subpackages that `import chasles` does not import."""


def __dir__() -> list[str]:
    return sorted([*__all__, *_IMPORTED_BY_NAME, "errors", "__version__"])


def __getattr__(name: str) -> Any:
    """Load a name at its first use, which halves the import time."""
    if name in ("animate", "draw"):
        from . import drawing  # noqa: PLC0415

        return getattr(drawing, name)
    if name != "__version__":
        hint = f"; import chasles.{name}" if name in _IMPORTED_BY_NAME else ""
        raise AttributeError(missing_attribute("chasles", name, "module") + hint)
    from importlib.metadata import version  # noqa: PLC0415

    return version("chasles")
