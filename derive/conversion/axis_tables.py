"""Converts a serial robot to a table of Denavit-Hartenberg parameters or screw axes.

Axis 0 is the z axis of the base frame, and the last axis is the z axis of the tool frame. A step is
the constant transform from an axis to the next axis. The tool pose is the product of all steps and
joint motions, and of a last rotation and translation along the tool axis:

    T_0_ee = step_0 motion_1 step_1 ... motion_n step_n rest.

A step from an axis to the next axis is a product of four motions:

    step = Rz(turn) Tz(shift) Tx(a) Rx(alpha).

Row k of a modified (Craig) table contains a and alpha of step k-1, and turn and shift of step k.
Row k of a standard table contains turn, shift, a and alpha of step k. The poses of base and tool
contain the motions that do not fit into the table rows.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mpmath
import sympy as sp

from ..description.conventions import dh, poe
from ..description.conventions.axis_lines import angle, common_normal, length
from ..description.conventions.fitted_poses import along_z, axis_line, home_pose, xyz_rpy_of
from ..description.conventions.neighbours import Neighbours, neighbours
from ..description.pose_error import pose_in_digits
from ..model.convention import AxisLine, Convention
from ..model.errors import InputValueError
from ..model.placements import Placement, Vector, from_xyz_rpy, rotation, translation
from ..model.robot import Joint, SerialRobot
from ..model.tolerances import EVALUATION_DIGITS
from .number_text import digits_for, rounded

_RIGHT = math.pi / 2 + 1e-9
"""Maximum rotation (radian) from the x axis to the common normal. If the rotation exceeds a right
angle, the opposite direction of the normal is used."""


@dataclass(frozen=True)
class AxisStep:
    """The motion Rz(turn) Tz(shift) Tx(a) Rx(alpha) from one axis to the next."""

    turn: sp.Expr
    shift: sp.Expr
    a: sp.Expr
    alpha: sp.Expr

    @property
    def along(self) -> Placement:
        """Return the rotation about, and the translation along, the first axis of the step."""
        return along_z(self.turn, self.shift)

    @property
    def across(self) -> Placement:
        """Return the translation along the common normal and the rotation about this normal."""
        return translation(self.a, sp.S.Zero, sp.S.Zero) + rotation("x", self.alpha)


def in_table(robot: SerialRobot, convention: Convention) -> SerialRobot:
    """Return the robot with all joints in the convention `dh`, `mdh` or `poe`.

    Fixed joints become part of the links, and parameters are replaced by their values. Numbers
    without a short exact form have 17 digits, or more if a length is 10 m or more.

    Raises:
        InputValueError: The robot has masses, and the conversion to a table would move the link
            frames in which their positions are given.
    """
    if robot.load is not None:
        raise InputValueError(
            f"{robot.name}: masses are positioned in link frames, which a table changes; to keep "
            f'the masses, convert to "toml" instead of {convention.name!r}'
        )
    with mpmath.workdps(EVALUATION_DIGITS):
        pairs = neighbours(robot)
        values = {parameter.symbol: parameter.value for parameter in robot.parameters}
        home = home_pose(robot, values)
        rows = _screws(pairs, home) if convention is poe else _steps_table(pairs, home, convention)
        digits = digits_for(rows.size)
        base, tool = (
            from_xyz_rpy(_rounded(xyz, digits), _rounded(rpy, digits))
            for xyz, rpy in (rows.base, rows.tool)
        )
        joints = tuple(
            _joint(pair.joint, convention, _rounded_fields(fields, digits), values)
            for pair, fields in zip(pairs, rows.fields, strict=True)
        )
    return replace(robot, joints=joints, base=base, tool=tool, parameters=())


def screw_form(robot: SerialRobot) -> SerialRobot:
    """Return the robot with its joints as screw axes.

    A screw axis is stored as a direction, and as the axis point nearest to the origin of the base
    frame.
    """
    plain = in_table(replace(robot, load=None, springs=None, transmissions=()), poe)
    return replace(plain, joints=tuple(_at_nearest_point(joint) for joint in plain.joints))


def _at_nearest_point(joint: Joint) -> Joint:
    with mpmath.workdps(EVALUATION_DIGITS):
        values = [mpmath.mpf(value.p) / value.q for _, value in joint.given]
        axis, point = mpmath.matrix(values[:3]), mpmath.matrix(values[3:])
        along = (axis.T * point)[0] / (axis.T * axis)[0]
        x, y, z = (length(point[k] - along * axis[k]) for k in range(3))
    direction = tuple(joint.direction * value for _, value in joint.given[:3])
    before, after = poe(joint.kind, axis=direction, point=(x, y, z))
    return replace(joint, before=before, after=after, direction=1)


@dataclass(frozen=True)
class _Rows:
    fields: tuple[Mapping[str, sp.Expr | Vector], ...]
    base: tuple[Vector, Vector]
    tool: tuple[Vector, Vector]

    @property
    def size(self) -> float:
        """The largest absolute value in the table, an upper bound on the lengths (meter)."""
        values = [value for fields in self.fields for value in fields.values()]
        vectors = [value if isinstance(value, tuple) else (value,) for value in values]
        return max(abs(float(x)) for vector in (*vectors, *self.base, *self.tool) for x in vector)


def _joint(
    joint: Joint,
    convention: Convention,
    fields: Mapping[str, sp.Expr | Vector],
    values: Mapping[sp.Symbol, sp.Expr],
) -> Joint:
    given = {field.name: field.value(fields) for field in convention.fields}
    before, after = convention(joint.kind, **given)
    return replace(
        joint,
        before=before,
        after=after,
        pitch=joint.pitch.xreplace(values),
        convention=convention,
        given=convention.scalars(given),
        assumed=tuple(name for name in joint.assumed if name in ("limits", "pitch")),
    )


def _rounded_fields(
    fields: Mapping[str, sp.Expr | Vector], digits: int
) -> dict[str, sp.Expr | Vector]:
    return {
        name: _rounded(value, digits) if isinstance(value, tuple) else rounded(value, digits)
        for name, value in fields.items()
    }


def _rounded(vector: Vector, digits: int) -> Vector:
    x, y, z = (rounded(part, digits) for part in vector)
    return x, y, z


# --- screw axes ---


def _screws(pairs: Sequence[Neighbours], home: Any) -> _Rows:
    frame = mpmath.eye(4)
    fields: list[dict[str, Any]] = []
    for pair in pairs:
        frame = frame * pair.frame
        axis, point = (tuple(length(frame[i, k]) for i in range(3)) for k in (2, 3))
        is_line = pair.joint.kind != "prismatic"
        fields.append({"axis": axis, "point": point} if is_line else {"axis": axis})
    none = (sp.S.Zero,) * 3
    return _Rows(tuple(fields), (none, none), xyz_rpy_of(home))


# --- Denavit-Hartenberg parameters ---


def _steps_table(pairs: Sequence[Neighbours], home: Any, convention: Convention) -> _Rows:
    steps, rest = axis_steps(pairs, home)
    is_standard = convention is dh
    across = steps[1:] if is_standard else steps[:-1]
    fields = tuple(
        {"a": normal.a, "alpha": normal.alpha, "d": step.shift, "theta": step.turn}
        for step, normal in zip(steps[1:], across, strict=True)
    )
    first = steps[0].along + (steps[0].across if is_standard else ())
    last = rest if is_standard else steps[-1].across + rest
    base, tool = (xyz_rpy_of(pose_in_digits(placement, {})) for placement in (first, last))
    return _Rows(fields, base, tool)


def axis_steps(pairs: Sequence[Neighbours], home: Any) -> tuple[tuple[AxisStep, ...], Placement]:
    """Return the steps between consecutive axes, and the remaining motion along the tool axis."""
    own = original = mpmath.eye(4)
    steps = []
    for pair in pairs:
        original = original * pair.frame
        is_line = pair.joint.kind != "prismatic"
        step, own = _stepped(own, original, axis_line(own**-1 * original, pair.joint), is_line)
        steps.append(step)
    relative = own**-1 * home
    line = AxisLine(tuple(relative[:3, 2]), tuple(relative[:3, 3]))
    step, own = _stepped(own, home, line, is_line=True)
    left = own**-1 * home
    turn, shift = angle(mpmath.atan2(left[1, 0], left[0, 0])), length(left[2, 3])
    step, rest = _shortened(step, turn, shift)
    return (*steps, step), rest


def _stepped(own: Any, original: Any, line: AxisLine, is_line: bool) -> tuple[AxisStep, Any]:
    """Return the transform between two axes, and the frame after this transform."""
    found = common_normal(line)
    a, alpha = found.values["a"], found.values["alpha"]
    assert not isinstance(a, tuple)
    assert not isinstance(alpha, tuple)
    turn = found.turn
    if abs(float(turn)) > _RIGHT:
        # The opposite direction of the common normal gives a smaller rotation.
        turn = turn - sp.pi if turn > 0 else turn + sp.pi
        a, alpha = -a, -alpha if alpha != sp.pi else alpha
    step = AxisStep(_turned(turn), found.shift, a, alpha)
    own = own * pose_in_digits(step.along + step.across, {})
    # Each step corrects the rounding errors of the steps before it. Uncorrected rounding errors
    # would add up, and parallel axes would intersect at a distant point.
    off = own**-1 * original
    x, y = (off[0, 3], off[1, 3]) if is_line else (0, 0)
    return step, own * _small(off[0, 2], off[1, 2], x, y)


def _turned(turn: sp.Expr) -> sp.Expr:
    return angle(mpmath.mpf(sp.Float(turn.evalf(EVALUATION_DIGITS), EVALUATION_DIGITS)._mpf_))


def _small(tilt_x: Any, tilt_y: Any, x: Any, y: Any) -> Any:
    T = mpmath.eye(4)
    T[0, 2], T[2, 0], T[1, 2], T[2, 1] = tilt_x, -tilt_x, tilt_y, -tilt_y
    T[0, 3], T[1, 3] = x, y
    return T


def _shortened(step: AxisStep, turn: sp.Expr, shift: sp.Expr) -> tuple[AxisStep, Placement]:
    """Merge the motion along the tool axis into the last step.

    The translation along the tool axis is merged if the tool axis and the last joint axis are
    parallel. The rotation about the tool axis is merged only if the tool axis and the last joint
    axis coincide.

    Return the new last step and the remaining motion along the tool axis.
    """
    if step.alpha != 0:
        return step, along_z(turn, shift)
    moved = replace(step, shift=step.shift + shift)
    if step.a != 0:
        return moved, along_z(turn, sp.S.Zero)
    return replace(moved, turn=_turned(step.turn + turn)), ()
