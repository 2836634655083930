"""Geometry parameters of a robot: nominal values, and selection by name or group."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

from ..study.arguments import number

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


def nominal(robot: Robot) -> FloatArray:
    """Return the nominal values (p,) of the geometry parameters of a robot [m, rad, 1]."""
    return np.array([parameter.value for parameter in robot.geometry])


FRAMES = frozenset({"base", "tool"})
"""Names of two parameter groups: corrections of the base frame and of the tool frame."""
GEOMETRY = "geometry"
"""Name of the group that contains all lengths, angles and offsets of a robot."""
_WHOLE = frozenset({"axis", "loop"})
"""Parameter groups that the name "geometry" includes. The group "axis" contains tilts and shifts of
the joint axes, which can reproduce joint offsets. The group "loop" contains rod lengths."""


def parts(robot: Robot, words: Collection[str]) -> set[str]:
    """Return the given names, with "geometry" replaced by the parameter groups that it includes.

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
        InputValueError: A name is neither a parameter nor a group of the robot.
    """
    words = parts(robot, words)
    known = {word for item in robot.geometry for word in (item.name, item.part)}
    if unknown := sorted(set(words) - known):
        raise InputValueError(f"identify: robot {robot.name} has no parameter {', '.join(unknown)}")
    found = [k for k, item in enumerate(robot.geometry) if {item.name, item.part} & set(words)]
    return np.array(found, dtype=np.intp)


def deviations(robot: Robot, parameter_std: Mapping[str, float]) -> FloatArray:
    """Return the standard deviation of each parameter (p,), or 0 for an unspecified one.

    Args:
        robot: A robot with parametric functions.
        parameter_std: Standard deviations, keyed by parameter name, group or unit. A parameter name
            takes precedence over a group, and a group over a unit.

    Raises:
        InputValueError: A key of `parameter_std` is not the name, group or unit of a parameter, or
            a standard deviation is negative or not finite.
    """
    words = {word for item in robot.geometry for word in (item.name, item.part, item.unit)}
    if unknown := sorted(parameter_std.keys() - words):
        raise InputValueError(
            f"robot {robot.name}: unknown parameter, group or unit {', '.join(unknown)}; "
            "see robot.geometry"
        )
    for key, std in parameter_std.items():
        if not 0 <= number(f"parameter_std: {key}", std) < np.inf:
            raise InputValueError(
                f"parameter_std: {key}: expected a finite value of at least 0, got {std:g}"
            )
    return np.array(
        [
            next((parameter_std[w] for w in (g.name, g.part, g.unit) if w in parameter_std), 0.0)
            for g in robot.geometry
        ]
    )
