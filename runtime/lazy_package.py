"""The lazy package of a generated robot, which loads the robot at first use."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from .contract import read_manifest
from .robot import Robot


def lazy_package(namespace: dict[str, Any]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Gives a module the attributes of the robot in its folder.

    The first access to an attribute loads the robot, and compiles it if necessary; the module also
    has the robot itself, as `robot`. After that the functions are plain globals of the module.
    It raises the errors of `chasles.load`.

    Args:
        namespace: The `globals()` of the generated package.

    Returns:
        The module's `__getattr__` and `__dir__` (PEP 562).
    """
    module = namespace["__name__"]
    folder = Path(namespace["__file__"]).parent

    def get(name: str) -> Any:
        # The import system looks up names such as __path__; they must not start the compiler.
        if name.startswith("__"):
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        if "robot" not in namespace:
            robot = Robot(read_manifest(folder))
            namespace.update(robot.functions, robot=robot)
        return namespace[name] if name in namespace else getattr(namespace["robot"], name)

    def names() -> list[str]:
        return sorted([*(function.name for function in read_manifest(folder).functions), "robot"])

    return get, names
