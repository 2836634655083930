"""The geometry of a serial robot as variables: every number that a calibration may correct.

The pose of the tool is a product of elementary motions in the coordinates q and the parameters p:

    T_base_tool = B(p) base  prod_k before_k(p) motion_k(value_k(q, p)) after_k(p)  tool E(p)

The parameters of a joint are the fields of its own convention, except directions, and corrections
of its axis: two tilts and, where it turns, two shifts. B and E correct the frames at both ends.
Corrections are 0 in the nominal robot. Those of all axes and of the tool are a complete and minimal
model of any chain, with 4 parameters a turning and 2 a sliding joint and 6 for the tool. The value
of a joint is

    value = gain q + offset + sin1 sin q + cos1 cos q + sin2 sin 2q + cos2 cos 2q + compliance tau,

of which a sliding joint has no waves; they stand for eccentric encoders and gears. Where the robot
has a load, tau is the torque of gravity on the coordinate, or the force on a slide, in the nominal
arm at q: the joint gives way as a spring does. The torque's own change by the sag is left out, a
product of two small numbers. Fixed joints
keep their numbers, since the joint behind them, or the tool, has parameters in the same place.

Source:
    K. Schroeer, S. Albright, M. Grethlein, Complete, minimal and model-continuous kinematic models
    for robot calibration, Robotics and Computer-Integrated Manufacturing 13 (1997).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import sympy as sp

from .convention import Convention, Field, Placements
from .mechanism import Coordinate, Described
from .placements import Placement, Rotation, Translation, inverse, rotation, translation
from .robot import Joint, SerialRobot

Part = Literal["joint", "offset", "axis", "transmission", "compliance", "loop", "base", "tool"]
"""A joint's own numbers, of which the offset of its coordinate; corrections of its axis; gain and
waves of its drive; its spring under gravity; places of the ends of closures and struts, and lengths
of struts; corrections of the frames at both ends."""
_UNITS = {"length": "m", "lengths": "m", "angle": "rad", "angles": "rad", "direction": "rad"}
_CORRECTION = (
    ("x", "m", "shift along x"),
    ("y", "m", "shift along y"),
    ("z", "m", "shift along z"),
    ("roll", "rad", "turn about x"),
    ("pitch", "rad", "turn about y"),
    ("yaw", "rad", "turn about z"),
)
_DRIVE: Part = "transmission"
_TILTS: tuple[Literal["x", "y"], ...] = ("x", "y")
_TURN = sp.Symbol("turn", real=True)
_WAVES = (
    ("sin1", "sine wave, one a turn", sp.sin(_TURN)),
    ("cos1", "cosine wave, one a turn", sp.cos(_TURN)),
    ("sin2", "sine wave, two a turn", sp.sin(2 * _TURN)),
    ("cos2", "cosine wave, two a turn", sp.cos(2 * _TURN)),
)


@dataclass(frozen=True)
class GeometryParameter:
    """A number of a robot's geometry, an input of its parametric functions.

    Attributes:
        name: Unique: a joint, "base" or "tool", and the number, such as ``elbow_alpha``.
        symbol: Its symbol in the equations.
        value: Its nominal value (metre, radian or 1).
        unit: "m", "rad", or "1" of a gain.
        of: The joint, "base" or "tool".
        part: The part of the model to which it belongs.
        meaning: Its meaning in a few words.
    """

    name: str
    symbol: sp.Symbol
    value: sp.Expr
    unit: str
    of: str
    part: Part
    meaning: str


@dataclass(frozen=True)
class Geometry:
    """The geometry of a serial robot as variables.

    Attributes:
        q: The symbols of the coordinates.
        parameters: The parameters p from the base to the tool.
        motions: The pose of the tool in the base frame, elementary motions in q, p and torques.
        torques: A symbol of the torque of gravity on each coordinate; () where nothing sags.
    """

    q: tuple[sp.Symbol, ...]
    parameters: tuple[GeometryParameter, ...]
    motions: Placement
    torques: tuple[sp.Symbol, ...] = ()


def geometry(robot: SerialRobot, q: Sequence[sp.Symbol]) -> Geometry:
    """The geometry of a serial robot in any conventions, its named parameters at their values.

    Args:
        robot: The description.
        q: A symbol for each coordinate.
    """
    made = Parameters(robot)
    motions = made.corrected("base", "base") + made.at_values(robot.base)
    torques = tuple(sp.symbols(f"tau1:{len(q) + 1}", real=True)) if robot.load else ()
    values = _values(robot, made, q, torques)
    for joint in robot.joints:
        before, after = (joint.before, joint.after) if joint.kind == "fixed" else made.placed(joint)
        motions += made.at_values(before)
        if joint.kind != "fixed":
            motions += moved(joint, values[joint.name], made)
        motions += made.at_values(after)
    motions += made.at_values(robot.tool) + made.corrected("tool", "tool")
    return Geometry(tuple(q), tuple(made.parameters), motions, torques)


class Parameters:
    """The parameters made so far.

    Attributes:
        parameters: They in order.
    """

    def __init__(self, robot: Described) -> None:
        """Begins without any.

        Args:
            robot: The description, whose named parameters keep their values.
        """
        self.parameters: list[GeometryParameter] = []
        self._named = {parameter.symbol: parameter.value for parameter in robot.parameters}

    def new(
        self,
        of: str,
        name: str,
        unit: str,
        meaning: str,
        value: sp.Expr = sp.S.Zero,
        part: Part = "joint",
    ) -> sp.Symbol:
        """The symbol of one more parameter of a joint or another part of the robot."""
        symbol = sp.Symbol(f"p{len(self.parameters) + 1}", real=True)
        nominal = self.at_value(value)
        found = GeometryParameter(f"{of}_{name}", symbol, nominal, unit, of, part, meaning)
        self.parameters.append(found)
        return symbol

    def at_value(self, value: sp.Expr) -> sp.Expr:
        """A number with the values of the robot's named parameters."""
        return value.xreplace(self._named)

    def at_values(self, placement: Placement) -> Placement:
        """A placement with the values of the robot's named parameters."""
        return tuple(
            Rotation(motion.axis, self.at_value(motion.angle))
            if isinstance(motion, Rotation)
            else Translation(tuple(map(self.at_value, motion.vector)))
            for motion in placement
        )

    def corrected(self, of: str, part: Part) -> Placement:
        """A small motion in all six directions, as T(x, y, z) Rz(yaw) Ry(pitch) Rx(roll)."""
        x, y, z, roll, pitch, yaw = (
            self.new(of, name, unit, f"correction: {meaning}", part=part)
            for name, unit, meaning in _CORRECTION
        )
        return (
            translation(x, y, z) + rotation("z", yaw) + rotation("y", pitch) + rotation("x", roll)
        )

    def placed(self, joint: Joint, tilts: str = "xy") -> Placements:
        """The placements of a moving joint with a symbol for each of its numbers.

        Args:
            joint: The joint.
            tilts: The axes of its frame about which its own axis may tilt.
        """
        before, after = joint.before, joint.after
        if joint.convention:
            given = dict(joint.given)
            before, after = joint.convention(
                joint.kind,
                **{
                    f.name: self._field(joint, joint.convention, f, given)
                    for f in joint.convention.fields
                },
            )
        off = self._axis(joint, tilts)
        return before + off, inverse(off) + after

    def _axis(self, joint: Joint, tilts: str) -> Placement:
        """The correction of a joint's axis; shifts of a sliding joint's axis change nothing."""

        def new(name: str, unit: str, meaning: str) -> sp.Symbol:
            return self.new(joint.name, name, unit, f"correction: {meaning}", part="axis")

        shifts: Placement = ()
        if joint.kind != "prismatic":
            x = new("shift_x", "m", "shift of the axis along x")
            y = new("shift_y", "m", "shift of the axis along y")
            shifts = translation(x, y, sp.S.Zero)
        for axis in (axis for axis in _TILTS if axis in tilts):
            shifts += rotation(axis, new(f"tilt_{axis}", "rad", f"tilt of the axis about {axis}"))
        return shifts

    def _field(
        self, joint: Joint, convention: Convention, field: Field, given: Mapping[str, sp.Expr]
    ) -> object:
        if field.kind == "direction":
            return tuple(given[name] for name in field.components)
        unit, meaning = _UNITS[field.kind], f"{field.name} of its {convention.name} description"
        part: Part = "offset" if field.name == convention.variable(joint.kind) else "joint"
        symbols = tuple(
            self.new(joint.name, name, unit, meaning, given[name], part)
            for name in field.components
        )
        return symbols if field.is_vector else symbols[0]


