"""Conversion between rotations and unit quaternions (w, x, y, z)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chasles import so3

FloatArray = NDArray[np.float64]


def rotations(quaternions: FloatArray) -> FloatArray:
    """Return the rotations (N, 3, 3) of quaternions (N, 4) of any nonzero length."""
    w, vector = quaternions[:, 0], quaternions[:, 1:]
    sine = np.linalg.norm(vector, axis=-1)
    angle = 2 * np.arctan2(sine, w)
    # The variable `sine` is |quaternion| sin(angle / 2). If `sine` is 0, the rotation vector is 0.
    per_sine = np.divide(angle, sine, out=np.zeros_like(angle), where=sine > 0)
    return so3.exp(vector * per_sine[:, None])


def quaternions(R: FloatArray) -> FloatArray:
    """Return the unit quaternions (N, 4) of rotations (N, 3, 3), with w >= 0."""
    turned = so3.log(R)
    angle = np.linalg.norm(turned, axis=-1)
    scale = np.divide(np.sin(angle / 2), angle, out=np.full_like(angle, 0.5), where=angle > 0)
    return np.concatenate([np.cos(angle / 2)[:, None], turned * scale[:, None]], -1)
