"""A robot with loops as plain data: joints, closures, struts and drives.

Each body has the name of its joint. The base is a body too. The joints form a tree. Each closure or
strut connects two bodies and closes a loop. The main chain is the path of joints from the base to
the body with the tool. The main chain is a serial robot whose coordinates follow from the loops.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, get_args

import sympy as sp

from .cleaning import Cleaning
from .coupling import Coupling, check_joint_couplings
from .errors import DescriptionError
from .exact import exact
from .names import check_choice, check_name, check_robot_name, check_unique
from .robot import (
    Joint,
    Load,
    Parameter,
    Placement,
    SerialRobot,
    Transmission,
    check_transmissions,
    joints_to_root,
    symbols_of,
)

ClosureMode = Literal["exact", "least squares"]
"""How a loop closes: exactly, or in the least-squares sense if it is overconstrained."""
ClosureKind = Literal["pin", "slider", "ball", "weld"]
EndKind = Literal["pin", "ball"]
DriveKind = Literal["gear", "rack", "belt", "chain"]
FREEDOM: Mapping[str, int] = {"pin": 1, "slider": 1, "ball": 3, "weld": 0}
"""Degrees of freedom of each kind of closure."""


@dataclass(frozen=True)
class Frame:
    """A frame that is fixed to a body.

    Attributes:
        body: Name of the body.
        placement: Pose of the frame in the body frame (meter, radian).
        assumed: Whether the pose is an assumption, because the robot's data source omits it.
    """

    body: str
    placement: Placement = ()
    assumed: bool = False


@dataclass(frozen=True)
class Closure:
    """A joint that closes a loop between two bodies.

    Attributes:
        name: Unique name among joints, closures and struts.
        kind: The joint between the frames a and b. A ``pin`` allows rotation about their common z
            axis, and a ``slider`` allows translation along it. A ``ball`` keeps the origins
            together, and a ``weld`` keeps the frames together.
        a: The frame on the first body.
        b: The frame on the second body.
    """

    name: str
    kind: ClosureKind
    a: Frame
    b: Frame

    def __post_init__(self) -> None:
        check_name("closure", self.name)
        check_choice("closure", self.name, self.kind, get_args(ClosureKind))


@dataclass(frozen=True)
class Strut:
    """A straight part between two bodies: a rod of constant length, or a cylinder.

    Attributes:
        name: Unique name among joints, closures and struts. The coordinate of a cylinder has the
            name of the cylinder.
        a: The frame of the first end, on the first body.
        b: The frame of the second end, on the second body.
        length: Length of a rod, or of a cylinder at coordinate zero (meter).
        is_cylinder: Whether the strut is a cylinder, whose length is variable.
        ends: Kind of the joints at both ends: ``pin`` or ``ball``.
        has_universal: Whether one of the ball joints is a universal joint instead. A strut with a
            universal joint does not rotate about its own axis.
        swing: Name of the passive rotation angle of a strut with pin ends, relative to the first
            body. The default is ``<name>_swing``.
        limits: Lowest and highest coordinate of a cylinder (meter). None means no limit.
        assumed: Names of the fields (``length`` or ``limits``) whose values the robot's data source
            does not state.
    """

    name: str
    a: Frame
    b: Frame
    length: sp.Expr = sp.S.Zero
    is_cylinder: bool = False
    ends: EndKind = "pin"
    swing: str = ""
    limits: tuple[sp.Expr | None, sp.Expr | None] = (None, None)
    assumed: tuple[str, ...] = ()
    has_universal: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        check_name("strut", self.name)
        check_choice("ends of strut", self.name, self.ends, get_args(EndKind))
        object.__setattr__(self, "length", exact(self.length))
        if not self.is_cylinder and self.length == 0:
            raise DescriptionError(f"rod {self.name!r}: expected a length above 0")

    @property
    def swing_name(self) -> str:
        """Name of the passive rotation angle: ``swing``, or its default."""
        return self.swing or f"{self.name}_swing"

    @property
    def sections(self) -> tuple[str, ...]:
        """Names of the bodies of the strut: the rod, or barrel and piston of a cylinder."""
        return (f"{self.name}_barrel", f"{self.name}_piston") if self.is_cylinder else (self.name,)


@dataclass(frozen=True)
class Drive:
    """A motor that moves a joint through a gear, a rack, a belt or a chain.

    If two motors move one joint, only one drive is actuated. The joint moves the motor of the other
    drive, and the angle of this motor is a passive coordinate.

    Attributes:
        name: Name of the motor coordinate.
        joint: Name of the joint or cylinder that the motor moves.
        ratio: Joint displacement per radian of the motor (meter for a prismatic joint, radian for a
            revolute joint).
        kind: The transmission between motor and joint.
        assumed: Whether the ratio is an assumption, because the robot's data source omits it.
    """

    name: str
    joint: str
    ratio: sp.Expr
    kind: DriveKind = "gear"
    assumed: bool = False

    def __post_init__(self) -> None:
        check_name("drive", self.name)
        check_choice("kind of drive", self.name, self.kind, get_args(DriveKind))
        object.__setattr__(self, "ratio", exact(self.ratio))


@dataclass(frozen=True)
class Coordinate:
    """An actuated coordinate in ``q``.

    Attributes:
        name: Name of the joint, cylinder or motor.
        kind: ``revolute`` or ``prismatic``.
        limits: Lowest and highest value (radian or meter), or None if unbounded.
        moves: The joint or cylinder that the coordinate moves.
        ratio: Displacement of the joint or cylinder per unit of the coordinate.
        assumed: Whether the limits are assumed, because the source of the dimensions does not state
            limits.
    """

    name: str
    kind: str
    limits: tuple[sp.Expr | None, sp.Expr | None]
    moves: str
    ratio: sp.Expr = sp.S.One
    assumed: bool = False

    @property
    def unit(self) -> str:
        """Unit of the coordinate: m for a slider or cylinder, otherwise rad."""
        return "m" if self.kind == "prismatic" else "rad"


@dataclass(frozen=True)
class Mechanism:
    """A robot with loops, or with motors that drive joints through gears.

    Attributes:
        name: A C identifier, with which all generated names start.
        joints: The joints of the kinematic tree, each after its parent. The ``parent`` of a joint
            is the body that carries it. The ``link`` of a joint is the body that the joint moves.
        actuated: Names of the actuated joints, cylinders and drives, in the order of ``q``.
        closures: Joints that close loops.
        struts: Rods and cylinders, which also close loops.
        drives: Motors that move joints through gears, racks, belts or chains.
        tool_body: Name of the body that carries the tool; by default the link of the last joint.
        title: Name of the robot in printed texts.
        source: Publication or data sheet with the dimensions.
        base: Pose of the base body in the base frame (meter, radian).
        tool: Pose of the tool frame in the frame of the tool body (meter, radian).
        base_frame: Name of the base frame and of the base body.
        tool_frame: Name of the tool frame.
        parameters: The named lengths and angles that occur in dimensions.
        reference: Pairs (name, value) of coordinates and joints (radian or meter), which select the
            branch of each loop. The default reference value is the middle of the limits for
            cylinders with limits and for joints whose limits exclude 0. For other joints and
            cylinders, the default reference value is 0. Values of passive joints may be
            approximate.
        notes: Changes and assumptions of the file reader.
        transmissions: The transmission errors of coordinates with imperfect drives.
        closure: "exact", or "least squares" to close loops with slightly misaligned pins with
            minimum squared error.
        nominal: The nominal design of a calibrated robot, with the same joints and struts, or None.
        springs: Pairs (joint name, value at rest) for passive joints with springs (radian or
            meter). The springs do not affect the degrees of freedom of the mechanism.
        couplings: Linear equations between joints or cylinders, such as gear pairs.
        load: The masses of links and of strut sections, or None.
        cleaning: The numbers that were replaced by exact values.
        as_written: The robot with all numbers as in its file, or None if no number was replaced by
            an exact value.
        omitted: Names of joints and cylinders whose reference value is the middle of the limits,
            because the description omits it.

    Raises:
        DescriptionError: Names clash, a body or joint is unknown, or a body has two parents.
    """

    name: str
    joints: tuple[Joint, ...]
    actuated: tuple[str, ...]
    closures: tuple[Closure, ...] = ()
    struts: tuple[Strut, ...] = ()
    drives: tuple[Drive, ...] = ()
    tool_body: str = ""
    title: str = ""
    source: str = ""
    base: Placement = ()
    tool: Placement = ()
    base_frame: str = "0"
    tool_frame: str = "ee"
    parameters: tuple[Parameter, ...] = ()
    reference: tuple[tuple[str, sp.Expr], ...] = ()
    notes: tuple[str, ...] = field(default=())
    transmissions: tuple[Transmission, ...] = field(default=(), repr=False, kw_only=True)
    closure: ClosureMode = "exact"
    nominal: "Mechanism | None" = field(default=None, repr=False, compare=False)
    springs: tuple[tuple[str, sp.Expr], ...] = field(default=(), repr=False, kw_only=True)
    couplings: tuple[Coupling, ...] = field(default=(), repr=False, kw_only=True)
    load: Load | None = field(default=None, repr=False, kw_only=True)
    cleaning: Cleaning = field(default=Cleaning(), repr=False, compare=False)
    as_written: "Mechanism | None" = field(default=None, repr=False, compare=False)
    omitted: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        check_robot_name(self.name)
        if not self.tool_body:
            object.__setattr__(self, "tool_body", self.joints[-1].link)
        names = [joint.name for joint in self.joints] + [drive.name for drive in self.drives]
        swings = [strut.swing_name for strut in self.struts if strut.ends == "pin"]
        check_unique(
            "joint", [*names, *swings, *(loop_joint.name for loop_joint in self.loop_joints)]
        )
        check_unique("body", [self.base_frame, *(joint.link for joint in self.joints)])
        check_unique("parameter", [parameter.name for parameter in self.parameters])
        self._check_bodies()
        self._check_symbols()
        self._check_load()
        check_joint_couplings(self.name, self.couplings, self.members)
        known = {*self.members, *(drive.name for drive in self.drives)}
        self._check_known("actuated", self.actuated, known)
        self._check_known("drive", [drive.joint for drive in self.drives], set(self.members))
        check_unique("actuated coordinate", [c.moves for c in self.coordinates])
        self._check_known("reference of", [n for n, _ in self.reference], known | self._swings)
        if not self.actuated:
            raise DescriptionError(f"robot {self.name!r}: expected an actuated coordinate")
        check_transmissions(self.transmissions, self.actuated)
        if self.nominal is not None:
            self._check_nominal(self.nominal)
        middles = tuple(self._middles())
        object.__setattr__(self, "reference", (*self.reference, *middles))
        object.__setattr__(self, "omitted", (*self.omitted, *(name for name, _ in middles)))

    @property
    def loop_joints(self) -> tuple[Closure | Strut, ...]:
        """The closures and struts, which close the loops."""
        return (*self.closures, *self.struts)

    @property
    def is_constrained(self) -> bool:
        """Whether loops or couplings relate joints to each other."""
        return bool(self.loop_joints or self.couplings)

    @property
    def coupled(self) -> set[str]:
        """Names of the joints and cylinders in the equations of couplings."""
        leaders = {name for coupling in self.couplings for name, _ in coupling.ratios}
        return leaders | {coupling.joint for coupling in self.couplings}

    @property
    def placed(self) -> Iterator[tuple[str, Placement]]:
        """The body of each joint, closure frame and strut frame, with the pose on this body."""
        for joint in self.joints:
            yield joint.parent, joint.before
        for loop_joint in self.loop_joints:
            for frame in (loop_joint.a, loop_joint.b):
                yield frame.body, frame.placement

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of all bodies."""
        return (self.base_frame, *(joint.link for joint in self.joints))

    @cached_property
    def joint_of(self) -> Mapping[str, Joint]:
        """Map each body except the base to the joint that connects the body to its parent."""
        return {joint.link: joint for joint in self.joints}

    @cached_property
    def members(self) -> Mapping[str, Joint | Strut]:
        """All moving joints and cylinders by name.

        Coordinates may move these joints and cylinders.
        """
        joints = {joint.name: joint for joint in self.joints if joint.kind != "fixed"}
        return joints | {strut.name: strut for strut in self.struts if strut.is_cylinder}

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The actuated coordinates in the order of ``q``."""
        drives = {drive.name: drive for drive in self.drives}
        found = []
        for name in self.actuated:
            drive = drives.get(name)
            member = self.members[drive.joint if drive else name]
            kind = "prismatic" if isinstance(member, Strut) else member.kind
            assumed = "limits" in member.assumed
            if drive is None:
                found.append(Coordinate(name, kind, member.limits, name, assumed=assumed))
            else:
                ratio = drive.ratio.xreplace({p.symbol: p.value for p in self.parameters})
                low, high = (None if v is None else v / ratio for v in member.limits)
                limits = (low, high) if ratio > 0 else (high, low)
                moves, gear = drive.joint, drive.ratio
                found.append(Coordinate(name, "revolute", limits, moves, gear, assumed))
        return tuple(found)

    def path_to(self, body: str) -> list[Joint]:
        """Return the joints from the base to the named body."""
        return joints_to_root(self.joint_of, body)[::-1]

    @cached_property
    def main_chain(self) -> SerialRobot:
        """The path from the base to the tool as a serial robot with coordinates theta."""
        return SerialRobot(
            name=self.name,
            joints=tuple(replace(joint, parent="") for joint in self.path_to(self.tool_body)),
            title=self.title,
            source=self.source,
            base=self.base,
            tool=self.tool,
            base_frame=self.base_frame,
            tool_frame=self.tool_frame,
            parameters=self.parameters,
        )

    @property
    def passive(self) -> tuple[str, ...]:
        """Names of the passive joints, cylinders and swing angles outside the main chain.

        Motors that are not actuated are not included.
        """
        taken = {c.moves for c in self.coordinates}
        taken |= {joint.name for joint in self.main_chain.moving}
        joints = [joint.name for joint in self.joints if joint.kind != "fixed"]
        cylinders = [strut.name for strut in self.struts if strut.is_cylinder]
        return tuple(name for name in (*joints, *self.swings, *cylinders) if name not in taken)

    @cached_property
    def followers(self) -> Mapping[str, Drive]:
        """The passive drives by name."""
        return {drive.name: drive for drive in self.drives if drive.name not in self.actuated}

    @property
    def swings(self) -> tuple[str, ...]:
        """Names of the swing angles: the passive rotation angles of the struts with pin ends."""
        return tuple(strut.swing_name for strut in self.struts if strut.ends == "pin")

    @property
    def tool_mounting(self) -> Frame:
        """The tool frame on its body."""
        return Frame(self.tool_body, self.tool)

    @property
    def placements(self) -> tuple[Placement, ...]:
        """All constant placements of base, joints, closures, struts and tool."""
        of_joints = [part for joint in self.joints for part in (joint.before, joint.after)]
        of_loop_joints = [frame.placement for c in self.loop_joints for frame in (c.a, c.b)]
        return (self.base, *of_joints, *of_loop_joints, self.tool)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of the links from the base to the tool."""
        return self.main_chain.link_names

    @property
    def _swings(self) -> set[str]:
        return {strut.swing_name for strut in self.struts}

    def reference_of(self, name: str) -> sp.Expr:
        """Return the reference value of a coordinate, joint or swing angle (radian or meter)."""
        return dict(self.reference).get(name, sp.S.Zero)

    def _middles(self) -> Iterator[tuple[str, sp.Expr]]:
        """Yield the middle of the limits of struts, and of joints whose limits exclude zero."""
        given = {name for name, _ in self.reference}
        given |= {drive.joint for drive in self.drives if drive.name in given}
        for strut in self.struts:
            low, high = strut.limits
            if low is not None and high is not None and strut.name not in given:
                yield strut.name, exact((low + high) / 2)
        for joint in self.joints:
            low, high = joint.limits
            if low is not None and high is not None and low * high > 0 and joint.name not in given:
                yield joint.name, exact((low + high) / 2)

    def _check_bodies(self) -> None:
        seen = {self.base_frame}
        for joint in self.joints:
            self._check_known(f"parent of joint {joint.name!r}", [joint.parent], seen)
            seen.add(joint.link)
        self._check_known("tool", [self.tool_body], seen)
        for item in self.loop_joints:
            self._check_known(f"body of {item.name!r}", [item.a.body, item.b.body], seen)
            if item.a.body == item.b.body:
                raise DescriptionError(f"{item.name!r} connects body {item.a.body!r} to itself")

    def _check_nominal(self, nominal: "Mechanism") -> None:
        for what in ("joints", "closures", "struts", "drives", "couplings"):
            mine, other = (
                [_outline(a) for a in getattr(m, what) if _outline(a)[0] not in m.followers]
                for m in (self, nominal)
            )
            if mine != other:
                apart = [a[0] for a in (*mine, *other) if a not in mine or a not in other]
                raise DescriptionError(
                    f"robot {self.name!r} and nominal robot {nominal.name!r}: different {what}: "
                    f"{', '.join(dict.fromkeys(apart)) or 'their order'}"
                )
        if (self.actuated, self.tool_body) != (nominal.actuated, nominal.tool_body):
            raise DescriptionError(
                f"robot {self.name!r}: its actuated coordinates or its tool body differ from the "
                f"nominal robot {nominal.name!r}"
            )

    def _check_known(self, role: str, names: Sequence[str], known: set[str]) -> None:
        for name in names:
            if name not in known:
                there = ", ".join(sorted(known))
                raise DescriptionError(
                    f"robot {self.name!r}: unknown {role} {name!r}; expected one of {there}"
                )

    def _check_load(self) -> None:
        if self.load is None:
            return
        sections = [name for strut in self.struts for name in strut.sections]
        self.load.check_links(self.name, [*self.bodies[1:], *sections])
        for mass in self.load.masses:
            if mass.link in sections and any(mass.at[:2]):
                raise DescriptionError(
                    f"robot {self.name!r}: {mass.link!r}: the mass of a strut section must be on "
                    "the z axis of the section"
                )

    def _check_symbols(self) -> None:
        known = {parameter.symbol for parameter in self.parameters}
        placements = [frame.placement for c in self.loop_joints for frame in (c.a, c.b)]
        used = {symbol for placement in placements for symbol in symbols_of(placement)}
        used |= {symbol for strut in self.struts for symbol in strut.length.free_symbols}
        used |= {symbol for drive in self.drives for symbol in drive.ratio.free_symbols}
        used |= self.load.symbols if self.load else set()
        unknown = sorted(str(symbol) for symbol in used - known)
        if unknown:
            raise DescriptionError(f"robot {self.name!r} uses undeclared {', '.join(unknown)}")


def _outline(member: Joint | Closure | Strut | Drive | Coupling) -> tuple[str, ...]:
    """Return the name, kind and connected parts of a member, without dimensions."""
    if isinstance(member, Coupling):
        return member.joint, *(name for name, _ in member.ratios)
    if isinstance(member, Joint):
        return member.name, member.kind, member.link, member.parent
    if isinstance(member, Drive):
        return member.name, member.joint
    kind = member.kind if isinstance(member, Closure) else str(member.is_cylinder)
    return member.name, kind, member.a.body, member.b.body


Described = SerialRobot | Mechanism
"""The description in a file: a serial robot, or a robot with loops."""
