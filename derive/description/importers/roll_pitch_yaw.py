"""Computes roll, pitch and yaw of a rotation. The result is accurate near gimbal lock.

Let w, x, y, z be the unit quaternion of Rz(yaw) Ry(pitch) Rx(roll). Then w + y and x - z are the
cosine and the sine of (roll - yaw)/2, multiplied by cos(pitch/2) + sin(pitch/2). The numbers w - y
and x + z are the cosine and the sine of (roll + yaw)/2, multiplied by cos(pitch/2) - sin(pitch/2).
The angles are accurate because the formulas contain no square root of a small difference.
"""

from typing import Any

import mpmath as mp

from ...model.tolerances import GIMBAL_LOCK

Angles = tuple[mp.mpf, mp.mpf, mp.mpf]
"""Roll, pitch and yaw (radian). Roll and yaw are in (-pi, pi], and pitch is in [-pi/2, pi/2]."""


def of_quaternion(w: Any, x: Any, y: Any, z: Any) -> Angles:
    """Return the angles of a quaternion (w, x, y, z) of any length.

    At gimbal lock, only the sum or difference of roll and yaw is determined, and yaw is set to 0.
    """
    up, down = mp.hypot(w + y, x - z), mp.hypot(w - y, x + z)
    difference, total = 2 * mp.atan2(x - z, w + y), 2 * mp.atan2(x + z, w - y)
    least = GIMBAL_LOCK * (up + down)
    if down < least:
        return _wrapped(difference), mp.pi / 2, mp.mpf(0)
    if up < least:
        return _wrapped(total), -mp.pi / 2, mp.mpf(0)
    pitch = 2 * mp.atan2(up, down) - mp.pi / 2
    return _wrapped((total + difference) / 2), pitch, _wrapped((total - difference) / 2)


def of_matrix(pose: mp.matrix) -> Angles:
    """Return the angles of the upper-left 3x3 block of a matrix."""
    return of_quaternion(*_quaternion(pose))


def _quaternion(R: mp.matrix) -> list[mp.mpf]:
    """Return a quaternion that is not normalized.

    The longest of four equivalent quaternions is the most accurate.
    """
    xx, yy, zz = R[0, 0], R[1, 1], R[2, 2]
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    xy, yz, zx = R[1, 0] + R[0, 1], R[2, 1] + R[1, 2], R[0, 2] + R[2, 0]
    candidates = [
        [1 + xx + yy + zz, x, y, z],
        [x, 1 + xx - yy - zz, xy, zx],
        [y, xy, 1 - xx + yy - zz, yz],
        [z, zx, yz, 1 - xx - yy + zz],
    ]
    return max(candidates, key=lambda quaternion: float(mp.norm(mp.matrix(quaternion))))


def _wrapped(angle: mp.mpf) -> mp.mpf:
    return angle - 2 * mp.pi * mp.ceil(angle / (2 * mp.pi) - mp.mpf(1) / 2)
