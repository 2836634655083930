"""Reads robots with loops from robot files."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, get_args

import sympy as sp

from ..model.errors import DescriptionError
from ..model.kinds import JointKind, ParameterKind
from ..model.mechanism import (
    Closure,
    ClosureKind,
    ClosureMode,
    Drive,
    DriveKind,
    EndKind,
    Frame,
    Mechanism,
    Strut,
)
from ..model.placements import Placement, Vector, align_z, inverse
from ..model.robot import Joint
from ..terms.vectors import ONE, ZERO
from .assumptions import assumption
from .jointed_struts import FREEDOMS, Ends, JointedStrut, is_jointed, jointed
from .serial_file import JOINT_FIELDS, KINDS, ROBOT_FIELDS, RobotFile
from .suggestions import hint
from .toml_file import Keys, dotted, listed

MECHANISM_FIELDS = ("closures", "rods", "cylinders", "drives", "actuated", "reference")
OTHER_FIELDS = ("closure", "nominal", "masses", "gravity", "couplings")
CLOSURE_MODES: tuple[ClosureMode, ...] = get_args(ClosureMode)
FRAME_FIELDS = ("body", "xyz", "rpy")
HELD_FIELDS = (*FRAME_FIELDS, "assumed")
ROD_FIELDS = ("name", "length", "a", "b", "ends", "swing", "assumed")
CYLINDER_FIELDS = ("name", "retracted", "limits", "a", "b", "ends", "swing", "assumed")
PLATFORM_FIELDS = (
    "name",
    "type",
    "parent",
    "coordinates",
    "limits",
    "link",
    "xyz",
    "rpy",
    "assumed",
)
DRIVE_FIELDS = ("name", "joint", "kind", "radius", "ratio", "teeth", "pitch", "assumed")
_X, _Y, _Z = (ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE)
PLATFORMS: Mapping[str, tuple[tuple[str, JointKind, Vector], ...]] = {
    "planar": (("x", "prismatic", _X), ("y", "prismatic", _Y), ("phi", "revolute", _Z)),
    "free": (
        ("x", "prismatic", _X),
        ("y", "prismatic", _Y),
        ("z", "prismatic", _Z),
        ("yaw", "revolute", _Z),
        ("pitch", "revolute", _Y),
        ("roll", "revolute", _X),
    ),
}
"""The joints (name, kind, axis) that replace a platform joint, keyed by the type of platform joint.
Each of these joints has one degree of freedom."""


def has_loops(table: Mapping[str, object]) -> bool:
    """Whether a file describes a robot with loops."""
    joints = table.get("joints")
    listed_joints = joints if isinstance(joints, list) else []
    has_parent = any(isinstance(joint, Mapping) and "parent" in joint for joint in listed_joints)
    return has_parent or any(field in table for field in MECHANISM_FIELDS)


class MechanismFile(RobotFile):
    """A file that describes a robot with loops."""

    joint_fields: ClassVar = (*JOINT_FIELDS, "mimic", "parent")
    of_lines: ClassVar = {}

    def described(self) -> Mechanism:
        """Return the robot with loops that the file describes."""
        return self.mechanism()

    def mechanism(self) -> Mechanism:
        """Return the robot.

        Raises:
            DescriptionError: The file is invalid.
        """
        self.check_fields((), self.table, (*ROBOT_FIELDS, *MECHANISM_FIELDS, *OTHER_FIELDS))
        name = self.robot_name()
        self.declare_units()
        self.declare_parameters()
        base, base_frame = self._frame("base", "0")
        joints = self._tree(base_frame)
        bodies = (base_frame, *(joint.link for joint in joints))
        closures = tuple(self._closure(keys, bodies) for keys in self._each("closures"))
        rods = [self._rod(keys, bodies) for keys in self._each("rods")]
        cylinders = [self._cylinder(keys, bodies) for keys in self._each("cylinders")]
        members = (*rods, *cylinders)
        struts = tuple(member for member in members if isinstance(member, Strut))
        chains = [member for member in members if isinstance(member, JointedStrut)]
        joints += tuple(joint for chain in chains for joint in chain.joints)
        closures += tuple(chain.closure for chain in chains)
        kinds = _moving(joints, struts)
        drives = tuple(self._drive(keys, kinds) for keys in self._each("drives"))
        couplings = self.joint_couplings(self._joints_with_indices(joints), kinds)
        tool_body, tool, tool_frame = self._tool(bodies)
        transmissions = tuple(map(self._transmission, self._each("transmissions")))
        load = self.load()
        parameters = tuple(self.parameter(name) for name in self.symbols)
        reference = self._reference(kinds, struts, drives)
        middles = [pair for chain in chains for pair in chain.reference]
        omitted = tuple(pair for pair in middles if pair[0] not in dict(reference))
        loop_joints: tuple[Closure | Strut, ...] = (*closures, *struts)
        try:
            return Mechanism(
                name=name,
                joints=joints,
                actuated=self._actuated(kinds, drives),
                closures=closures,
                struts=struts,
                drives=drives,
                couplings=couplings,
                tool_body=tool_body,
                title=self.string(("title",), name),
                source=self.string(("source",), ""),
                base=base,
                tool=tool,
                base_frame=base_frame,
                tool_frame=tool_frame,
                reference=(*reference, *omitted),
                closure=self.option(("closure",), CLOSURE_MODES, "exact"),
                parameters=parameters,
                notes=assumption(parameters, joints, loop_joints, drives),
                transmissions=transmissions,
                load=load,
                omitted=tuple(name for name, _ in omitted),
            )
        except DescriptionError as error:
            if error.file:
                raise
            self.fail(("joints",), f"a robot ({error})", shown=None)

    # --- the tree of the joints ---

    def _tree(self, base_frame: str) -> tuple[Joint, ...]:
        self._taken["link", base_frame] = ("base",)
        bodies = [base_frame]
        joints: list[Joint] = []
        for k in range(self._joint_count()):
            keys: Keys = ("joints", k)
            parent = self._body((*keys, "parent"), bodies, bodies[-1])
            kind = self.joint_type((*keys, "type"), (*KINDS, *PLATFORMS))
            if kind in PLATFORMS:
                joints += self._platform(keys, kind, parent)
            else:
                joints.append(replace(self._joint(k), parent=parent))
            bodies = [base_frame, *(joint.link for joint in joints)]
        return tuple(joints)

    def _joints_with_indices(self, joints: Sequence[Joint]) -> list[tuple[int, Joint]]:
        """Return the joints that the file lists by name, with their indices in the file."""
        index = {self.at(("joints", k, "name")): k for k in range(self._joint_count())}
        return [(index[joint.name], joint) for joint in joints if joint.name in index]

    def _platform(self, keys: Keys, kind: str, parent: str) -> Iterator[Joint]:
        """Yield the one-DOF joints that replace a planar or free platform joint."""
        self.check_fields(keys, self.table_at(keys), PLATFORM_FIELDS)
        freedoms = PLATFORMS[kind]
        name = self.name((*keys, "name"), kind)
        end = self._new((*keys, "link"), f"link{int(keys[-1]) + 1}", "link")
        self._check_list((*keys, "coordinates"), len(freedoms), "names")
        self._check_list((*keys, "limits"), len(freedoms), "pairs")
        before = self._pose(keys)
        for k, (default, joint_kind, axis) in enumerate(freedoms):
            z_to_axis = align_z(axis)
            coordinate = self._new((*keys, "coordinates", k), default)
            is_last = k + 1 == len(freedoms)
            joint = Joint(
                name=coordinate,
                kind=joint_kind,
                before=before + z_to_axis,
                after=inverse(z_to_axis),
                link=end if is_last else f"{name}_{coordinate}",
                parent=parent,
                limits=self.limits((*keys, "limits", k), joint_kind),
                assumed=self.assumed(keys, ("limits", "xyz", "rpy")),
            )
            yield joint
            before, parent = (), joint.link

    def _check_list(self, keys: Keys, count: int, what: str) -> None:
        value = self.at(keys)
        if value is not None and (not isinstance(value, list) or len(value) != count):
            self.fail(keys, f"a list of {count} {what}")

    # --- closures, rods and cylinders ---

    def _closure(self, keys: Keys, bodies: Sequence[str]) -> Closure:
        self.check_fields(keys, self.table_at(keys), ("name", "kind", "a", "b"))
        kind: ClosureKind = self.option((*keys, "kind"), get_args(ClosureKind), "")
        return Closure(self._new((*keys, "name")), kind, *self._frames(keys, bodies))

    def _rod(self, keys: Keys, bodies: Sequence[str]) -> Strut | JointedStrut:
        self.check_fields(keys, self.table_at(keys), ROD_FIELDS)
        length = self.number((*keys, "length"), "length")
        if not self.at_defaults(length) > 0:
            self.fail((*keys, "length"), "a length above 0")
        assumed = self.assumed(keys, ("length",))
        return self._ended(keys, replace(self._strut(keys, bodies, length), assumed=assumed))

    def _cylinder(self, keys: Keys, bodies: Sequence[str]) -> Strut | JointedStrut:
        self.check_fields(keys, self.table_at(keys), CYLINDER_FIELDS)
        length = self.number((*keys, "retracted"), "length")
        limits = self.limits((*keys, "limits"), "prismatic")
        if limits[0] is not None and not self.at_defaults(length) + limits[0] > 0:
            self.fail((*keys, "limits", 0), "a limit that keeps the cylinder length above 0")
        strut = self._strut(keys, bodies, length, is_cylinder=True)
        assumed = self.assumed(keys, ("retracted", "limits"))
        return self._ended(keys, replace(strut, limits=limits, assumed=assumed))

    def _strut(
        self, keys: Keys, bodies: Sequence[str], length: sp.Expr, is_cylinder: bool = False
    ) -> Strut:
        name = self._new((*keys, "name"))
        pair = self._ends(keys)
        ends: EndKind = "pin" if is_jointed(pair) or pair == ("pin", "pin") else "ball"
        if ends == "ball" and self.at((*keys, "swing")) is not None:
            self.fail(
                (*keys, "swing"),
                "no swing: a member with a ball and no pin has no unique swing angle",
            )
        swing = self._new((*keys, "swing"), f"{name}_swing") if ends == "pin" else ""
        a, b = self._frames(keys, bodies)
        has_universal = ends == "ball" and "universal" in pair
        return Strut(name, a, b, length, is_cylinder, ends, swing, has_universal=has_universal)

    def _ended(self, keys: Keys, strut: Strut) -> Strut | JointedStrut:
        """Return the strut, or the jointed strut that replaces it if its ends require joints."""
        ends = self._ends(keys)
        return jointed(strut, ends) if is_jointed(ends) else strut

    def _ends(self, keys: Keys) -> Ends:
        """Read the kinds of joints at both ends, from one word or a list of two."""
        keys = (*keys, "ends")
        value = self.at(keys)
        if not isinstance(value, list):
            kind = self.option(keys, FREEDOMS, "pin")
            return kind, kind
        self._check_list(keys, 2, "kinds of joints, at a and at b")
        a, b = (self.option((*keys, k), FREEDOMS, "") for k in (0, 1))
        return a, b

    def _frames(self, keys: Keys, bodies: Sequence[str]) -> tuple[Frame, Frame]:
        a, b = self._frame_on_body((*keys, "a"), bodies), self._frame_on_body((*keys, "b"), bodies)
        if a.body == b.body:
            self.fail((*keys, "b", "body"), f"a body other than the body of {dotted((*keys, 'a'))}")
        return a, b

    def _frame_on_body(self, keys: Keys, bodies: Sequence[str]) -> Frame:
        self.check_fields(keys, self.table_at(keys), HELD_FIELDS)
        assumed = bool(self.assumed(keys, ("xyz", "rpy")))
        return Frame(self._body((*keys, "body"), bodies, ""), self._pose(keys), assumed)

    def _body(self, keys: Keys, bodies: Sequence[str], default: str) -> str:
        return self.option(keys, bodies, default)

    # --- coordinates ---

    def _drive(self, keys: Keys, kinds: Mapping[str, JointKind]) -> Drive:
        table = self.table_at(keys)
        self.check_fields(keys, table, DRIVE_FIELDS)
        joint = self.option((*keys, "joint"), kinds, "")
        kind: DriveKind = self.option((*keys, "kind"), get_args(DriveKind), "gear")
        ratio = self._advance(keys, table, joint, kinds[joint] == "prismatic")
        assumed = bool(self.assumed(keys, ("radius", "ratio", "teeth", "pitch")))
        return Drive(self._new((*keys, "name")), joint, ratio, kind, assumed)

    def _advance(
        self, keys: Keys, table: Mapping[str, object], joint: str, slides: bool
    ) -> sp.Expr:
        """Return the motion of the joint per radian of its motor."""
        field, others = (
            ("radius", ("ratio",)) if slides else ("ratio", ("radius", "teeth", "pitch"))
        )
        for other in others:
            if other in table:
                joint_type = "prismatic" if slides else "revolute"
                expected = f"no {other}: {joint} is {joint_type}, so its drive needs a {field}"
                self.fail((*keys, other), expected)
        if "teeth" in table or "pitch" in table:
            return self._of_teeth(keys, table)
        if field not in table:
            instead = ", or teeth and pitch of the wheel" if slides else ""
            self.fail((*keys, field), f"the motion of {joint} per motor radian{instead}")
        ratio = self.number((*keys, field), "length" if slides else "ratio")
        if self.at_defaults(ratio) == 0:
            self.fail((*keys, field), "a nonzero number")
        return ratio

    def _of_teeth(self, keys: Keys, table: Mapping[str, object]) -> sp.Expr:
        """Return the effective radius of a wheel for a belt, a chain or a rack."""
        if "radius" in table:
            self.fail((*keys, "radius"), "either a radius, or teeth and pitch")
        teeth = self.number((*keys, "teeth"), "ratio")
        pitch = self.number((*keys, "pitch"), "length")
        for field, value in (("teeth", teeth), ("pitch", pitch)):
            if self.at_defaults(value) == 0:
                self.fail((*keys, field), "a nonzero number", self.at((*keys, field)) or 0)
        return teeth * pitch / (2 * sp.pi)

    def _actuated(self, kinds: Mapping[str, JointKind], drives: Sequence[Drive]) -> tuple[str, ...]:
        value = self.at(("actuated",))
        if not isinstance(value, list) or not value:
            self.fail(("actuated",), "a list of names, the order of q")
        moved = {name: name for name in kinds} | {drive.name: drive.joint for drive in drives}
        first: dict[str, str] = {}
        for k in range(len(value)):
            name = self.option(("actuated", k), moved, "")
            if moved[name] in first:
                expected = f"a coordinate of a joint that {first[moved[name]]} does not move"
                self.fail(("actuated", k), expected)
            first[moved[name]] = name
        return tuple(first.values())

    def _tool(self, bodies: Sequence[str]) -> tuple[str, Placement, str]:
        self.check_fields(("tool",), self.table_at(("tool",), {}), ("name", *FRAME_FIELDS))
        body = self._body(("tool", "body"), bodies, bodies[-1])
        return body, self._pose(("tool",)), self._frame_name("tool", "ee")

    def _reference(
        self, kinds: Mapping[str, JointKind], struts: Sequence[Strut], drives: Sequence[Drive]
    ) -> tuple[tuple[str, sp.Expr], ...]:
        angles: list[str] = [strut.swing for strut in struts if strut.ends == "pin"]
        angles += [drive.name for drive in drives]
        known: dict[str, ParameterKind] = dict.fromkeys(angles, "angle")
        for name, kind in kinds.items():
            known[name] = "length" if kind == "prismatic" else "angle"
        found = []
        for name in self.table_at(("reference",), {}):
            keys: Keys = ("reference", name)
            if name not in known:
                expected = f"a coordinate, a joint or a swing ({listed(known)})"
                self.fail(keys, f"{expected}{hint(name, known)}", shown=name)
            found.append((name, self.at_defaults(self.number(keys, known[name]))))
        return tuple(found)


def _moving(joints: Sequence[Joint], struts: Sequence[Strut]) -> dict[str, JointKind]:
    """Return the type of each movable joint and each cylinder, keyed by name."""
    kinds: dict[str, JointKind] = {j.name: j.kind for j in joints if j.kind != "fixed"}
    return kinds | {strut.name: "prismatic" for strut in struts if strut.is_cylinder}
