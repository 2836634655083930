"""Format values for reports: display units, and poses as positions with roll, pitch and yaw."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SHOWN = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "1": (1e3, "‰"), "m/rad": (1e3, "mm/rad")}
"""Display factor and display unit for each SI unit."""


def roll_pitch_yaw(R: FloatArray) -> FloatArray:
    """Return roll, pitch and yaw (3,) [rad] with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    yaw = math.atan2(R[1, 0], R[0, 0])
    # If the x axis is vertical, only the sum or difference of roll and yaw is determined.
    c, s = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([roll, pitch, yaw])


def shown_numbers(T: FloatArray) -> tuple[str, ...]:
    """Return x, y, z [mm] and roll, pitch, yaw [deg] of a pose (4, 4)."""
    numbers = (*(1e3 * T[:3, 3]), *np.degrees(roll_pitch_yaw(T[:3, :3])))
    return tuple(f"{x:.4f}" for x in numbers)
