"""Coordinates in the units that people read: degrees and millimetres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import Robot

from ..drawing import skeleton

FloatArray = NDArray[np.float64]

_READ = {"rad": ("°", 180 / math.pi), "m": ("mm", 1000.0)}
"""The unit that people read for each unit of the interfaces, and its number in that unit."""
_UNLIMITED = {"rad": math.pi, "m": 0.5}
"""What a slider without limits covers to both sides of its start [rad, parts of the robot's
size]."""


@dataclass(frozen=True)
class SliderUnit:
    """A coordinate on a slider.

    Attributes:
        name: The coordinate.
        unit: The unit that people read, "°" or "mm".
        factor: The number of these units in one of the interface (rad or m).
        lower: The slider's lower end [rad or m].
        upper: Its upper end [rad or m].
        limited: Whether the ends are limits of the robot on both sides.
    """

    name: str
    unit: str
    factor: float
    lower: float
    upper: float
    limited: bool

    @property
    def label(self) -> str:
        """Its name with the unit."""
        return f"{self.name} [{self.unit}]"


def slider_units(robot: Robot, start: FloatArray) -> tuple[SliderUnit, ...]:
    """The sliders of a robot's coordinates, in the order of q.

    Args:
        robot: The robot.
        start: (n,) coordinates at which the view starts [rad or m]. Where a limit is absent, the
            slider covers half a turn, or half the robot's size, from there.
    """
    found, length = [], skeleton(robot).size
    for k, coordinate in enumerate(robot.coordinates):
        unit, factor = _READ[coordinate.unit]
        size = length if coordinate.unit == "m" else 1.0
        reach = _UNLIMITED[coordinate.unit] * size
        low, high = float(robot.lower[k]), float(robot.upper[k])
        limited = math.isfinite(low) and math.isfinite(high)
        low = low if math.isfinite(low) else min(start[k], high) - reach
        high = high if math.isfinite(high) else max(start[k], low) + reach
        found.append(SliderUnit(coordinate.name, unit, factor, low, high, limited))
    return tuple(found)
