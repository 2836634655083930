"""A robot as plain data: joints, limits, frames and parameters.

All conventions and file formats are converted to joints with constant placements. The pose of link
i in the frame of link i-1 is the product of three transforms. Only ``motion`` depends on the joint
coordinate q.

    T_prev_link = before * motion(q) * after.

The ``motion`` is along or about the z axis of the joint frame. ``before`` and ``after`` are
products of elementary motions. All numbers are exact. Lengths are in meters and angles in radians.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import get_args

import sympy as sp

from .cleaning import Cleaning
from .convention import Convention
from .coupling import Coupling, LinearMap, Motor, MotorKind, linear_map
from .errors import DescriptionError
from .exact import exact, exact_vector
from .kinds import UNITS, JointKind, ParameterKind
from .names import check_choice, check_name, check_robot_name, check_unique
from .placements import Placement, Rotation, Translation, Vector, symbols_of
from .tolerances import MAX_WAVES

__all__ = [
    "UNITS",
    "Coupling",
    "Joint",
    "JointKind",
    "Motor",
    "Parameter",
    "ParameterKind",
    "Placement",
    "Rotation",
    "SerialRobot",
    "Translation",
    "Transmission",
    "check_transmissions",
    "symbols_of",
]

Vector4 = tuple[sp.Expr, sp.Expr, sp.Expr, sp.Expr]


@dataclass(frozen=True)
class Parameter:
    """A named dimension or mass of a robot.

    Attributes:
        name: Name of the parameter and of its symbol.
        value: Default value (meter, radian, 1 or kilogram, depending on ``kind``).
        kind: ``length``, ``angle``, ``ratio`` or ``mass``.
        meaning: Meaning in a few words.
        assumed: Whether the value is an assumption, because the robot's data source omits it.
    """

    name: str
    value: sp.Expr
    kind: ParameterKind = "length"
    meaning: str = ""
    assumed: bool = False

    def __post_init__(self) -> None:
        check_name("parameter", self.name)
        check_choice("parameter", self.name, self.kind, get_args(ParameterKind))
        object.__setattr__(self, "value", exact(self.value))

    @property
    def symbol(self) -> sp.Symbol:
        """The symbol of the parameter in all equations."""
        return sp.Symbol(self.name, real=True)


@dataclass(frozen=True)
class Joint:
    """A joint and the link that it moves.

    The pose of the link in the frame of the previous link is ``before * motion(q) * after``. The
    motion is about or along the z axis of the joint frame.

    Attributes:
        name: Unique name.
        kind: ``revolute``, ``prismatic``, ``helical`` or ``fixed``.
        before: Pose of the joint frame in the frame of the previous link.
        after: Pose of the link frame in the joint frame after the joint motion.
        link: Name of the link and of its frame.
        parent: In a mechanism, the name of the body that carries the joint. In a serial robot, "".
        limits: Lowest and highest joint coordinate (radian or meter). None means no limit.
        pitch: Translation of a helical joint per radian (meter).
        direction: 1, or -1 if the joint moves against its coordinate.
        convention: The convention that defines ``before`` and ``after``, or None.
        given: Names and values of the convention fields in the printed joint table. Vectors are
            split into components.
        assumed: Names of the fields whose values the robot's data source does not state.
    """

    name: str
    kind: JointKind
    before: Placement = ()
    after: Placement = ()
    link: str = ""
    parent: str = ""
    limits: tuple[sp.Expr | None, sp.Expr | None] = (None, None)
    pitch: sp.Expr = sp.S.Zero
    direction: int = 1
    convention: Convention | None = None
    given: tuple[tuple[str, sp.Expr], ...] = ()
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_name("joint", self.name)
        check_choice("joint", self.name, self.kind, get_args(JointKind))
        check_choice("direction of joint", self.name, self.direction, (1, -1))
        lower, upper = (None if limit is None else exact(limit) for limit in self.limits)
        object.__setattr__(self, "limits", (lower, upper))
        object.__setattr__(self, "pitch", exact(self.pitch))

    @property
    def unit(self) -> str:
        """Unit of the coordinate: m for a prismatic joint, otherwise rad."""
        return "m" if self.kind == "prismatic" else "rad"

    def fixed_at(self, value: sp.Expr) -> "Joint":
        """Return a fixed joint that replaces this revolute or prismatic joint.

        Args:
            value: Constant displacement about or along z (radian or meter). ``direction`` is not
                applied to this value.
        """
        along = Translation((sp.S.Zero, sp.S.Zero, value))
        motion = Rotation("z", value) if self.kind == "revolute" else along
        before = self.before if value == 0 else (*self.before, motion)
        return replace(self, kind="fixed", before=before, limits=(None, None), direction=1)


def joints_to_root(joint_of: Mapping[str, Joint], body: str) -> list[Joint]:
    """Return the joints from a body to the root of its tree.

    Args:
        joint_of: The joint of each body. The root body has no joint.
        body: Name of the body.
    """
    found: list[Joint] = []
    while body in joint_of:
        found.append(joint_of[body])
        body = found[-1].parent
    return found


@dataclass(frozen=True)
class PointMass:
    """A point mass on a link.

    Attributes:
        link: Name of the link.
        mass: The mass (kilogram).
        at: Position of the mass in the link frame (meter).
    """

    link: str
    mass: sp.Expr
    at: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", exact(self.mass))
        object.__setattr__(self, "at", exact_vector(self.at))


@dataclass(frozen=True)
class Load:
    """The masses whose weight deflects the joints of a robot.

    Attributes:
        masses: The masses of the links, with a payload.
        gravity: Gravitational acceleration in the base frame (m/s^2).
    """

    masses: tuple[PointMass, ...]
    gravity: Vector = (sp.S.Zero, sp.S.Zero, sp.Rational("-9.81"))

    def __post_init__(self) -> None:
        object.__setattr__(self, "gravity", exact_vector(self.gravity))

    @property
    def symbols(self) -> set[sp.Symbol]:
        """The parameters that occur in the masses or in the positions of the masses."""
        return {
            symbol for m in self.masses for part in (m.mass, *m.at) for symbol in part.free_symbols
        }

    def check_links(self, robot: str, links: Collection[str]) -> None:
        """Check that each mass is on a link.

        Raises:
            DescriptionError: A mass is on an unknown link.
        """
        for mass in self.masses:
            if mass.link not in links:
                raise DescriptionError(
                    f"robot {robot!r}: expected a mass on one of the links {', '.join(links)}, "
                    f"got {mass.link!r}"
                )


@dataclass(frozen=True)
class Transmission:
    """The transmission error between the reading of a controller and the true coordinate.

    The true coordinate q is a function of the controller reading r.

        q = gain r + sin1 sin r + cos1 cos r + sin2 sin 2r + cos2 cos 2r.

    The sine and cosine terms model eccentric encoders and gears. For a prismatic
    coordinate, the amplitudes are 0.

    Attributes:
        coordinate: Name of the coordinate.
        gain: Mean derivative of the true coordinate with respect to the controller reading r.
        waves: The amplitudes sin1, cos1, sin2 and cos2 (radian).

    Raises:
        DescriptionError: The waves are so large that q does not always increase with r.
    """

    coordinate: str
    gain: sp.Expr = sp.S.One
    waves: Vector4 = (sp.S.Zero,) * 4

    def __post_init__(self) -> None:
        object.__setattr__(self, "gain", exact(self.gain))
        object.__setattr__(self, "waves", tuple(exact(wave) for wave in self.waves))
        sizes = [abs(float(wave)) for wave in self.waves]
        largest = MAX_WAVES * abs(float(self.gain))
        if self.gain == 0 or sum(sizes) + sum(sizes[2:]) > largest:
            raise DescriptionError(
                f"transmission of {self.coordinate!r}: expected a nonzero gain, and waves relative "
                f"to the gain of at most {MAX_WAVES} (sin2 and cos2 count twice)"
            )


@dataclass(frozen=True)
class Spring:
    """The compliance of a joint, and the mass whose weight deflects it.

    Attributes:
        coordinate: Name of the coordinate.
        compliance: Rotation per torque (rad/(N m)), or translation per force (m/N).
        axis: Direction of the joint axis.
        point: A point on the axis (meter).
        mass: Mass whose weight deflects the joint (kilogram).
        center: Center of this mass (meter).
    """

    coordinate: str
    compliance: sp.Expr
    axis: Vector
    point: Vector
    mass: sp.Expr
    center: Vector

    def __post_init__(self) -> None:
        for name in ("compliance", "mass"):
            object.__setattr__(self, name, exact(getattr(self, name)))
        for name in ("axis", "point", "center"):
            object.__setattr__(self, name, exact_vector(getattr(self, name)))


@dataclass(frozen=True)
class Springs:
    """The springs in the joints of an arm, which deflect under gravity.

    At controller readings r, the true coordinate k is the output of the drive plus the deflection

        compliance_k tau_k(r).

    Here, tau_k is the gravity torque on joint k. The torque is computed from the joint axes and
    masses that the ``Spring`` objects contain.

    Attributes:
        rows: One spring per coordinate, in the order of the coordinates.
        gravity: Gravitational acceleration in the base frame (m/s^2).
    """

    rows: tuple[Spring, ...]
    gravity: Vector = (sp.S.Zero, sp.S.Zero, sp.Rational("-9.81"))

    def __post_init__(self) -> None:
        object.__setattr__(self, "gravity", exact_vector(self.gravity))


@dataclass(frozen=True)
class SerialRobot:
    """A serial chain from a base frame to a tool frame.

    Attributes:
        name: A C identifier, with which all generated names start.
        joints: The joints in order from the base.
        title: Name of the robot in printed texts.
        source: Publication or data sheet with the dimensions.
        base: Pose of the first frame of the chain in the base frame (meter, radian). The first
            joint is placed in the first frame.
        tool: Pose of the tool frame in the frame of the last link (meter, radian).
        base_frame: Name of the base frame, such as ``0`` in ``T_0_ee``.
        tool_frame: Name of the tool frame, such as ``ee`` in ``T_0_ee``.
        parameters: The named parameters in poses, screw pitches and masses.
        notes: Changes and assumptions of the file reader, such as rounded angles.
        cleaning: The numbers that were replaced by exact values. The comparison of two robots
            ignores ``cleaning``.
        load: The masses whose weight deflects elastic joints, or None.
        transmissions: The transmission errors of coordinates with imperfect drives.
        springs: The joint elasticities that determine the true coordinates from controller
            readings. None for rigid joints.
        couplings: The equations of coupled joints. Each moving joint without a coupling has its own
            coordinate.
        motors: The motors that move coupled joints. To limit the own coordinate of a coupled joint,
            the list also contains a motor with the name of this joint.

    Raises:
        DescriptionError: Names are not unique, a symbol is not a parameter, a coupling names an
            unknown coordinate, or no joint has a coordinate.
    """

    name: str
    joints: tuple[Joint, ...]
    title: str = ""
    source: str = ""
    base: Placement = ()
    tool: Placement = ()
    base_frame: str = "0"
    tool_frame: str = "ee"
    parameters: tuple[Parameter, ...] = ()
    notes: tuple[str, ...] = ()
    cleaning: Cleaning = field(default=Cleaning(), repr=False, compare=False)
    load: Load | None = field(default=None, repr=False)
    transmissions: tuple[Transmission, ...] = field(default=(), repr=False)
    springs: Springs | None = field(default=None, repr=False)
    couplings: tuple[Coupling, ...] = field(default=(), repr=False)
    motors: tuple[Motor, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        check_robot_name(self.name)
        self._check_symbols()
        if self.load:
            self.load.check_links(self.name, self.link_names)
        check_unique("joint", [joint.name for joint in self.joints])
        check_unique("link", [joint.link for joint in self.joints if joint.link])
        check_unique("parameter", [parameter.name for parameter in self.parameters])
        self._check_motors()
        if not self.coordinates:
            raise DescriptionError(f"robot {self.name!r}: expected a joint with its own coordinate")
        check_transmissions(self.transmissions, [joint.name for joint in self.coordinates])
        self._check_springs()

    def _check_motors(self) -> None:
        """Check that each coordinate in a coupling is the name of a motor or joint."""
        if not self.couplings and not self.motors:
            return
        check_unique("motor", [motor.name for motor in self.motors])
        own = {joint.name for joint in self.moving} - {rule.joint for rule in self.couplings}
        own |= {rule.joint for rule in self.couplings if rule.has_own}
        known = own | {motor.name for motor in self.motors}
        alone = {joint.name for joint in self.joints} - {
            rule.joint for rule in self.couplings if rule.has_own
        }
        for motor in self.motors:
            if motor.name in alone or motor.name not in self.linear_map.coordinates:
                raise DescriptionError(
                    f"motor {motor.name!r}: expected the coordinate of a coupling, not of a joint "
                    "alone"
                )
        fixed = {joint.name for joint in self.joints if joint.kind == "fixed"}
        for name in self.linear_map.coordinates:
            if name not in known or name in fixed:
                raise DescriptionError(
                    f"unknown coordinate {name!r}; expected a motor or joint: "
                    f"{', '.join(sorted(known - fixed))}"
                )

    def _check_symbols(self) -> None:
        known = {parameter.symbol for parameter in self.parameters}
        placements = [self.base, self.tool]
        placements += [part for joint in self.joints for part in (joint.before, joint.after)]
        used = {symbol for placement in placements for symbol in symbols_of(placement)}
        used |= {symbol for joint in self.joints for symbol in joint.pitch.free_symbols}
        used |= self.load.symbols if self.load else set()
        unknown = sorted(str(symbol) for symbol in used - known)
        if unknown:
            raise DescriptionError(
                f"robot {self.name!r}: expected symbols of its parameters "
                f"(Parameter(name, value).symbol), got {', '.join(unknown)}"
            )

    def _check_springs(self) -> None:
        rows = self.springs.rows if self.springs else ()
        expected = [joint.name for joint in self.coordinates]
        if rows and ([row.coordinate for row in rows] != expected or self.couplings):
            raise DescriptionError(
                f"robot {self.name!r}: expected no coupled joints, and a spring for each "
                f"coordinate in this order: {', '.join(expected)}; a rigid joint has the "
                "compliance 0"
            )

    @property
    def moving(self) -> tuple[Joint, ...]:
        """The moving joints, including the coupled joints, in order from the base."""
        return tuple(joint for joint in self.joints if joint.kind != "fixed")

    @property
    def placements(self) -> tuple[Placement, ...]:
        """All constant poses in order: base, ``before`` and ``after`` of each joint, tool."""
        return (self.base, *(p for j in self.joints for p in (j.before, j.after)), self.tool)

    @property
    def coordinates(self) -> "tuple[Joint | Motor, ...]":
        """The joint or motor of each element of ``q``."""
        if not self.couplings:
            return self.moving
        joints = {joint.name: joint for joint in self.moving}
        motors = {motor.name: motor for motor in self.motors}
        coupled = {rule.joint for rule in self.couplings}
        found: list[Joint | Motor] = []
        for name in self.linear_map.coordinates:
            if name in motors:
                found.append(motors[name])
            elif name in coupled:
                kind: MotorKind = "prismatic" if joints[name].kind == "prismatic" else "revolute"
                found.append(Motor(name, kind))
            else:
                found.append(joints[name])
        return tuple(found)

    @cached_property
    def linear_map(self) -> LinearMap:
        """The map from the coordinates to the moving joints."""
        return linear_map([joint.name for joint in self.moving], self.couplings)

    def is_coupled(self, joint: str) -> bool:
        """Whether a coupling determines the value of the named joint."""
        return any(rule.joint == joint for rule in self.couplings)

    def coupling_of(self, joint: str) -> Coupling:
        """Return the value of the named moving joint as an equation in all coordinates."""
        k = [other.name for other in self.moving].index(joint)
        own = self.linear_map
        return Coupling(joint, tuple(zip(own.coordinates, own.C.row(k), strict=True)), own.c[k])

    @property
    def uncoupled(self) -> "SerialRobot":
        """The same chain without couplings, so that each joint value is a coordinate."""
        return replace(self, couplings=(), motors=(), transmissions=(), springs=None)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of the links, by default ``link1``, ``link2`` and so on."""
        return tuple(joint.link or f"link{k}" for k, joint in enumerate(self.joints, 1))

    def joint_values(self, q: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
        """Return the signed displacements of all moving joints at q (radian or meter)."""
        theta = self.linear_map.at(q) if self.couplings else q
        return tuple(
            joint.direction * value for joint, value in zip(self.moving, theta, strict=True)
        )

    def joint_values_D_q(self) -> sp.ImmutableMatrix:
        """Return the constant Jacobian (moving joints, n) of ``joint_values`` with respect to q."""
        signs = sp.diag(*(joint.direction for joint in self.moving))
        return sp.ImmutableMatrix(signs * self.linear_map.C)


def check_transmissions(transmissions: Sequence[Transmission], coordinates: Sequence[str]) -> None:
    """Raise DescriptionError if the coordinate of a transmission is unknown or occurs twice."""
    check_unique("transmission", [law.coordinate for law in transmissions])
    for law in transmissions:
        check_choice("transmission of", law.coordinate, law.coordinate, coordinates)
