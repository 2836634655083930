"""Modelling conventions: each turns named parameters into the same joint placements.

Every convention is one function from its parameters to ``(before, after)`` (see
:mod:`chasles.derive.model.robot`): the joint turns about the z axis between the two, or slides
along it.

| name      | link transform, the joint's variable in brackets    | source                       |
|-----------|-----------------------------------------------------|------------------------------|
| `dh`      | Rz([theta]) Tz([d]) Tx(a) Rx(alpha)                 | Denavit, Hartenberg 1955     |
| `mdh`     | Rx(alpha) Tx(a) Rz([theta]) Tz([d])                 | Craig; Khalil, Kleinfinger   |
| `hayati`  | Rz([theta]) Tx(a) Rx(alpha) Ry(beta)                | Hayati, Mirmirani 1985       |
| `mdh5`    | T(a, b, c) Rx(alpha) Rz([theta])                    | well manipulator, (6)        |
| `hayati5` | Tx(a) Rx(alpha) Ry(beta) Tz([d]) Rz([theta])        | well manipulator, (8)        |
| `s_model` | Rz([theta]) Ry(beta) Rx(alpha) T(x, y, [z])         | photographic robot, (2)      |
| `poe`     | exp([q] screw of axis through point)                | Brockett 1984                |
| `urdf`    | T(xyz) Rz(yaw) Ry(pitch) Rx(roll), then about `axis` | URDF joint origins          |
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import sympy as sp

from ..model.errors import RobotError
from ..model.exact import exact_vector, is_zero
from ..model.robot import JointKind, Placement, Rotation, Translation

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
Placements = tuple[Placement, Placement]
FieldKind = Literal["length", "angle", "lengths", "angles", "direction"]

ZERO = sp.Integer(0)
ORIGIN: Vector = (ZERO, ZERO, ZERO)


def rotation(axis: Literal["x", "y", "z"], angle: sp.Expr) -> Placement:
    """An elementary rotation, or nothing where the angle is zero."""
    turn = Rotation(axis, angle)
    return () if turn.angle == 0 else (turn,)


def translation(x: sp.Expr, y: sp.Expr, z: sp.Expr) -> Placement:
    """An elementary translation, or nothing where the vector is zero."""
    shift = Translation((x, y, z))
    return () if shift.vector == ORIGIN else (shift,)


def dh(kind: JointKind, *, a: sp.Expr, alpha: sp.Expr, d: sp.Expr, theta: sp.Expr) -> Placements:
    """Distal Denavit-Hartenberg: Rz(theta) Tz(d) Tx(a) Rx(alpha), frame i at the far end."""
    return (
        rotation("z", theta) + translation(ZERO, ZERO, d),
        translation(a, ZERO, ZERO) + rotation("x", alpha),
    )


def mdh(kind: JointKind, *, a: sp.Expr, alpha: sp.Expr, d: sp.Expr, theta: sp.Expr) -> Placements:
    """Proximal (modified, Craig's) Denavit-Hartenberg: Rx(alpha) Tx(a) Rz(theta) Tz(d)."""
    before = rotation("x", alpha) + translation(a, ZERO, ZERO)
    return before + rotation("z", theta) + translation(ZERO, ZERO, d), ()


def hayati(
    kind: JointKind, *, a: sp.Expr, alpha: sp.Expr, beta: sp.Expr, theta: sp.Expr
) -> Placements:
    """Hayati and Mirmirani for near-parallel axes: Rz(theta) Tx(a) Rx(alpha) Ry(beta)."""
    after = translation(a, ZERO, ZERO) + rotation("x", alpha) + rotation("y", beta)
    return rotation("z", theta), after


def mdh5(
    kind: JointKind, *, a: sp.Expr, b: sp.Expr, c: sp.Expr, alpha: sp.Expr, theta: sp.Expr
) -> Placements:
    """Five parameters, axes not parallel: T(a, b, c) Rx(alpha) Rz(theta); well manipulator, (6)."""
    return translation(a, b, c) + rotation("x", alpha) + rotation("z", theta), ()


def hayati5(
    kind: JointKind, *, a: sp.Expr, alpha: sp.Expr, beta: sp.Expr, d: sp.Expr, theta: sp.Expr
) -> Placements:
    """Five parameters, parallel axes: Tx(a) Rx(alpha) Ry(beta) Tz(d) Rz(theta); the same, (8)."""
    before = translation(a, ZERO, ZERO) + rotation("x", alpha) + rotation("y", beta)
    return before + translation(ZERO, ZERO, d) + rotation("z", theta), ()


def s_model(
    kind: JointKind,
    *,
    theta: sp.Expr,
    beta: sp.Expr,
    alpha: sp.Expr,
    x: sp.Expr,
    y: sp.Expr,
    z: sp.Expr,
) -> Placements:
    """Six parameters: Rz(theta) Ry(beta) Rx(alpha) T(x, y, z); photographic robot, (2).

    A revolute joint turns by theta, the first motion; a prismatic one slides by z, the last.
    """
    rest = rotation("y", beta) + rotation("x", alpha) + translation(x, y, z)
    if kind == "prismatic":
        return rotation("z", theta) + rest, ()
    return rotation("z", theta), rest


def poe(kind: JointKind, *, axis: Vector, point: Vector) -> Placements:
    """Product of exponentials: the screw along ``axis`` through ``point``.

    Both are given in the previous link's frame at zero, which for a chain of `poe` joints alone is
    the base frame: every link frame coincides with it at zero.
    """
    z_to_axis, to_point = align_z(axis), translation(*exact_vector(point))
    return to_point + z_to_axis, inverse(z_to_axis) + inverse(to_point)


def urdf(kind: JointKind, *, xyz: Vector, rpy: Vector, axis: Vector) -> Placements:
    """URDF: origin T(xyz) Rz(yaw) Ry(pitch) Rx(roll), then motion about ``axis`` of that frame."""
    roll, pitch, yaw = exact_vector(rpy)
    origin = (
        translation(*exact_vector(xyz))
        + rotation("z", yaw)
        + rotation("y", pitch)
        + rotation("x", roll)
    )
    if kind == "fixed":
        return origin, ()
    z_to_axis = align_z(axis)
    return origin + z_to_axis, inverse(z_to_axis)


@dataclass(frozen=True)
class Convention:
    """A convention: its function, and the fields of a joint that it reads, with their kind."""

    place: Callable[..., Placements]
    fields: Mapping[str, FieldKind]


_DH: dict[str, FieldKind] = {"a": "length", "alpha": "angle", "d": "length", "theta": "angle"}
CONVENTIONS: dict[str, Convention] = {
    "dh": Convention(dh, _DH),
    "mdh": Convention(mdh, _DH),
    "hayati": Convention(
        hayati, {"a": "length", "alpha": "angle", "beta": "angle", "theta": "angle"}
    ),
    "mdh5": Convention(
        mdh5, {"a": "length", "b": "length", "c": "length", "alpha": "angle", "theta": "angle"}
    ),
    "hayati5": Convention(
        hayati5,
        {"a": "length", "alpha": "angle", "beta": "angle", "d": "length", "theta": "angle"},
    ),
    "s_model": Convention(
        s_model,
        {
            "theta": "angle",
            "beta": "angle",
            "alpha": "angle",
            "x": "length",
            "y": "length",
            "z": "length",
        },
    ),
    "poe": Convention(poe, {"axis": "direction", "point": "lengths"}),
    "urdf": Convention(urdf, {"xyz": "lengths", "rpy": "angles", "axis": "direction"}),
}


def align_z(axis: Vector) -> Placement:
    """Rotations Rz(azimuth) Rx(tilt) that carry the z axis onto a direction of any length.

    Raises:
        RobotError: The direction is zero, or not made of numbers alone.
    """
    x, y, z = axis = exact_vector(axis)
    if any(component.free_symbols for component in axis):
        raise RobotError("a joint's axis must be made of numbers, without parameters")
    if is_zero(x) and is_zero(y):
        if is_zero(z):
            raise RobotError("a joint's axis must not be the zero vector")
        return () if z > 0 else rotation("x", sp.pi)
    tilt = sp.atan2(sp.sqrt(x**2 + y**2), z)
    return rotation("z", sp.atan2(x, -y)) + rotation("x", tilt)


def inverse(placement: Placement) -> Placement:
    """The inverse pose, motion by motion."""
    return tuple(
        Rotation(motion.axis, -motion.angle)
        if isinstance(motion, Rotation)
        else Translation((-motion.vector[0], -motion.vector[1], -motion.vector[2]))
        for motion in reversed(placement)
    )
