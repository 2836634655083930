"""Wrong units are found before they are fitted: the nominal robot fits far better in other ones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputValueError
from .observations import Observation

FloatArray = NDArray[np.float64]

DOUBTFUL = 0.05
"""Error of the nominal robot, in parts of the spread of its tool, from which on units are tried."""
BETTER = 10.0
"""Factor by which the error falls in the right units."""
_LENGTHS = {
    "positions are in millimetres": 1e-3,
    "positions are in metres, not in millimetres": 1e3,
}
_ANGLES = {
    "joint angles are in degrees": math.pi / 180,
    "joint angles are in radians, not in degrees": 180 / math.pi,
}


def check_units(
    robot: Any, q: FloatArray, p: FloatArray, observation: Observation, stated: float
) -> None:
    """Raises where measurements fit the nominal robot only in other units.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        p: Its nominal geometry.
        observation: The measurements.
        stated: Their misfit in the units that were stated.

    Raises:
        InputValueError: They fit ten times better in other units, which the message names.
    """
    T = robot.fk_p(q, p)
    spread = float(np.linalg.norm(T[:, :3, 3].std(0)))
    if stated <= DOUBTFUL * spread:
        return
    turning = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    tried = {words: observation.scaled(k).start(T).misfit / k for words, k in _LENGTHS.items()}
    for words, k in _ANGLES.items():
        tried[words] = observation.start(robot.fk_p(np.where(turning, k * q, q), p)).misfit
    words = min(tried, key=lambda name: tried[name])
    if BETTER * tried[words] < stated:
        raise InputValueError(
            f"identify: the measurements miss the nominal robot by {stated:.3g} m; they fit "
            f"{stated / tried[words]:.0f} times better if {words}. Correct the units"
        )
