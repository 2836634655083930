"""The geometry of a serial robot as variables that a calibration may correct.

The pose of the tool is a product of motions that depend on the coordinates q and the parameters p.

    T_base_tool = B(p) base  prod_k before_k(p) motion_k(value_k(q, p)) after_k(p)  tool E(p)

The named parameters of the description come first. A named parameter changes all values that
contain the parameter. Each joint also has two other kinds of parameters: the corrections of its
axis, and the numeric fields of its convention except directions. The axis corrections are two tilts
and, for a revolute joint, two shifts. B and E correct the base frame and the tool frame. All
corrections are 0 in the nominal robot. For any chain, the corrections of the axes and the tool are
a complete and minimal set of geometric parameters. There are 4 parameters per revolute joint, 2 per
prismatic joint, and 6 for the tool. The value of a joint is a function of the coordinate q and the
torque tau.

    value = gain q + offset + sin1 sin q + cos1 cos q + sin2 sin 2q + cos2 cos 2q + compliance tau.

The sine and cosine waves model eccentric encoders and gears. For prismatic joints, the amplitudes
of the sine and cosine waves are 0. If the robot has a load, tau is the gravity torque or force on
the coordinate. The value of tau is computed for the nominal robot at q. A load deflects the joint
like a spring. The deflection also changes the torque. The effect of the torque change is of second
order and neglected. Fixed joints have no parameters, because the parameters of the next joint or
the tool have the same effect.

Source:
    K. Schroeer, S. Albright, M. Grethlein, Complete, minimal and model-continuous kinematic models
    for robot calibration, Robotics and Computer-Integrated Manufacturing 13 (1997).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import sympy as sp

from .convention import Convention, Field, Placements
from .mechanism import Coordinate, Described
from .placements import Placement, Rotation, Translation, inverse, rotation, translation
from .robot import Joint, Motor, SerialRobot

Part = Literal[
    "parameter",
    "joint",
    "offset",
    "axis",
    "transmission",
    "coupling",
    "compliance",
    "loop",
    "base",
    "tool",
]
"""Groups of parameters. The group ``joint`` contains the values of a joint, and ``loop``
contains end positions and strut lengths."""
_PARAMETER = "_parameter"
"""Suffix that makes a parameter name unique if the name is already used."""
_UNIT_OF_KIND = {"length": "m", "angle": "rad"}
_UNITS = {"length": "m", "lengths": "m", "angle": "rad", "angles": "rad", "direction": "rad"}
_CORRECTION = (
    ("x", "m", "shift along x"),
    ("y", "m", "shift along y"),
    ("z", "m", "shift along z"),
    ("roll", "rad", "rotation about x"),
    ("pitch", "rad", "rotation about y"),
    ("yaw", "rad", "rotation about z"),
)
_DRIVE: Part = "transmission"
_TILTS: tuple[Literal["x", "y"], ...] = ("x", "y")
_TURN = sp.Symbol("turn", real=True)
_WAVES = (
    ("sin1", "sine wave, one period per revolution", sp.sin(_TURN)),
    ("cos1", "cosine wave, one period per revolution", sp.cos(_TURN)),
    ("sin2", "sine wave, two periods per revolution", sp.sin(2 * _TURN)),
    ("cos2", "cosine wave, two periods per revolution", sp.cos(2 * _TURN)),
)


@dataclass(frozen=True)
class GeometryParameter:
    """A geometric parameter, which is an input of the parametric functions.

    Attributes:
        name: Unique name, such as ``elbow_alpha``. The name consists of a joint name, "base" or
            "tool", followed by the name of a quantity.
        symbol: The symbol in the equations.
        value: The nominal value (meter, radian or 1).
        unit: "m", "rad", "1" for a gain, or for example "m/rad" for a ratio.
        joint: The name of the joint, or "base" or "tool".
        part: The group of the parameter.
        meaning: Meaning in a few words.
    """

    name: str
    symbol: sp.Symbol
    value: sp.Expr
    unit: str
    joint: str
    part: Part
    meaning: str


@dataclass(frozen=True)
class Geometry:
    """The geometry of a serial robot as variables.

    Attributes:
        q: The symbols of the coordinates.
        parameters: The parameters p from the base to the tool.
        motions: The pose of the tool in the base frame, as motions in q, p and the torques.
        torques: A symbol for the gravity torque on each coordinate. The tuple is empty for rigid
            joints.
    """

    q: tuple[sp.Symbol, ...]
    parameters: tuple[GeometryParameter, ...]
    motions: Placement
    torques: tuple[sp.Symbol, ...] = ()


def geometry(robot: SerialRobot, q: Sequence[sp.Symbol]) -> Geometry:
    """Return the geometry of a serial robot.

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
    """Collects the parameters of a robot.

    Attributes:
        parameters: The parameters in the order of p.
    """

    def __init__(self, robot: Described) -> None:
        """Start without parameters.

        Args:
            robot: A description whose named parameters have constant values.
        """
        self.parameters: list[GeometryParameter] = []
        self._nominal = {parameter.symbol: parameter.value for parameter in robot.parameters}
        self._varied: dict[sp.Symbol, sp.Symbol] = {}
        for named in robot.parameters:
            unit = _UNIT_OF_KIND.get(named.kind, "1")
            meaning = named.meaning or "parameter of the description"
            name = named.name + _PARAMETER * (named.name in get_args(Part))
            self._varied[named.symbol] = self._added(
                name, unit, "", meaning, named.value, "parameter"
            )

    def new(
        self,
        joint: str,
        name: str,
        unit: str,
        meaning: str,
        value: sp.Expr = sp.S.Zero,
        part: Part = "joint",
    ) -> sp.Expr:
        """Create a parameter and return an expression that equals `value` by default.

        If `value` contains a named parameter, the expression depends on this parameter and on the
        new parameter.
        """
        nominal = value.xreplace(self._nominal)
        symbol = self._added(f"{joint}_{name}", unit, joint, meaning, nominal, part)
        moved = self.at_value(value)
        return symbol if moved == nominal else symbol + (moved - nominal)

    def _added(
        self, name: str, unit: str, joint: str, meaning: str, nominal: sp.Expr, part: Part
    ) -> sp.Symbol:
        symbol = sp.Symbol(f"p{len(self.parameters) + 1}", real=True)
        for k, other in enumerate(self.parameters):
            if other.name == name:
                self.parameters[k] = replace(other, name=name + _PARAMETER)
        found = GeometryParameter(name, symbol, nominal, unit, joint, part, meaning)
        self.parameters.append(found)
        return symbol

    def at_value(self, value: sp.Expr) -> sp.Expr:
        """Replace the named parameters in an expression by symbols p."""
        return value.xreplace(self._varied)

    def at_values(self, placement: Placement) -> Placement:
        """Replace the named parameters in a placement by symbols p."""
        return tuple(
            Rotation(motion.axis, self.at_value(motion.angle))
            if isinstance(motion, Rotation)
            else Translation(tuple(map(self.at_value, motion.vector)))
            for motion in placement
        )

    def corrected(self, joint: str, part: Part) -> Placement:
        """Return T(x, y, z) Rz(yaw) Ry(pitch) Rx(roll), a correction with six parameters."""
        x, y, z, roll, pitch, yaw = (
            self.new(joint, name, unit, f"correction: {meaning}", part=part)
            for name, unit, meaning in _CORRECTION
        )
        return (
            translation(x, y, z) + rotation("z", yaw) + rotation("y", pitch) + rotation("x", roll)
        )

    def placed(self, joint: Joint, tilts: str = "xy") -> Placements:
        """Return the placements of a moving joint with a symbol for each value.

        Args:
            joint: The joint.
            tilts: The axes about which the joint axis may tilt.
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
        """Return the correction of a joint axis.

        A prismatic axis has no shift parameters.
        """

        def new(name: str, unit: str, meaning: str) -> sp.Expr:
            return self.new(joint.name, name, unit, f"correction: {meaning}", part="axis")

        shifts: Placement = ()
        if joint.kind != "prismatic":
            x = new("shift_x", "m", "axis shift along x")
            y = new("shift_y", "m", "axis shift along y")
            shifts = translation(x, y, sp.S.Zero)
        for axis in (axis for axis in _TILTS if axis in tilts):
            shifts += rotation(axis, new(f"tilt_{axis}", "rad", f"axis tilt about {axis}"))
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
    """Return the value of each moving joint as a function of q and p."""
    driven_q = [
        driven(joint, coordinate, made)
        for joint, coordinate in zip(robot.coordinates, q, strict=True)
    ]
    for k, (joint, torque) in enumerate(zip(robot.coordinates, torques, strict=False)):
        driven_q[k] += _compliance(joint, made) * torque
    theta = _coupled(robot, made, driven_q) if robot.couplings else driven_q
    values = {}
    for joint, followed in zip(robot.moving, theta, strict=True):
        offset = sp.S.Zero
        if not (joint.convention and joint.convention.variable(joint.kind)):
            offset = made.new(joint.name, "offset", joint.unit, "offset", part="offset")
        values[joint.name] = joint.direction * followed + offset
    return values


def _coupled(
    robot: SerialRobot, made: Parameters, driven_q: Sequence[sp.Expr]
) -> tuple[sp.Expr, ...]:
    """Return the joint values as functions of the coordinates.

    Each nonzero coupling ratio becomes a new parameter.
    """
    own, C = robot.linear_map, robot.linear_map.C.as_mutable()
    for j, joint in enumerate(robot.moving):
        if not robot.is_coupled(joint.name):
            continue
        for k, coordinate in enumerate(robot.coordinates):
            if C[j, k] != 0:
                unit = "1" if joint.unit == coordinate.unit else f"{joint.unit}/{coordinate.unit}"
                name, words = f"per_{coordinate.name}", f"motion per unit of {coordinate.name}"
                C[j, k] = made.new(joint.name, name, unit, words, C[j, k], "coupling")
    return replace(own, C=sp.ImmutableMatrix(C)).at(driven_q)


def driven(joint: Joint | Coordinate | Motor, coordinate: sp.Symbol, made: Parameters) -> sp.Expr:
    """Return the drive output of a joint or motor.

    The direction and offset are not applied.
    """
    value = made.new(joint.name, "gain", "1", "gain of the drive", sp.S.One, _DRIVE) * coordinate
    for name, words, wave in _WAVES if joint.unit == "rad" else ():
        amplitude = made.new(joint.name, name, "rad", words, sp.S.Zero, _DRIVE)
        value += amplitude * wave.subs(_TURN, coordinate)
    return value


def _compliance(joint: Joint | Motor, made: Parameters) -> sp.Expr:
    """Return the symbol of a compliance (rotation per torque, or translation per force)."""
    unit = "m/N" if joint.unit == "m" else "rad/(N m)"
    return made.new(joint.name, "compliance", unit, "yield to gravity", part="compliance")


def moved(joint: Joint, value: sp.Expr, made: Parameters) -> Placement:
    """Return the motion of a joint along the z axis of its frame."""
    if joint.kind == "prismatic":
        return translation(sp.S.Zero, sp.S.Zero, value)
    if joint.kind == "helical":
        pitch = made.new(joint.name, "pitch", "m/rad", "advance per radian", joint.pitch)
        return rotation("z", value) + translation(sp.S.Zero, sp.S.Zero, pitch * value)
    return rotation("z", value)
