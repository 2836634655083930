"""Rods and cylinders whose rotation about their own axis is determined by the joints at their ends.

A strut between two ball joints, or between a universal joint and a ball joint, is modeled as a
constraint on the distance between its ends. Any other strut with a universal joint, or with a pin
and a ball, is modeled by joints and links in the kinematic tree. A closure (loop joint) connects
the far end of the strut. The z axis of the frame at an end is the axis of the pin, or the axis of
the universal joint on this body. The second axis of a universal joint is perpendicular to the first
axis and to the strut. If the other end has a pin, the second axis is parallel to the pin. If the
other end has a universal joint, the second axes of both ends are parallel.
"""

from collections.abc import Mapping
from typing import NamedTuple

import sympy as sp

from ..model.mechanism import Closure, ClosureKind, Frame, Strut
from ..model.placements import rotation, translation
from ..model.robot import Joint
from ..terms.vectors import ZERO

Ends = tuple[str, str]
FREEDOMS: Mapping[str, int] = {"pin": 1, "universal": 2, "ball": 3}
"""Degrees of freedom of each kind of joint at the end of a strut."""
_RIGHT = sp.pi / 2
_TO_CROSS = rotation("x", -_RIGHT)
"""Rotation from the frame of the first axis of a universal joint to the frame of the second axis.
The second axis is the y axis of the first frame.
"""
_TO_STRUT = rotation("z", _RIGHT) + rotation("x", _RIGHT)
"""Rotation from the frame of a pin to the frame of its strut. The z axis of the strut frame is
along the strut, and the y axis is the axis of the pin."""
_FROM_STRUT = rotation("x", -_RIGHT) + rotation("z", -_RIGHT)
_FROM_CROSS = rotation("x", _RIGHT)
"""The inverse rotations."""


class JointedStrut(NamedTuple):
    """The joints and the closure that replace a strut, and the reference values of the joints."""

    joints: tuple[Joint, ...]
    closure: Closure
    reference: tuple[tuple[str, sp.Expr], ...]


def is_jointed(ends: Ends) -> bool:
    """Whether a strut with the joint kinds ``ends`` is replaced by joints and a closure."""
    return ends[0] != ends[1] if "pin" in ends else "ball" not in ends


def jointed(strut: Strut, ends: Ends) -> JointedStrut:
    """Return joints and a closure in place of a strut.

    Args:
        strut: The strut; its swing angle becomes the angle of the first joint.
        ends: The kinds of the joints at the first and second end.
    """
    places = zip(ends, (strut.a, strut.b), strict=True)
    (near, start), (far, end) = sorted(places, key=lambda place: FREEDOMS[place[0]])
    name, joints = strut.name, _at_start(strut, near, start)
    along = translation(ZERO, ZERO, strut.length)
    if strut.is_cylinder:
        barrel, piston = strut.sections
        joints.append(
            Joint(name, "prismatic", along, (), piston, barrel, strut.limits, assumed=strut.assumed)
        )
        along = ()
    if far == "universal":
        tilt, cross, section = f"{name}_far_tilt", f"{name}_far_cross", joints[-1].link
        before = along + _FROM_STRUT
        joints.append(Joint(tilt, "revolute", before, _FROM_CROSS, cross, section))
        along = ()
    near_side = Frame(joints[-1].link, along, "length" in strut.assumed)
    kind: ClosureKind = "pin" if far == "universal" else "ball"
    closure = Closure(f"{name}_end" if strut.is_cylinder else name, kind, near_side, end)
    return JointedStrut(tuple(joints), closure, _middle(strut))


def _at_start(strut: Strut, kind: str, start: Frame) -> list[Joint]:
    """Return the joints between the first body and the strut: a pin or a universal joint."""
    # At zero, the x axis of the first joint points from a to b.
    before = start.placement + (() if start is strut.a else rotation("z", sp.pi))
    section, cross = strut.sections[0], f"{strut.name}_cross"
    after, link = (_TO_STRUT, section) if kind == "pin" else (_TO_CROSS, cross)
    assumed = ("xyz", "rpy") if start.assumed else ()
    name = strut.swing_name
    first = Joint(name, "revolute", before, after, link, start.body, assumed=assumed)
    if kind == "pin":
        return [first]
    return [first, Joint(f"{strut.name}_tilt", "revolute", (), _TO_STRUT, section, cross)]


def _middle(strut: Strut) -> tuple[tuple[str, sp.Expr], ...]:
    """Return the middle of a cylinder's limits, its default reference value."""
    low, high = strut.limits
    return () if low is None or high is None else ((strut.name, (low + high) / 2),)
