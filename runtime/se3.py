"""Poses and twists of SE(3) on NumPy arrays: conversions, exponential, interpolation, projection.

A pose is a matrix (4, 4) with a rotation R, a translation, and the last row 0 0 0 1. Twists are
(v, omega), linear part first. `exp` of a twist is the pose of a body that has moved with it for one
unit of time, pose and twist expressed in the frame of the start. Lengths are in metres, angles in
radians. Leading dimensions broadcast, and NaN propagates.

Single precision and printed digits move R off the rotations. Its distance from them is

    |R^T R - 1| / 8^0.5,   to first order |R - U| / 2^0.5 with U the nearest rotation

in the Frobenius norm. `project` finds U, inverses project poses that are off by at most
`NEARLY_RIGID`, and the other functions do not check a matrix.

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
from numpy.typing import ArrayLike, NDArray

from . import so3
from .call._call import NEARLY_RIGID, RIGID_TO_ROUNDING
from .call.validation import real_array
from .errors import InputTypeError, InputValueError, ShapeError
from .so3 import ending, exponential, inverse_cubic, off_rotation
from .tolerances import NO_ROTATION

FloatArray = NDArray[np.float64]
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
"""From the order of a quaternion to (w, x, y, z)."""
_UPRIGHT = 1e-12
"""Cosine of a pitch that counts as a right angle."""


def pose(
    xyz: ArrayLike | None = None,
    *,
    quat: ArrayLike | None = None,
    order: Order | None = None,
    rpy: ArrayLike | None = None,
    rotvec: ArrayLike | None = None,
    rotation: Any = None,
) -> FloatArray:
    """The pose with a position and at most one orientation.

    Args:
        xyz: (..., 3) position [m]; the origin if None.
        quat: (..., 4) quaternion of any length.
        order: Order of its elements, "wxyz" or "xyzw"; mandatory, because libraries disagree.
        rpy: (..., 3) roll, pitch and yaw as in URDF, `R = Rz(yaw) Ry(pitch) Rx(roll)`.
        rotvec: (..., 3) axis times angle.
        rotation: (..., 3, 3) rotation matrices, or a SciPy `Rotation`.

    Returns:
        (..., 4, 4) poses, of the broadcast dimensions.

    Raises:
        InputTypeError: If there are several orientations, or a quaternion without its order.
        InputValueError: If a quaternion is 0, or the order unknown.
        ShapeError: If a shape is wrong.
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
    """The positions (..., 3) of poses (..., 4, 4)."""
    return ending(T, (4, 4), "se3.to_xyz", "T")[..., :3, 3].copy()


def to_rotation(T: ArrayLike) -> FloatArray:
    """The rotation matrices (..., 3, 3) of poses (..., 4, 4)."""
    return ending(T, (4, 4), "se3.to_rotation", "T")[..., :3, :3].copy()


def to_rotvec(T: ArrayLike) -> FloatArray:
    """The rotation vectors (..., 3) of poses (..., 4, 4), with angles in [0, pi]."""
    return so3.log(ending(T, (4, 4), "se3.to_rotvec", "T")[..., :3, :3])


def to_quat(T: ArrayLike, *, order: Order) -> FloatArray:
    """The unit quaternions of poses, with w >= 0.

    Args:
        T: (..., 4, 4) poses.
        order: Order of the elements, "wxyz" or "xyzw".

    Returns:
        (..., 4) quaternions.

    Raises:
        InputValueError: If the order is unknown.
        ShapeError: If the last dimensions are not (4, 4).
    """
    wanted = _order("se3.to_quat", order)
    omega = to_rotvec(T)
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    vector = omega * np.sinc(angle / (2 * np.pi)) / 2
    quat = np.concatenate([np.cos(angle / 2), vector], -1)
    return np.asarray(quat[..., np.argsort(wanted)])


