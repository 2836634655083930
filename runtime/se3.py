"""Poses and twists of SE(3) on NumPy arrays: conversions, exponential, interpolation, projection.

A pose is a matrix (4, 4) with a rotation R, a translation, and the last row 0 0 0 1. Twists are
(v, omega), linear part first. Lengths are in meters, angles in radians. Leading dimensions
broadcast, and NaN propagates. Every function raises `ShapeError` for a wrong shape.

Rounding to single precision or to printed digits makes R slightly non-orthogonal. The `deviation`
of R from a rotation is the Frobenius norm

    |R^T R - 1| / 8^0.5

To first order, the deviation is |R - U| / 2^0.5, where U is the rotation nearest to R. `project`
replaces R by U. Inverse kinematics projects poses with a deviation up to `NEARLY_RIGID`. The
functions of this module except `project` do not check whether a matrix is a pose.

Sources:
    R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, 1994,
    chapter 2.
    K. M. Lynch, F. C. Park, Modern Robotics, 2017, section 9.2.1, for the interpolation.
    N. J. Higham, Computing the polar decomposition - with applications, 1986.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from . import so3
from .arrays import FloatArray, real_array
from .call._call import NEARLY_RIGID, RIGID_TO_ROUNDING
from .errors import InputTypeError, InputValueError
from .so3 import ending, exponential, inverse_cubic, off_rotation
from .tolerances import NO_ROTATION

Order = Literal["wxyz", "xyzw"]

__all__ = [
    "NEARLY_RIGID",
    "adjoint",
    "deviation",
    "exp",
    "interpolate",
    "interpolate_straight",
    "inverse",
    "log",
    "pose",
    "project",
    "swap_twist_order",
    "to_quat",
    "to_rotation",
    "to_rotvec",
    "to_rpy",
    "to_xyz",
]

_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
_ORDERS = {"wxyz": [0, 1, 2, 3], "xyzw": [3, 0, 1, 2]}
"""Indices of w, x, y and z in a quaternion, by its element order."""
_UPRIGHT = 1e-12
"""Largest cosine of a pitch angle that counts as a right angle."""


def pose(
    xyz: ArrayLike | None = None,
    *,
    quat: ArrayLike | None = None,
    order: Order | None = None,
    rpy: ArrayLike | None = None,
    rotvec: ArrayLike | None = None,
    rotation: Any = None,
) -> FloatArray:
    """Return poses from positions and at most one kind of orientation.

    Args:
        xyz: (..., 3) position [m]; the origin if None.
        quat: (..., 4) quaternion of any norm except 0.
        order: Order of the elements of `quat`, "wxyz" or "xyzw". Required with `quat`.
        rpy: (..., 3) roll, pitch and yaw [rad] as in URDF, `R = Rz(yaw) Ry(pitch) Rx(roll)`.
        rotvec: (..., 3) rotation vector: unit axis times angle [rad].
        rotation: (..., 3, 3) rotation matrices, or a SciPy `Rotation`.

    Returns:
        (..., 4, 4) poses, with the broadcast leading dimensions of the arguments. Without an
        orientation, R is the identity.

    Raises:
        InputTypeError: Several orientations are passed, or `quat` is passed without `order`.
        InputValueError: A quaternion is 0, or the order is unknown.
    """
    given = {"quat": quat, "rpy": rpy, "rotvec": rotvec, "rotation": rotation}
    names = [name for name, value in given.items() if value is not None]
    if len(names) > 1:
        raise InputTypeError(f"se3.pose: expected one orientation, got {', '.join(names)}")
    p = ending((0.0, 0.0, 0.0) if xyz is None else xyz, (3,), "se3.pose", "xyz")
    if quat is not None:
        R = _of_quaternion(ending(quat, (4,), "se3.pose", "quat"), _order("se3.pose", order))
    elif rpy is not None:
        x, y, z = np.moveaxis(ending(rpy, (3,), "se3.pose", "rpy"), -1, 0)
        o = np.zeros_like(x)
        axes = ((o, o, z), (o, y, o), (x, o, o))
        yaw, pitch, roll = (so3.exp(np.stack(axis, -1)) for axis in axes)
        R = yaw @ pitch @ roll
    elif rotvec is not None:
        R = so3.exp(ending(rotvec, (3,), "se3.pose", "rotvec"))
    else:
        matrix = rotation.as_matrix() if hasattr(rotation, "as_matrix") else rotation
        R = ending(np.eye(3) if rotation is None else matrix, (3, 3), "se3.pose", "rotation")
    return _pose(R, p)


def to_xyz(T: ArrayLike) -> FloatArray:
    """Return the positions (..., 3) of poses (..., 4, 4), in the length unit of the poses."""
    return ending(T, (4, 4), "se3.to_xyz", "T")[..., :3, 3].copy()


def to_rotation(T: ArrayLike) -> FloatArray:
    """Return the rotation matrices (..., 3, 3) of poses (..., 4, 4)."""
    return ending(T, (4, 4), "se3.to_rotation", "T")[..., :3, :3].copy()


def to_rotvec(T: ArrayLike) -> FloatArray:
    """Return the rotation vectors (..., 3) [rad] of poses (..., 4, 4): axis times angle <= pi."""
    return so3.log(ending(T, (4, 4), "se3.to_rotvec", "T")[..., :3, :3])


def to_quat(T: ArrayLike, *, order: Order) -> FloatArray:
    """Return the unit quaternions (..., 4) of poses (..., 4, 4), with w >= 0.

    `order` is the order of the elements, "wxyz" or "xyzw". Another order raises `InputValueError`.
    """
    wanted = _order("se3.to_quat", order)
    omega = to_rotvec(T)
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    vector = omega * np.sinc(angle / (2 * np.pi)) / 2
    quat = np.concatenate([np.cos(angle / 2), vector], -1)
    return np.asarray(quat[..., np.argsort(wanted)])


def to_rpy(T: ArrayLike) -> FloatArray:
    """Return roll, pitch and yaw (..., 3) [rad] of poses (..., 4, 4) as in URDF.

    The rotation is R = Rz(yaw) Ry(pitch) Rx(roll), with the pitch in [-pi/2, pi/2]. At a pitch of
    +-pi/2, roll and yaw rotate about the same axis, so yaw is set to 0.
    """
    R = ending(T, (4, 4), "se3.to_rpy", "T")[..., :3, :3]
    level = np.hypot(R[..., 0, 0], R[..., 1, 0])
    is_upright = level < _UPRIGHT
    roll = np.where(
        is_upright, np.arctan2(-R[..., 1, 2], R[..., 1, 1]), np.arctan2(R[..., 2, 1], R[..., 2, 2])
    )
    yaw = np.where(is_upright, 0.0, np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    return np.stack([roll, np.arctan2(-R[..., 2, 0], level), yaw], -1)


def adjoint(T: ArrayLike) -> FloatArray:
    """Return the adjoint matrices (..., 6, 6) of poses (..., 4, 4).

    The adjoint of T_a_b maps twists (v, omega) from frame b to frame a: `V_a = adjoint(T_a_b) V_b`.
    Therefore `T exp(V) T^-1 = exp(adjoint(T) V)`.
    """
    poses = ending(T, (4, 4), "se3.adjoint", "T")
    R, p = poses[..., :3, :3], poses[..., None, :3, 3]
    A = np.zeros((*poses.shape[:-2], 6, 6))
    A[..., :3, :3] = A[..., 3:, 3:] = R
    # The block is hat(p) R, the cross product of p with each column of R.
    A[..., :3, 3:] = np.swapaxes(np.cross(p, np.swapaxes(R, -1, -2)), -1, -2)
    return A


def swap_twist_order(V: ArrayLike) -> FloatArray:
    """Convert twists (..., 6) from (v, omega) to (omega, v), or back.

    `swap_twist_order(J.mT).mT` converts a Jacobian J (..., 6, n) likewise.
    """
    return np.roll(ending(V, (6,), "se3.swap_twist_order", "V"), 3, -1)


def exp(twist: ArrayLike) -> FloatArray:
    """Return the exponentials (..., 4, 4) of twists (..., 6), (v, omega) with any angle.

    The exponential is the pose of a body, in its start frame, after one unit of time with this
    twist. The twist is expressed in the start frame as well.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    x = ending(twist, (6,), "se3.exp", "twist")
    v, omega = x[..., :3], x[..., 3:]
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    _, versine, cubic = exponential(angle)
    once = np.cross(omega, v)
    return _pose(so3.exp(omega), v + versine * once + cubic * np.cross(omega, once))


