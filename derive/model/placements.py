"""Constant poses as products of motions, in exact numbers.

Lengths are in meters, angles in radians. Each motion is expressed in the frame that results from
the motions to its left. The matrix of a placement is therefore the product of the motion matrices
in the listed order.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import mpmath
import sympy as sp

from .errors import DescriptionError
from .exact import exact, exact_vector, is_zero
from .roots import angle_of, root
from .tolerances import AXIS_DIGITS, EVALUATION_DIGITS, ROUNDING, SHORT_PROPORTION

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
"""Three components along the x, y and z axes of a frame."""
_ORIGIN: Vector = (sp.S.Zero, sp.S.Zero, sp.S.Zero)


@dataclass(frozen=True)
class Rotation:
    """A rotation in a placement, by ``angle`` (radian) about an ``axis`` of the current frame.

    The current frame results from the preceding motions of the placement.
    """

    axis: Literal["x", "y", "z"]
    angle: sp.Expr

    def __post_init__(self) -> None:
        object.__setattr__(self, "angle", exact(self.angle))

    @property
    def is_identity(self) -> bool:
        """Whether the angle is zero."""
        return bool(self.angle == 0)

    @property
    def is_along_z(self) -> bool:
        """Whether the motion commutes with all motions about and along the z axis."""
        return self.axis == "z"

    def at(self, values: Mapping[sp.Symbol, sp.Expr]) -> "Rotation":
        """Return the rotation with its symbols replaced by values."""
        return Rotation(self.axis, self.angle.xreplace(values))


@dataclass(frozen=True)
class Translation:
    """A translation in a placement, by ``vector`` (meter) in the current frame.

    The current frame results from the preceding motions of the placement.
    """

    vector: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "vector", exact_vector(self.vector))

    @property
    def is_identity(self) -> bool:
        """Whether the vector is zero."""
        return self.vector == _ORIGIN

    @property
    def is_along_z(self) -> bool:
        """Whether the motion commutes with all motions about and along the z axis."""
        return self.vector[:2] == _ORIGIN[:2]

    def at(self, values: Mapping[sp.Symbol, sp.Expr]) -> "Translation":
        """Return the translation with its symbols replaced by values."""
        x, y, z = (component.xreplace(values) for component in self.vector)
        return Translation((x, y, z))


Placement = tuple[Rotation | Translation, ...]
"""A constant pose as a sequence of motions from left to right."""


def rotation(axis: Literal["x", "y", "z"], angle: sp.Expr) -> Placement:
    """Return the rotation about an axis (radian), or () if the angle is zero."""
    turn = Rotation(axis, angle)
    return () if turn.is_identity else (turn,)


def translation(x: sp.Expr, y: sp.Expr, z: sp.Expr) -> Placement:
    """Return a translation (meter), or () if the vector is zero."""
    shift = Translation((x, y, z))
    return () if shift.is_identity else (shift,)


def filled(placement: Placement, values: Mapping[sp.Symbol, sp.Expr]) -> Placement:
    """Return a placement in which symbols are replaced by values.

    Rotations by 0 and translations by 0 are removed.
    """
    motions = (motion.at(values) for motion in placement)
    return tuple(motion for motion in motions if not motion.is_identity)


def from_xyz_rpy(xyz: Vector, rpy: Vector) -> Placement:
    """Return the placement T(xyz) Rz(yaw) Ry(pitch) Rx(roll) of a URDF origin.

    Args:
        xyz: Position of the frame in its parent frame (meter).
        rpy: Roll, pitch and yaw (radian).
    """
    roll, pitch, yaw = exact_vector(rpy)
    return (
        translation(*exact_vector(xyz))
        + rotation("z", yaw)
        + rotation("y", pitch)
        + rotation("x", roll)
    )


def align_z(axis: Vector) -> Placement:
    """Return rotations Rz(azimuth) Rx(tilt) from the z axis to a direction of any length.

    If the components are rational but not proportional to small integers, angles other than
    multiples of 90 degrees are rounded to ``AXIS_DIGITS`` digits.

    Raises:
        DescriptionError: The direction is zero or contains a parameter.
    """
    x, y, z = axis = exact_vector(axis)
    if any(component.free_symbols for component in axis):
        raise DescriptionError("a joint's axis must be numerical, without parameters")
    if is_zero(x) and is_zero(y):
        if is_zero(z):
            raise DescriptionError("a joint's axis must not be the zero vector")
        return () if z > 0 else rotation("x", sp.pi)
    azimuth, tilt = _azimuth_and_tilt(axis)
    return rotation("z", azimuth) + rotation("x", tilt)


def _azimuth_and_tilt(axis: Vector) -> tuple[sp.Expr, sp.Expr]:
    """Return the angles of a direction that is not along z.

    The angles are exact if the components of the direction are proportional to small integers.
    """
    x, y, z = axis
    if not all(component.is_Rational for component in axis) or _is_short(axis):
        azimuth, tilt = angle_of(x, -y), angle_of(root(x**2 + y**2), z)
        return _twelfths(azimuth), _twelfths(tilt)
    with mpmath.workdps(EVALUATION_DIGITS):
        u, v, w = (mpmath.mpf(component.p) / component.q for component in axis)
        angles = mpmath.atan2(u, -v), mpmath.atan2(mpmath.hypot(u, v), w)
        decimals = [sp.Rational(mpmath.nstr(angle, AXIS_DIGITS)) for angle in angles]
    in_plane = sp.atan2(x, -y) if x == 0 or y == 0 else decimals[0]
    return in_plane, sp.pi / 2 if z == 0 else decimals[1]


def _is_short(axis: Vector) -> bool:
    """Whether the components of a direction are proportional to small integers."""
    x, y, z = axis
    whole = [component * sp.ilcm(x.q, y.q, z.q) for component in axis]
    return bool(max(map(abs, whole)) <= SHORT_PROPORTION * sp.igcd(*whole))


def _twelfths(angle: sp.Expr) -> sp.Expr:
    """Return an angle, exactly if it is a multiple of pi/12."""
    twelfths = (12 * angle / sp.pi).evalf(EVALUATION_DIGITS)
    nearest = sp.Integer(round(twelfths))
    return sp.pi * nearest / 12 if abs(twelfths - nearest) < ROUNDING else angle


def inverse(placement: Placement) -> Placement:
    """Return the inverse pose."""
    return tuple(
        Rotation(motion.axis, -motion.angle)
        if isinstance(motion, Rotation)
        else Translation((-motion.vector[0], -motion.vector[1], -motion.vector[2]))
        for motion in reversed(placement)
    )


def symbols_of(placement: Placement) -> set[sp.Symbol]:
    """Return the parameters in a placement."""
    found: set[sp.Symbol] = set()
    for motion in placement:
        values = (motion.angle,) if isinstance(motion, Rotation) else motion.vector
        found.update(*(value.free_symbols for value in values))
    return found
