"""The compiler: a robot's description becomes equations, LaTeX and C.

    >>> from chasles.derive import load, derive, write
    >>> robot = load("my_robot.toml")
    >>> write(robot, "generated/my_robot")

Names are imported when they are first used: asking whether anything is to be done needs no SymPy.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .casadi_file import casadi_function as casadi_function
    from .derivation import Derivation as Derivation
    from .derivation import derive as derive
    from .description import DescriptionError as DescriptionError
    from .description import load as load
    from .description import loads as loads
    from .errors import RobotError as RobotError
    from .generate import artifacts as artifacts
    from .generate import write as write
    from .inverse.explanation import Explanation as Explanation
    from .inverse.explanation import explain as explain
    from .kinematics import FUNCTIONS as FUNCTIONS
    from .mechanism import Closure as Closure
    from .mechanism import Drive as Drive
    from .mechanism import Mechanism as Mechanism
    from .mechanism import Place as Place
    from .mechanism import Strut as Strut
    from .poe import to_poe as to_poe
    from .robot import Joint as Joint
    from .robot import Mimic as Mimic
    from .robot import Parameter as Parameter
    from .robot import Robot as Robot
    from .robot import Rotation as Rotation
    from .robot import Translation as Translation
    from .urdf import from_urdf as from_urdf

NOT_INSTALLED = "the compiler is not installed: pip install 'chasles[derive]'"
_ROOMS = {
    "casadi_file": ("casadi_function",),
    "description": ("DescriptionError", "load", "loads"),
    "errors": ("RobotError",),
    "generate": ("artifacts", "write"),
    "mechanism": ("Closure", "Drive", "Mechanism", "Place", "Strut"),
    "poe": ("to_poe",),
    "robot": (
        "Joint",
        "Mimic",
        "Parameter",
        "Robot",
        "Rotation",
        "Translation",
    ),
    "derivation": ("Derivation", "derive"),
    "inverse.explanation": ("Explanation", "explain"),
    "kinematics": ("FUNCTIONS",),
    "urdf": ("from_urdf",),
}
_ROOM_OF = {name: room for room, names in _ROOMS.items() for name in names}
__all__ = [*_ROOM_OF]  # noqa: PLE0604


def __getattr__(name: str) -> object:
    if name not in _ROOM_OF:
        raise AttributeError(
            f"chasles.derive has no {name!r}; it has {', '.join(sorted(_ROOM_OF))}"
        )
    try:
        room = import_module(f".{_ROOM_OF[name]}", __name__)
    except ModuleNotFoundError as error:
        if error.name in ("sympy", "casadi", "lxml"):
            raise ImportError(f"{NOT_INSTALLED} ({error})") from error
        raise
    return getattr(room, name)


def __dir__() -> list[str]:
    return sorted(_ROOM_OF)
