"""Geometry of a robot with loops as variables that a calibration may correct.

Joints, end frames and drives have the same parameters as in a serial robot
(``chasles.derive.model.geometry``). For closures and struts, the parameters are the positions of
the two ends in the frames of their bodies. The length of a strut is also a geometry parameter. The
length parameter of a cylinder is its length at coordinate zero.

A passive joint has no offset parameter, because its loop determines its value. A coupling of a
passive joint has an offset parameter. For example, the offset of a gear pair depends on which teeth
mesh. Coupling ratios, such as gear ratios, are exact and therefore not parameters. The pose of a
body on six consecutive passive joints is arbitrary, so the axes of these joints have no parameters.
The parameters of a planar loop keep its parts in the plane. Therefore, a revolute axis in a planar
loop has no tilt parameters. The end of a closure or strut in a planar loop has no parameter along
the plane normal.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import sympy as sp

from ...chain.poe import placement_matrix
from ...model.coupling import Coupling
from ...model.geometry import GeometryParameter, Parameters, driven, moved
from ...model.mechanism import Closure, Frame, Mechanism, Strut
from ...model.placements import Placement, Rotation, rotation, translation
from ...model.robot import Joint
from ...model.tolerances import ZERO_COMPONENT
from ...terms.terms import Terms
from .coupling_equations import is_length
from .planes import Linkage, Loop, loops, planar_loop_joints

_FREE = 6
"""Degrees of freedom of a body in space."""
_TURNS: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")


class Step(NamedTuple):
    """The motions from the frame of a parent body to the frame of a body.

    A step from a parent body to its child body consists of the motion before the joint, the joint
    motion, and the motion after the joint.
    """

    before: Placement
    motion: Placement
    after: Placement

    @property
    def transform(self) -> Placement:
        """The complete motion from the parent frame to the body frame."""
        return self.before + self.motion + self.after


@dataclass(frozen=True)
class MechanismGeometry:
    """The symbolic geometry of a robot with loops.

    Attributes:
        parameters: The geometry parameters p in the order base, joints, loops, tool.
        values: Symbolic value of each moving joint and cylinder.
        steps: Motions from the parent frame to each body, as functions of actuated coordinates q,
            passive coordinates u and parameters p.
        base: Pose of the base body in the base frame, as a sequence of motions.
        tool: Motions whose product is the pose of the tool in the frame of the last body.
        ends: The two end frames of each closure and strut, each relative to its body.
        lengths: The length of each rod or cylinder.
        offsets: The offset of each coupling, keyed by the name of the coupled joint.
        planar: The planar linkage of each closure or strut that belongs to a planar loop.
    """

    parameters: tuple[GeometryParameter, ...]
    values: Mapping[str, sp.Expr]
    steps: Mapping[str, Step]
    base: Placement
    tool: Placement
    ends: Mapping[str, tuple[Placement, Placement]]
    lengths: Mapping[str, sp.Expr]
    offsets: Mapping[str, sp.Expr]
    planar: Mapping[str, Linkage]


def mechanism_geometry(
    mechanism: Mechanism, terms: Terms, q: Sequence[sp.Symbol], unknown: Mapping[str, sp.Symbol]
) -> MechanismGeometry:
    """Return the symbolic geometry of a mechanism with loops.

    Args:
        mechanism: The description.
        terms: Receives the terms.
        q: A symbol for each actuated coordinate.
        unknown: A symbol for each passive joint and cylinder.
    """
    return _Numbered(mechanism, terms).geometry(q, unknown)


class _Numbered:
    """Numbers the parameters of a mechanism in the order of its parts."""

    def __init__(self, mechanism: Mechanism, terms: Terms) -> None:
        self.mechanism, self.made = mechanism, Parameters(mechanism)
        self.terms, self.planar = terms, planar_loop_joints(mechanism)
        self.free = _free_joints(mechanism)
        in_plane = [
            loop
            for loop in loops(mechanism)
            if isinstance(loop.loop_joint, Closure) and loop.loop_joint.name in self.planar
        ]
        self.untilted = {joint.name: loop for loop in in_plane for joint in loop.joints}

    def geometry(
        self, q: Sequence[sp.Symbol], unknown: Mapping[str, sp.Symbol]
    ) -> MechanismGeometry:
        made, mechanism = self.made, self.mechanism
        base = made.corrected("base", "base") + made.at_values(mechanism.base)
        values = {**unknown, **self._actuated(q)}
        steps = {joint.link: self._step(joint, values) for joint in mechanism.joints}
        ends = {c.name: (self._end(c, "a"), self._end(c, "b")) for c in mechanism.loop_joints}
        lengths = {strut.name: self._length(strut, values) for strut in mechanism.struts}
        offsets = {coupling.joint: self._offset(coupling) for coupling in mechanism.couplings}
        tool = made.at_values(mechanism.tool) + made.corrected("tool", "tool")
        parameters = tuple(made.parameters)
        return MechanismGeometry(
            *(parameters, values, steps, base, tool, ends, lengths, offsets, self.planar)
        )

    def _actuated(self, q: Sequence[sp.Symbol]) -> dict[str, sp.Expr]:
        """Return the values of the actuated joints and cylinders, including drive corrections."""
        found = {}
        for coordinate, symbol in zip(self.mechanism.coordinates, q, strict=True):
            member = self.mechanism.members[coordinate.moves]
            ratio = self.made.at_value(coordinate.ratio)
            value = ratio * driven(coordinate, symbol, self.made)
            if isinstance(member, Joint) and not _has_variable(member):
                value += self.made.new(member.name, "offset", member.unit, "offset", part="offset")
            found[coordinate.moves] = value
        return found

    def _offset(self, coupling: Coupling) -> sp.Expr:
        """Return a coupling's offset, plus an offset parameter if the coupled joint is passive."""
        name, member = coupling.joint, self.mechanism.members[coupling.joint]
        if name in {c.moves for c in self.mechanism.coordinates}:
            return coupling.offset
        unit = "m" if is_length(member) else "rad"
        return coupling.offset + self.made.new(name, "offset", unit, "offset", part="offset")

    def _step(self, joint: Joint, values: Mapping[str, sp.Expr]) -> Step:
        made = self.made
        before, after = joint.before, joint.after
        if joint.kind == "fixed":
            return Step(made.at_values(before), (), made.at_values(after))
        if joint.name not in self.free:
            before, after = made.placed(joint, self._tilts(joint))
        value = joint.direction * values[joint.name]
        motion = moved(joint, value, made)
        return Step(made.at_values(before), motion, made.at_values(after))

    def _tilts(self, joint: Joint) -> str:
        """Return the axes about which a joint axis may tilt."""
        loop = self.untilted.get(joint.name)
        if loop is None:
            return "xy"
        if joint.kind != "prismatic":
            return ""
        normal = self._normal(loop, joint.parent)
        R = placement_matrix(joint.before)[:3, :3]
        return "".join(
            axis
            for axis, column in zip("xy", (R[:, 0], R[:, 1]), strict=True)
            if _are_parallel(self.terms, column, normal)
        )

    def _normal(self, loop: Loop, body: str) -> sp.Matrix:
        return self.planar[loop.loop_joint.name].axes[body].n

    def _end(self, loop_joint: Closure | Strut, side: str) -> Placement:
        """Return the end frame of a closure or strut relative to its body.

        The coordinates of the end frame are parameters, except along the normal of a planar loop.
        """
        frame: Frame = getattr(loop_joint, side)
        placement = self.made.at_values(frame.placement)
        shift = placement_matrix(frame.placement)[:3, 3]
        place = [self._coordinate(loop_joint, frame, side, k, shift[k]) for k in range(3)]
        turns = tuple(motion for motion in placement if isinstance(motion, Rotation))
        return translation(*place) + turns + self._turned(loop_joint, side)

    def _turned(self, loop_joint: Closure | Strut, side: str) -> Placement:
        """Return the rotations that correct the axes of a closure's end frame.

        Struts, ball closures and closures of planar loops need no correction of their end axes.
        """
        if (
            isinstance(loop_joint, Strut)
            or loop_joint.kind == "ball"
            or loop_joint.name in self.planar
        ):
            return ()
        turns: Placement = ()
        for axis in _TURNS if loop_joint.kind != "pin" else _TURNS[:2]:
            words = (
                f"correction: rotation of its axes on {getattr(loop_joint, side).body} about {axis}"
            )
            symbol = self.made.new(
                loop_joint.name, f"{side}_turn_{axis}", "rad", words, part="loop"
            )
            turns += rotation(axis, symbol)
        return turns

    def _coordinate(
        self, loop_joint: Closure | Strut, frame: Frame, side: str, k: int, value: sp.Expr
    ) -> sp.Expr:
        """Return a coordinate of an end point of a closure or strut.

        In a planar loop, the coordinate along the plane normal is not a geometry parameter.
        """
        linkage = self.planar.get(loop_joint.name)
        axis = sp.eye(3)[:, k]
        if linkage and _are_parallel(self.terms, axis, linkage.axes[frame.body].n):
            return self.made.at_value(value)
        name, meaning = f"{side}_{'xyz'[k]}", f"{'xyz'[k]} of its end on {frame.body}"
        return self.made.new(loop_joint.name, name, "m", meaning, value, "loop")

    def _length(self, strut: Strut, values: Mapping[str, sp.Expr]) -> sp.Expr:
        meaning = "length at coordinate zero" if strut.is_cylinder else "length"
        length = self.made.new(strut.name, "length", "m", meaning, strut.length, "loop")
        return length + values[strut.name] if strut.is_cylinder else length


def _has_variable(joint: Joint) -> bool:
    """Whether a joint's convention has a field for the coordinate offset."""
    return bool(joint.convention and joint.convention.variable(joint.kind))


def _free_joints(mechanism: Mechanism) -> set[str]:
    moves = {coordinate.moves for coordinate in mechanism.coordinates}
    carried = [joint.parent for joint in mechanism.joints]
    carried += [frame.body for c in mechanism.loop_joints for frame in (c.a, c.b)]
    carried.append(mechanism.tool_body)
    free: set[str] = set()
    run: list[Joint] = []
    for joint in mechanism.joints:
        follows = bool(run) and joint.parent == run[-1].link and carried.count(joint.parent) == 1
        run = [*run, joint] if follows else [joint]
        if joint.name in moves or joint.kind == "fixed":
            run = []
        elif len(run) == _FREE:
            free |= {member.name for member in run}
    return free


def _are_parallel(terms: Terms, a: sp.Matrix, b: sp.Matrix) -> bool:
    return all(abs(terms.value(entry)) < ZERO_COMPONENT for entry in a.cross(b))
