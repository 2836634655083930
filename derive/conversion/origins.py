"""Converts the joints of a serial robot to the URDF convention, with an origin for each joint."""

from dataclasses import replace
from typing import Any

import mpmath
import sympy as sp

from ..description.conventions import CONVENTIONS, urdf
from ..description.conventions.axis_lines import length
from ..description.conventions.fitted_poses import xyz_rpy_of
from ..description.pose_error import pose_in_digits
from ..model.convention import Convention
from ..model.errors import InputValueError
from ..model.placements import (
    Placement,
    Rotation,
    Translation,
    Vector,
    filled,
    from_xyz_rpy,
)
from ..model.robot import Joint, SerialRobot
from ..model.tolerances import EVALUATION_DIGITS, ZERO_COMPONENT
from .number_text import rounded

Origin = tuple[Vector, Vector]
"""The position (meter) of a frame, and its angles roll, pitch and yaw (radian)."""
_ZERO: Vector = (sp.S.Zero,) * 3


def is_described(joint: Joint) -> bool:
    """Whether a joint has convention fields that reproduce its placements exactly."""
    convention = joint.convention
    if convention not in CONVENTIONS or not joint.given:
        return False
    assert convention is not None
    return convention(joint.kind, **fields_of(joint, convention)) == (joint.before, joint.after)


def fields_of(joint: Joint, convention: Convention) -> dict[str, sp.Expr | Vector]:
    """Return the values of the convention fields of a joint."""
    values, fields = dict(joint.given), {}
    for field in convention.fields:
        parts = tuple(values[name] for name in field.components)
        fields[field.name] = field.value({field.name: parts if field.is_vector else parts[0]})
    return fields


def origin_of(placement: Placement) -> Origin | None:
    """Return the exact xyz and rpy of a placement with the form T Rz Ry Rx, otherwise None."""
    xyz, angles = _ZERO, dict.fromkeys("zyx", sp.S.Zero)
    order = ["", *angles]
    last = -1
    for motion in placement:
        place = order.index(motion.axis) if isinstance(motion, Rotation) else 0
        if place <= last:
            return None
        last = place
        if isinstance(motion, Translation):
            xyz = motion.vector
        else:
            angles[motion.axis] = motion.angle
    return xyz, (angles["x"], angles["y"], angles["z"])


def with_origins(robot: SerialRobot, *, keeps_links: bool = False) -> SerialRobot:
    """Return the robot with all joints in the convention `urdf`, without parameters.

    The axis of a URDF joint passes through the origin of its child link. If a link frame is not on
    the joint axis, the frame is moved to the axis.

    Args:
        robot: A serial robot.
        keeps_links: Whether every link frame must keep its pose.

    Raises:
        InputValueError: A link frame would move although ``keeps_links`` is True.
    """
    plain = with_values(robot)
    joints: list[Joint] = []
    pending: Placement = ()
    with mpmath.workdps(EVALUATION_DIGITS):
        for joint in plain.joints:
            if joint.convention is urdf and not pending and is_described(joint):
                joints.append(joint)
                continue
            found, pending = _at_its_link(joint, pending)
            if pending and keeps_links:
                raise InputValueError(
                    f"{robot.name}: a link frame would move to the joint axis, but masses are "
                    "positioned in link frames; state the convention of joint "
                    f"{joint.name!r}"
                )
            joints.append(found)
        base = from_xyz_rpy(*placed(plain.base))
        tool = from_xyz_rpy(*placed(pending + plain.tool))
    return replace(plain, joints=tuple(joints), base=base, tool=tool)


def with_values(robot: SerialRobot) -> SerialRobot:
    """Return the robot with its parameters replaced by their values."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return replace(
        robot,
        joints=tuple(_with_values(joint, values) for joint in robot.joints),
        base=filled(robot.base, values),
        tool=filled(robot.tool, values),
        parameters=(),
    )


def placed(placement: Placement) -> Origin:
    """Return the xyz and rpy values of a placement that contains only numbers."""
    exact = origin_of(placement)
    if exact is not None:
        return exact
    xyz, rpy = xyz_rpy_of(pose_in_digits(placement, {}))
    return _rounded(xyz), _rounded(rpy)


def _at_its_link(joint: Joint, pending: Placement) -> tuple[Joint, Placement]:
    """Return a joint with URDF fields, and the placement to insert before the next joint."""
    after = pose_in_digits(joint.after, {})
    rest: Placement = ()
    is_on_axis = mpmath.hypot(after[0, 3], after[1, 3]) <= ZERO_COMPONENT
    if joint.kind in ("fixed", "prismatic") or is_on_axis:
        origin = placed(pending + joint.before + joint.after)
        axis = _axis(after) if joint.kind != "fixed" else (sp.S.Zero, sp.S.Zero, sp.S.One)
    else:
        origin, rest = placed(pending + joint.before), joint.after
        axis = (sp.S.Zero, sp.S.Zero, sp.S.One)
    given = {"xyz": origin[0], "rpy": origin[1], "axis": axis}
    before, placed_after = urdf(joint.kind, **given)
    found = replace(
        joint,
        before=before,
        after=placed_after,
        convention=urdf,
        given=urdf.scalars(given),
        assumed=tuple(name for name in joint.assumed if name in ("limits", "pitch")),
    )
    return found, rest


def _axis(after: Any) -> Vector:
    x, y, z = (length(after[2, k]) for k in range(3))
    return _rounded((x, y, z))


def _rounded(vector: Vector) -> Vector:
    x, y, z = map(rounded, vector)
    return x, y, z


def _with_values(joint: Joint, values: dict[sp.Symbol, sp.Expr]) -> Joint:
    return replace(
        joint,
        before=filled(joint.before, values),
        after=filled(joint.after, values),
        pitch=joint.pitch.xreplace(values),
        given=tuple((name, value.xreplace(values)) for name, value in joint.given),
    )
