"""Geometry parameters of a robot: nominal values, and selection by name or group."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


def nominal(robot: Robot) -> FloatArray:
    """Return the (p,) geometry of the nominal robot [m, rad, 1]."""
    return np.array([parameter.value for parameter in robot.geometry])


FRAMES = frozenset({"base", "tool"})
"""Names of two parameter groups: corrections of the base frame and of the tool frame."""
GEOMETRY = "geometry"
"""Name of the group that contains all lengths, angles and offsets of a robot."""
_WHOLE = frozenset({"axis", "loop"})
"""Groups that "geometry" includes. The group "axis" contains offsets, and "loop" contains rod
lengths."""


def parts(robot: Robot, words: Collection[str]) -> set[str]:
    """Replace "geometry" by the groups that it includes.

    Args:
        robot: A robot with parametric functions.
        words: One or several names of parameters or groups.
    """
    given = {words} if isinstance(words, str) else set(words)
    if GEOMETRY not in given:
        return given
    return (given - {GEOMETRY}) | (_WHOLE & {item.part for item in robot.geometry})


def chosen(robot: Robot, words: Collection[str]) -> IntArray:
    """Return the indices of the parameters with these names or in these groups.

    Args:
        robot: A robot with parametric functions.
        words: One or several names of parameters or groups, or "geometry".

    Raises:
        InputValueError: A name is unknown.
    """
    words = parts(robot, words)
    known = {word for item in robot.geometry for word in (item.name, item.part)}
    if unknown := sorted(set(words) - known):
        raise InputValueError(f"identify: robot {robot.name} has no parameter {', '.join(unknown)}")
    found = [k for k, item in enumerate(robot.geometry) if {item.name, item.part} & set(words)]
    return np.array(found, dtype=np.intp)


def deviations(robot: Robot, parameter_std: Mapping[str, float]) -> FloatArray:
    """Return the (p,) standard deviation of each parameter, or 0 if none is stated.

    Args:
        robot: A robot with parametric functions.
        parameter_std: Standard deviations by name, group or unit. A name takes precedence over a
            group, and a group over a unit.

    Raises:
        InputValueError: A key is not a parameter, a group or a unit.
    """
    words = {word for item in robot.geometry for word in (item.name, item.part, item.unit)}
    if unknown := sorted(parameter_std.keys() - words):
        raise InputValueError(
            f"robot {robot.name} has no parameter, group or unit {', '.join(unknown)}; "
            "robot.geometry lists all"
        )
    return np.array(
        [
            next((parameter_std[w] for w in (g.name, g.part, g.unit) if w in parameter_std), 0.0)
            for g in robot.geometry
        ]
    )
