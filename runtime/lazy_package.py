"""Generated robot packages that load their robot at first use."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from .contract import read_manifest
from .robot import Robot


def lazy_package(namespace: dict[str, Any]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` (PEP 562) for the package whose `globals()` are given.

    The first access to an attribute loads the robot into the global variable `robot`. If necessary,
    the robot is compiled first. After loading, the robot's functions are globals of the module.
    Errors: see `chasles.load`.
    """
    module = namespace["__name__"]
    folder = Path(namespace["__file__"]).parent

    def get(name: str) -> Any:
        # Python looks up names such as __path__ on import. Such a lookup must not start the
        # compiler.
        if name.startswith("__"):
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        if "robot" not in namespace:
            robot = Robot(read_manifest(folder))
            namespace.update(robot.functions, robot=robot)
        return namespace[name] if name in namespace else getattr(namespace["robot"], name)

    def names() -> list[str]:
        return sorted([*(function.name for function in read_manifest(folder).functions), "robot"])

    return get, names
