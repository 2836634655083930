"""Sliders with coordinates in degrees and millimeters."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import Robot

from ..drawing import skeleton

FloatArray = NDArray[np.float64]

_READ = {"rad": ("°", 180 / math.pi), "m": ("mm", 1000.0)}
"""Displayed unit and conversion factor for each SI unit."""
_UNLIMITED = {"rad": math.pi, "m": 0.5}
"""Half the range of a slider without limits [rad, or relative to the robot size]."""


@dataclass(frozen=True)
class SliderUnit:
    """Unit and scale of the slider for a coordinate.

    Attributes:
        name: Name of the coordinate.
        unit: Displayed unit, "°" or "mm".
        factor: Displayed units per rad or m.
        lower: Lower end of the slider [rad or m].
        upper: Upper end of the slider [rad or m].
        limited: Whether both ends of the slider are limits of the coordinate.
    """

    name: str
    unit: str
    factor: float
    lower: float
    upper: float
    limited: bool

    @property
    def label(self) -> str:
        """The name with the displayed unit."""
        return f"{self.name} [{self.unit}]"


def slider_units(robot: Robot, start: FloatArray) -> tuple[SliderUnit, ...]:
    """Return the sliders of a robot's coordinates, in the order of q.

    Args:
        robot: The robot.
        start: (n,) initial coordinates [rad or m]. If a limit is missing, the slider ends half a
            turn, or half the robot size, away from the initial coordinate.
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