def _values(
    robot: SerialRobot, made: Parameters, q: Sequence[sp.Symbol], torques: Sequence[sp.Symbol]
) -> dict[str, sp.Expr]:
    """The value of each moving joint in q and p; a mimic joint follows its leader's value."""
    leaders = {
        joint.name: driven(joint, coordinate, made)
        for joint, coordinate in zip(robot.coordinates, q, strict=True)
    }
    for joint, torque in zip(robot.coordinates, torques, strict=False):
        leaders[joint.name] += _compliance(joint, made) * torque
    values = {}
    for joint in robot.moving:
        own = leaders[joint.mimic.leader if joint.mimic else joint.name]
        followed = joint.mimic.multiplier * own + joint.mimic.offset if joint.mimic else own
        offset = sp.S.Zero
        if not (joint.convention and joint.convention.variable(joint.kind)):
            offset = made.new(joint.name, "offset", joint.unit, "offset", part="offset")
        values[joint.name] = joint.direction * followed + offset
    return values


def driven(joint: Joint | Coordinate, coordinate: sp.Symbol, made: Parameters) -> sp.Expr:
    """The value of a joint or motor by its drive, before its direction and offset."""
    of, part = joint.name, _DRIVE
    value = made.new(of, "gain", "1", "gain of the drive", sp.S.One, part) * coordinate
    for name, words, wave in _WAVES if joint.unit == "rad" else ():
        value += made.new(of, name, "rad", words, sp.S.Zero, part) * wave.subs(_TURN, coordinate)
    return value


def _compliance(joint: Joint, made: Parameters) -> sp.Symbol:
    """The joint's turn per torque, or its shift per force."""
    unit = "m/N" if joint.unit == "m" else "rad/(N m)"
    return made.new(joint.name, "compliance", unit, "yield to gravity", part="compliance")


def moved(joint: Joint, value: sp.Expr, made: Parameters) -> Placement:
    """The motion of a joint along or about the z axis of its frame."""
    if joint.kind == "prismatic":
        return translation(sp.S.Zero, sp.S.Zero, value)
    if joint.kind == "helical":
        pitch = made.new(joint.name, "pitch", "m/rad", "advance per radian", joint.pitch)
        return rotation("z", value) + translation(sp.S.Zero, sp.S.Zero, pitch * value)
    return rotation("z", value)
