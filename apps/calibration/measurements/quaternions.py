"""Orientations as quaternions (w, x, y, z) of unit length, as devices write them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chasles import so3

FloatArray = NDArray[np.float64]


def rotations(quaternions: FloatArray) -> FloatArray:
    """(N, 3, 3) the rotations by quaternions (N, 4) of any length but 0."""
    w, vector = quaternions[:, 0], quaternions[:, 1:]
    sine = np.linalg.norm(vector, axis=-1)
    angle = 2 * np.arctan2(sine, w)
    # The sine of half the angle times the length; where it is 0, so is the vector.
    return so3.exp(vector * _over(angle, sine)[:, None])


def quaternions(R: FloatArray) -> FloatArray:
    """(N, 4) the unit quaternions of rotations (N, 3, 3), w not negative."""
    turned = so3.log(R)
    angle = np.linalg.norm(turned, axis=-1)
    scale = np.divide(np.sin(angle / 2), angle, out=np.full_like(angle, 0.5), where=angle > 0)
    return np.concatenate([np.cos(angle / 2)[:, None], turned * scale[:, None]], -1)


def _over(angle: FloatArray, sine: FloatArray) -> FloatArray:
    return np.divide(angle, sine, out=np.zeros_like(angle), where=sine > 0)
