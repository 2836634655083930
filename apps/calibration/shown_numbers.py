"""Numbers for people: units, and positions with roll, pitch and yaw of frames."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SHOWN = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "1": (1e3, "‰"), "m/rad": (1e3, "mm/rad")}
"""Factor and unit in which a number of a unit is shown to people."""


def roll_pitch_yaw(R: FloatArray) -> FloatArray:
    """Roll, pitch and yaw (3,) [rad] with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    yaw = math.atan2(R[1, 0], R[0, 0])
    # Where the x axis is vertical, roll and yaw are one turn: yaw is that which remains.
    c, s = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([roll, pitch, yaw])


def shown_numbers(T: FloatArray) -> tuple[str, ...]:
    """x, y, z [mm], roll, pitch and yaw [deg] of a pose (4, 4), in four decimals."""
    numbers = (*(1e3 * T[:3, 3]), *np.degrees(roll_pitch_yaw(T[:3, :3])))
    return tuple(f"{x:.4f}" for x in numbers)
