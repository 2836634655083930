"""The numbers of a robot's geometry as a vector, and the words by which they are chosen."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


def nominal(robot: Robot) -> FloatArray:
    """(p,) the geometry of the nominal robot [m, rad, 1]."""
    return np.array([parameter.value for parameter in robot.geometry])


FRAMES = frozenset({"base", "tool"})
"""The parts that no design places: corrections of the frames around the robot."""
GEOMETRY = "geometry"
"""All lengths, angles and offsets that a robot of this structure may have."""
_WHOLE = frozenset({"axis", "loop"})
"""The parts that hold them: axes have offsets, too, and pins the lengths of rods."""


def parts(robot: Robot, words: Collection[str]) -> set[str]:
    """Words with the parts that "geometry" means for a robot in its place.

    Args:
        robot: A robot with parametric functions.
        words: Names of parameters, parts of the model, or one of these.
    """
    given = {words} if isinstance(words, str) else set(words)
    if GEOMETRY not in given:
        return given
    return (given - {GEOMETRY}) | (_WHOLE & {item.part for item in robot.geometry})


def chosen(robot: Robot, words: Collection[str]) -> IntArray:
    """Indices of the parameters with some names or of some parts.

    Args:
        robot: A robot with parametric functions.
        words: Names of parameters, parts of the model, "geometry", or one of these.

    Raises:
        InputValueError: A word is none of them.
    """
    words = parts(robot, words)
    known = {word for item in robot.geometry for word in (item.name, item.part)}
    if unknown := sorted(set(words) - known):
        raise InputValueError(f"identify: {robot.name} has no parameter {', '.join(unknown)}")
    found = [k for k, item in enumerate(robot.geometry) if {item.name, item.part} & set(words)]
    return np.array(found, dtype=np.intp)


def deviations(robot: Robot, parameter_std: Mapping[str, float]) -> FloatArray:
    """(p,) standard deviation of each parameter; 0 of those without a tolerance.

    Args:
        robot: A robot with parametric functions.
        parameter_std: Standard deviations by name, part or unit; a name takes precedence over a
            part, and a part over a unit.

    Raises:
        InputValueError: A name is neither a parameter, a part nor a unit.
    """
    words = {word for item in robot.geometry for word in (item.name, item.part, item.unit)}
    if unknown := sorted(parameter_std.keys() - words):
        raise InputValueError(
            f"{robot.name} has no parameter, part or unit {', '.join(unknown)}; robot.geometry "
            "lists them"
        )
    return np.array(
        [
            next((parameter_std[w] for w in (g.name, g.part, g.unit) if w in parameter_std), 0.0)
            for g in robot.geometry
        ]
    )