def log(T: ArrayLike) -> FloatArray:
    """Return the logarithms of poses (..., 4, 4): twists (v, omega) (..., 6), |omega| in [0, pi].

    `exp(log(T))` is T. For a rotation by pi, two twists with opposite axes are possible. `log`
    always returns the same twist for such a pose, but a small change of the pose may reverse the
    axis.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    poses = ending(T, (4, 4), "se3.log", "T")
    omega, p = so3.log(poses[..., :3, :3]), poses[..., :3, 3]
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    once = np.cross(omega, p)
    v = p - once / 2 + inverse_cubic(angle) * np.cross(omega, once)
    return np.concatenate([v, omega], -1)


def inverse(T: ArrayLike) -> FloatArray:
    """Return the inverses (..., 4, 4) of poses (..., 4, 4): `inverse(T_a_b) = T_b_a`."""
    poses = ending(T, (4, 4), "se3.inverse", "T")
    R = np.swapaxes(poses[..., :3, :3], -1, -2)
    return _pose(R, -(R @ poses[..., :3, 3:])[..., 0])


def interpolate(T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike) -> FloatArray:
    """Interpolate between poses by a screw motion, `T_a exp(s log(T_a^-1 T_b))`.

    The twist is constant in the base frame and in the body frame. The origin of the body frame
    moves on a helix. The motion of the body does not depend on the choice of the body frame. For a
    rotation by pi between the poses, two screw motions are possible, and `interpolate` returns one
    of them.

    Args:
        T_a: (..., 4, 4) pose of the body at s = 0.
        T_b: (..., 4, 4) pose of the body at s = 1, in the same frame as T_a.
        s: (...,) path parameter. Values outside [0, 1] extrapolate.

    Returns:
        (..., 4, 4) poses, with the broadcast leading dimensions of the arguments.

    Source: Lynch and Park, Modern Robotics, 2017, section 9.2.1.
    """
    start, end, part = _path(T_a, T_b, s, "se3.interpolate")
    return np.asarray(start @ exp(part[..., None] * log(inverse(start) @ end)))


def interpolate_straight(T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike) -> FloatArray:
    """Interpolate between poses so that the origin of the body moves on a straight line.

    The position is `p = (1 - s) p_a + s p_b`. The body rotates about a fixed direction at a
    constant rate: `R = R_a exp(s log(R_a^T R_b))`. If the orientations differ by pi, the body can
    rotate in two directions, and `interpolate_straight` selects one of them. Arguments and result
    are as for `interpolate`.

    Source: Lynch and Park, Modern Robotics, 2017, section 9.2.1.
    """
    start, end, part = _path(T_a, T_b, s, "se3.interpolate_straight")
    R_a, R_b = start[..., :3, :3], end[..., :3, :3]
    turn = so3.log(np.swapaxes(R_a, -1, -2) @ R_b)
    ahead = part[..., None] * (end[..., :3, 3] - start[..., :3, 3])
    return _pose(R_a @ so3.exp(part[..., None] * turn), start[..., :3, 3] + ahead)


def project(
    T: ArrayLike, tolerance: float = NEARLY_RIGID, *, caller: str = "se3.project", name: str = "T"
) -> FloatArray:
    """Return the rigid poses nearest to nearly rigid matrices.

    The 3 x 3 part R becomes the nearest rotation in the Frobenius norm, the orthogonal factor of
    its polar decomposition. The last row becomes 0 0 0 1, and the translation does not change.

    Args:
        T: (..., 4, 4) matrices: arrays of any real type, or nested lists.
        tolerance: Largest accepted `deviation` of a matrix from a pose [rad].
        caller: Function name for error messages.
        name: Argument name for error messages.

    Returns:
        (..., 4, 4) poses, float64. A matrix with a deviation of at most 1e-13 is returned
        unchanged. A matrix with a NaN or infinite entry is returned as NaN.

    Raises:
        InputValueError: The deviation of a matrix exceeds the tolerance, or the tolerance is not
            positive. The message states the index of the matrix and the reason.
        InputTypeError: T or the tolerance does not consist of real numbers.
    """
    if real_array(caller, "tolerance", tolerance).shape or not tolerance > 0:
        raise InputValueError(f"{caller}: tolerance must be a positive number, got {tolerance!r}")
    matrices = ending(T, (4, 4), caller, name)
    off = _deviation(matrices)
    _refuse(caller, matrices, off, tolerance, name)
    poses = np.array(matrices)  # a copy
    poses[np.isnan(off)] = np.nan
    rounded = off > RIGID_TO_ROUNDING
    U, _, V = np.linalg.svd(matrices[rounded][:, :3, :3])
    poses[rounded, :3, :3] = U @ V
    poses[rounded, 3] = _LAST_ROW
    return poses


def deviation(T: ArrayLike) -> FloatArray:
    """Return the deviations (...,) of matrices (..., 4, 4) from rigid poses.

    The deviation is the larger of two errors: the Frobenius norm |R^T R - I| / 8^0.5, and the
    largest error of an entry in the last row. If two axes of R differ from a right angle by a small
    angle, the deviation is half this angle [rad]. The deviation is infinite if det R <= 0, and NaN
    if an entry is NaN or infinite.

    Raises:
        InputTypeError: An entry is not a real number.
        ShapeError: The shape of T is not (..., 4, 4).
    """
    return _deviation(ending(T, (4, 4), "se3.deviation", "T"))[()]


def refuse(caller: str, T: FloatArray) -> None:
    """Raise an InputValueError if a matrix (..., 4, 4) is not nearly rigid; NaN is accepted."""
    _refuse(caller, T, _deviation(T), NEARLY_RIGID, "T")


def _order(caller: str, order: object) -> list[int]:
    if order is None:
        raise InputTypeError(f'{caller}: pass order="wxyz" or order="xyzw" with a quaternion')
    if order not in _ORDERS:
        raise InputValueError(f'{caller}: expected order "wxyz" or "xyzw", got {order!r}')
    return _ORDERS[order]


def _of_quaternion(quat: FloatArray, order: list[int]) -> FloatArray:
    length = np.sqrt(np.sum(quat * quat, -1, keepdims=True))
    if (length == 0).any():
        raise InputValueError("se3.pose: quat is 0, which is not an orientation")
    w, x, y, z = np.moveaxis(quat / length, -1, 0)[order]
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def _path(
    T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike, name: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    return (
        ending(T_a, (4, 4), name, "T_a"),
        ending(T_b, (4, 4), name, "T_b"),
        real_array(name, "s", s),
    )


def _pose(R: FloatArray, p: FloatArray) -> FloatArray:
    shape = np.broadcast_shapes(R.shape[:-2], p.shape[:-1])
    T = np.zeros((*shape, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    return T


def _deviation(matrices: FloatArray) -> FloatArray:
    rows = matrices.reshape(-1, 4, 4)
    off: FloatArray = np.maximum(
        off_rotation(rows[:, :3, :3]), np.abs(rows[:, 3] - _LAST_ROW).max(-1)
    )
    with np.errstate(invalid="ignore", over="ignore"):
        left_handed = np.linalg.det(rows[:, :3, :3]) <= 0
    off[left_handed] = np.inf
    off[~np.isfinite(rows).all((-2, -1))] = np.nan
    return np.asarray(off.reshape(matrices.shape[:-2]))


def _refuse(
    caller: str, matrices: FloatArray, off: FloatArray, tolerance: float, name: str
) -> None:
    bad = np.argwhere(off > tolerance)
    if not len(bad):
        return
    first = tuple(bad[0].tolist())
    where = f"{name}[{', '.join(map(str, first))}]" if first else name
    others = f"; {len(bad) - 1} more of {off.size} are not poses either" if len(bad) > 1 else ""
    raise InputValueError(f"{caller}: {where} is {_fault(matrices[first], tolerance)}{others}")


def _fault(T: FloatArray, tolerance: float) -> str:
    row, R = T[3], T[:3, :3]
    if np.abs(row - _LAST_ROW).max() > tolerance:
        if not T[:3, 3].any() and abs(row[3] - 1) <= tolerance:
            p = _numbers(row[:3])
            return f"transposed: the last row holds the translation {p}; pass T.swapaxes(-1, -2)"
        return f"no pose: its last row is {_numbers(row)}, not 0 0 0 1"
    lengths = np.linalg.norm(R, axis=0)
    shape = off_rotation((R / np.where(lengths > 0, lengths, 1.0))[None])[0]
    determinant = float(np.linalg.det(R))
    if determinant < 0 and shape <= NO_ROTATION:
        return (
            f"no rotation: determinant {determinant:.4g}, the axes are left-handed; one axis is "
            "reversed, or two axes are exchanged"
        )
    off = float(off_rotation(R[None])[0])
    if shape <= tolerance and off > NO_ROTATION:
        return f"no rotation: its axes have lengths {_numbers(lengths)}, not 1; normalize them"
    reason = f"no rotation: deviation {off:.2g} rad, above the rounding limit {tolerance:g}"
    if determinant <= 0 or off > NO_ROTATION:
        return f"{reason}; is it a rotation matrix, in rows and columns?"
    remedy = f"chasles.se3.project(T, tolerance={_above(off):g})"
    return f"{reason}; {remedy} returns the nearest rotation"


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.4g}" for value in values)


def _above(value: float) -> float:
    unit = 10.0 ** math.floor(math.log10(value))
    return float(f"{(math.floor(value / unit) + 1) * unit:.1g}")