def to_rpy(T: ArrayLike) -> FloatArray:
    """Roll, pitch and yaw of poses as in URDF, `R = Rz(yaw) Ry(pitch) Rx(roll)`.

    At a pitch of a right angle, roll and yaw turn about the same axis; yaw is then 0.

    Args:
        T: (..., 4, 4) poses.

    Returns:
        (..., 3) angles [rad], pitch in [-pi/2, pi/2].

    Raises:
        ShapeError: If the last dimensions are not (4, 4).
    """
    R = ending(T, (4, 4), "se3.to_rpy", "T")[..., :3, :3]
    level = np.hypot(R[..., 0, 0], R[..., 1, 0])
    is_upright = level < _UPRIGHT
    roll = np.where(
        is_upright,
        np.arctan2(-R[..., 1, 2], R[..., 1, 1]),
        np.arctan2(R[..., 2, 1], R[..., 2, 2]),
    )
    yaw = np.where(is_upright, 0.0, np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    return np.stack([roll, np.arctan2(-R[..., 2, 0], level), yaw], -1)


def adjoint(T: ArrayLike) -> FloatArray:
    """The matrix that expresses twists in another frame: `V_a = Ad V_b` for T_a_b.

    Args:
        T: (..., 4, 4) poses.

    Returns:
        (..., 6, 6) matrices for twists (v, omega); `T exp(V) T^-1 = exp(adjoint(T) V)`.

    Raises:
        ShapeError: If the last dimensions are not (4, 4).
    """
    poses = ending(T, (4, 4), "se3.adjoint", "T")
    R, p = poses[..., :3, :3], poses[..., None, :3, 3]
    A = np.zeros((*poses.shape[:-2], 6, 6))
    A[..., :3, :3] = A[..., 3:, 3:] = R
    # The columns of hat(p) R.
    A[..., :3, 3:] = np.swapaxes(np.cross(p, np.swapaxes(R, -1, -2)), -1, -2)
    return A


def swap_twist_order(V: ArrayLike) -> FloatArray:
    """Twists (..., 6) in the order (omega, v), from (v, omega), and back.

    For Jacobians: `swap_twist_order(J.mT).mT`.
    """
    return np.roll(ending(V, (6,), "se3.swap_twist_order", "V"), 3, -1)


def exp(twist: ArrayLike) -> FloatArray:
    """The pose that a twist leads to.

    Args:
        twist: (..., 6) (v, omega), of any angle.

    Returns:
        (..., 4, 4) pose; `exp(log(T)) = T`.

    Raises:
        ShapeError: If the last dimension is not 6.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    x = ending(twist, (6,), "se3.exp", "twist")
    v, omega = x[..., :3], x[..., 3:]
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    _, versine, cubic = exponential(angle)
    once = np.cross(omega, v)
    return _pose(so3.exp(omega), v + versine * once + cubic * np.cross(omega, once))


def log(T: ArrayLike) -> FloatArray:
    """The twist that leads to a pose, along the shorter way round.

    At a half turn two twists with opposite axes lead there. The result is one of them, always the
    same for the same pose, but near a half turn a small change of the pose may exchange them.

    Args:
        T: (..., 4, 4) poses.

    Returns:
        (..., 6) twist (v, omega) with |omega| in [0, pi]; `exp(log(T)) = T`.

    Raises:
        ShapeError: If the last dimensions are not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    poses = ending(T, (4, 4), "se3.log", "T")
    omega, p = so3.log(poses[..., :3, :3]), poses[..., :3, 3]
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    once = np.cross(omega, p)
    v = p - once / 2 + inverse_cubic(angle) * np.cross(omega, once)
    return np.concatenate([v, omega], -1)


def inverse(T: ArrayLike) -> FloatArray:
    """The inverse of a pose: `inverse(T_a_b) = T_b_a`.

    Args:
        T: (..., 4, 4) poses.

    Returns:
        (..., 4, 4) poses.

    Raises:
        ShapeError: If the last dimensions are not (4, 4).
    """
    poses = ending(T, (4, 4), "se3.inverse", "T")
    R = np.swapaxes(poses[..., :3, :3], -1, -2)
    return _pose(R, -(R @ poses[..., :3, 3:])[..., 0])


def interpolate(T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike) -> FloatArray:
    """The screw motion from one pose to another, `T_a exp(s log(T_a^-1 T_b))`.

    Its twist is constant, in the base frame and in the body's frame; the origin moves on a helix.
    The motion does not depend on the position of the frame on the body. For a half turn it is one
    of two motions.

    Args:
        T_a: (..., 4, 4) where s = 0.
        T_b: (..., 4, 4) where s = 1.
        s: (...,) parameter of the motion; below 0 and above 1 the motion continues.

    Returns:
        (..., 4, 4) poses, of the broadcast dimensions: many s between two poses give a path.

    Raises:
        ShapeError: If the last dimensions of a pose are not (4, 4).

    Source: Lynch and Park, section 9.2.1.
    """
    start, end, part = _path(T_a, T_b, s, "se3.interpolate")
    return np.asarray(start @ exp(part[..., None] * log(inverse(start) @ end)))


def interpolate_straight(T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike) -> FloatArray:
    """The motion from one pose to another with the origin on a straight line.

    `p = (1 - s) p_a + s p_b` and `R = R_a exp(s log(R_a^T R_b))`: the origin moves at a constant
    velocity, the body turns about one axis, of constant direction, at a constant rate. For a half
    turn it is one of two motions.

    Args:
        T_a: (..., 4, 4) where s = 0.
        T_b: (..., 4, 4) where s = 1.
        s: (...,) parameter of the motion; below 0 and above 1 the motion continues.

    Returns:
        (..., 4, 4) poses, of the broadcast dimensions: many s between two poses give a path.

    Raises:
        ShapeError: If the last dimensions of a pose are not (4, 4).

    Source: Lynch and Park, section 9.2.1.
    """
    start, end, part = _path(T_a, T_b, s, "se3.interpolate_straight")
    R_a, R_b = start[..., :3, :3], end[..., :3, :3]
    turn = so3.log(np.swapaxes(R_a, -1, -2) @ R_b)
    ahead = part[..., None] * (end[..., :3, 3] - start[..., :3, 3])
    return _pose(R_a @ so3.exp(part[..., None] * turn), start[..., :3, 3] + ahead)


def project(
    T: ArrayLike,
    tolerance: float = NEARLY_RIGID,
    *,
    caller: str = "se3.project",
    name: str = "T",
) -> FloatArray:
    """The rigid poses nearest to matrices that are nearly rigid.

    R becomes the nearest rotation in the Frobenius norm, the orthogonal factor of its polar
    decomposition; the translation stays, and the last row becomes 0 0 0 1.

    Args:
        T: (..., 4, 4) matrices: arrays of any real type, or nested lists.
        tolerance: Largest `deviation` that is accepted [rad].
        caller: The function that was called, for errors.
        name: Its argument, for errors.

    Returns:
        (..., 4, 4) poses, float64: T itself where it is rigid to rounding (1e-13), NaN where a
        matrix is not finite.

    Raises:
        InputValueError: If a matrix is further off, with its index and the reason; or if the
            tolerance is not positive.
        InputTypeError: If T is not made of real numbers.
        ShapeError: If its last dimensions are not (4, 4).
    """
    if not tolerance > 0:
        raise InputValueError(f"{caller}: tolerance must be positive, got {tolerance!r}")
    matrices = _matrices(caller, T, name)
    off = _deviation(matrices)
    _refuse(caller, matrices, off, tolerance, name)
    # A copy: the caller's array stays as it is.
    poses = np.array(matrices)
    poses[np.isnan(off)] = np.nan
    rounded = off > RIGID_TO_ROUNDING
    U, _, V = np.linalg.svd(matrices[rounded][:, :3, :3])
    poses[rounded, :3, :3] = U @ V
    poses[rounded, 3] = _LAST_ROW
    return poses


def deviation(T: ArrayLike) -> FloatArray:
    """How far matrices are from rigid poses.

    Args:
        T: (..., 4, 4) matrices.

    Returns:
        (...,) the larger of |R^T R - 1| / 8^0.5 [rad] and the largest error of the last row;
        infinite where the axes are not right-handed, NaN where a matrix is not finite.

    Raises:
        InputTypeError: If T is not made of real numbers.
        ShapeError: If its last dimensions are not (4, 4).
    """
    return _deviation(_matrices("se3.deviation", T, "T"))[()]


def refuse(caller: str, T: FloatArray) -> None:
    """Raises the error for poses that are not nearly rigid; NaN passes.

    Args:
        caller: Robot and function, for the error.
        T: (..., 4, 4) matrices.

    Raises:
        InputValueError: If one is not nearly rigid, with its index and the reason.
    """
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
        raise InputValueError("se3.pose: quat is 0, which is no orientation")
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
    """Both ends and the parameter, as arrays."""
    return (
        ending(T_a, (4, 4), name, "T_a"),
        ending(T_b, (4, 4), name, "T_b"),
        np.asarray(s, np.float64),
    )


def _pose(R: FloatArray, p: FloatArray) -> FloatArray:
    shape = np.broadcast_shapes(R.shape[:-2], p.shape[:-1])
    T = np.zeros((*shape, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    return T


def _matrices(caller: str, T: ArrayLike, name: str) -> FloatArray:
    matrices = real_array(caller, name, T)
    if matrices.shape[-2:] != (4, 4):
        raise ShapeError(
            f"{caller}: {name} must have shape (..., 4, 4), got shape {matrices.shape}"
        )
    return matrices


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
    others = f"; {len(bad) - 1} more of {off.size} are no poses either" if len(bad) > 1 else ""
    raise InputValueError(f"{caller}: {where} is {_fault(matrices[first], tolerance)}{others}")


def _fault(T: FloatArray, tolerance: float) -> str:
    """What is wrong with a finite matrix that is no pose, and what to do."""
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
            f"no rotation: determinant {determinant:.4g}, the axes are left-handed; one of them "
            "points the wrong way, or two are exchanged"
        )
    off = float(off_rotation(R[None])[0])
    if shape <= tolerance and off > NO_ROTATION:
        return f"no rotation: its axes have the lengths {_numbers(lengths)}, not 1; divide by them"
    reason = f"no rotation: off by {off:.2g} rad, and up to {tolerance:g} passes as rounding"
    if determinant <= 0 or off > NO_ROTATION:
        return f"{reason}; is it a rotation matrix, in rows and columns?"
    return f"{reason}; chasles.se3.project(T, tolerance={_above(off):g}) takes the nearest rotation"


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.4g}" for value in values)


def _above(value: float) -> float:
    """The next number above with one digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return float(f"{(math.floor(value / unit) + 1) * unit:.1g}")
