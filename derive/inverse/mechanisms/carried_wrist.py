"""A wrist on a platform whose loops couple its position with its orientation, such as a 3-RPS.

Each of three legs keeps a ball joint in a plane that is fixed to the base. The joints on the
platform are revolute, and their axes meet in the wrist center c. The tool pose determines the
position w of the wrist center in the base frame. The platform rotation R is unknown. With the unit
normal n_i and the offset d_i of plane i, and the ball joint b_i on the platform, the planes give

    n_i . R (b_i - c) = d_i - n_i . w,   i = 1, 2, 3.

After the first equation, two angles of R are unknown. R maps the direction of b_1 - c to the
direction with the azimuth alpha about n_1, and rotates by beta about this direction. The other two
equations are linear in cos(beta) and sin(beta). Their resultant is a trigonometric polynomial of
degree 4 in alpha, so that there are at most eight rotations. Handwritten C code computes the
rotations. The function ``ik_legs`` solves the legs and the wrist for each platform pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ...chain.coordinates import InProportion
from ...chain.groups import groups
from ...chain.kinematics import Kinematics
from ...loops.model.body_frames import pose_along
from ...loops.model.planes import Loop, loops
from ...loops.solve.solved_loops import SolvedLoops
from ...model.mechanism import Closure, Frame
from ...model.robot import SerialRobot
from ...model.tolerances import EXACT_STRUCTURE
from ...terms.symbolic_function import Argument, SymbolicFunction, Tables
from ...terms.terms import Terms
from ...terms.vectors import IDENTITY, Vector, cross, dot, subtracted
from ..arms.loop_arm import structure_of
from ..chain_solution import solve_chain
from ..classify import Attempt
from ..steps.rotations import last_turn, three_turns, two_turns
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import Axis, Lines, axes_of, home_of, numbers
from ..structure.words import listed
from ..tasks.slots import POSE_SYMBOLS, values_of
from .differences import FloatArray

SOLVER = "carried_wrist"
PLATFORM = Argument(
    "P",
    tuple(sp.Symbol(f"_P{i}{j}", real=True) for i in range(1, 5) for j in range(1, 5)),
    (4, 4),
    "1, m",
    "pose of the platform",
)
ROTATIONS = 8
"""Maximum number of platform rotations at a tool pose."""
LEGS, LEG_JOINTS, TURNS = 3, 2, 3
"""Number of legs, joints per leg before its ball joint, and maximum number of wrist joints."""
FREE = 6
"""Number of virtual joints of a platform. If the main chain contains a leg instead of virtual
joints, the leg has five joints.
"""


@dataclass(frozen=True)
class CarriedWristTables(Tables):
    """The fields of the C struct ``chasles_carried_wrist_arm`` after its function pointers.

    Attributes:
        slots: Number of solution slots per platform pose.
        coordinates: Number of actuated coordinates.
        size: Length of the mechanism (meter).
        normals: Unit normal of each plane, in base axes.
        offsets: Distance of each plane from the base origin (meter).
        levers: Direction from the wrist center to each ball joint, in platform axes.
        lengths: Distance between the wrist center and each ball joint (meter).
        center: The wrist center in the platform frame (meter).
        tool_center: The wrist center in the tool frame (meter).
    """

    slots: int
    coordinates: int
    size: float
    normals: tuple[tuple[float, ...], ...]
    offsets: tuple[float, ...]
    levers: tuple[tuple[float, ...], ...]
    lengths: tuple[float, ...]
    center: tuple[float, ...]
    tool_center: tuple[float, ...]


@dataclass(frozen=True)
class Plane:
    """The plane of a leg: its normal and offset in the base frame, and the ball on the platform."""

    normal: FloatArray
    offset: float
    ball: FloatArray


@dataclass(frozen=True)
class CarriedWrist:
    """A main chain that consists of a platform and a wrist.

    Attributes:
        whole: The main chain.
        platform: The virtual joints of the platform, or the leg that carries it.
        wrist: The joints on the platform, as a serial robot whose base is the platform.
        lines: The axes of the platform's joints.
        found: The structure of these axes.
        axes: The axes of the wrist.
        planes: The planes of the three ball joints.
    """

    whole: SerialRobot
    platform: SerialRobot
    wrist: SerialRobot
    lines: Lines
    found: Attempt
    axes: Lines
    planes: tuple[Plane, ...]

    given = ()
    """No joint value is an input of the inverse."""

    @property
    def center(self) -> FloatArray:
        """The wrist center in the platform frame (meter)."""
        return _center(self.axes)

    def coordinates(self, work: Work) -> tuple[tuple[Argument, ...], list[sp.Expr]]:
        """Returns the platform pose as an argument, and the coordinates of all joints.

        Args:
            work: Table that receives the signs and the solution steps.
        """
        values = []
        for solve, entries in ((self.place, PLATFORM.symbols), (self.turn, self._seen(work))):
            own = replace(work, turns={}, lengths={})
            values += solve(own, entries)
            work.choices = own.choices
        moving = zip(self.whole.moving, values, strict=True)
        return (PLATFORM,), [joint.direction * value for joint, value in moving]

    def place(self, work: Work, entries: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Solves for the joints of the platform at a pose, given by its entries."""
        home = home_of(self.platform, work.terms)
        solve_chain(work, self.lines, self.found, of_pose(work.terms, entries, home), {})
        return values_of(work, self.platform, {})

    def turn(self, work: Work, entries: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Solves for the joints of the wrist at a tool pose relative to the platform."""
        target = of_pose(work.terms, entries, home_of(self.wrist, work.terms))
        terms, axes = work.terms, self.axes.axes

        def wanted(v: Vector) -> Vector:
            return target.turned(terms, v)

        if len(axes) == TURNS:
            three_turns(work, (axes[0], axes[1], axes[2]), wanted)
        elif len(axes) > 1:
            two_turns(work, (axes[0], axes[1]), wanted)
        else:
            e = cross(terms, axes[0].h, IDENTITY[int(np.argmin(np.abs(axes[0].direction)))])
            last_turn(work, axes[0], e, wanted(e), [])
        return values_of(work, self.wrist, {})

    def platform_pose(self, h: SolvedLoops) -> SymbolicFunction:
        """Returns the platform pose as a function of the main-chain joints."""
        motion = InProportion(h.robot, h.terms, h.theta)
        values = motion.values[: len(self.platform.moving)]
        found = groups(self.platform, h.terms, values)
        arguments = {f"q{d}": h.arguments[f"theta{d}"] for d in ("", "d", "dd")}
        return Kinematics.of(self.platform, h.terms, found, motion, arguments).function("fk")

    def tables(self, slots: int, coordinates: int, size: float) -> CarriedWristTables:
        """Returns the tables of the C solver.

        Args:
            slots: Number of solution slots per platform pose.
            coordinates: Number of actuated coordinates.
            size: Length of the mechanism (meter).
        """
        center = self.center
        x, y, z, at = _home(self.wrist, self.axes.terms)
        levers = [plane.ball - center for plane in self.planes]
        lengths = [float(np.linalg.norm(lever)) for lever in levers]
        return CarriedWristTables(
            slots,
            coordinates,
            size,
            tuple(_floats(plane.normal) for plane in self.planes),
            tuple(plane.offset for plane in self.planes),
            tuple(_floats(m / length) for m, length in zip(levers, lengths, strict=True)),
            tuple(lengths),
            _floats(center),
            _floats(np.array([x, y, z]) @ (center - at)),
        )

    def _seen(self, work: Work) -> list[sp.Expr]:
        """Returns the entries of the tool pose, relative to the platform."""
        terms, P = work.terms, PLATFORM.symbols
        axes = [(P[j], P[4 + j], P[8 + j]) for j in range(3)]
        x, y, z, p = ((T[j], T[4 + j], T[8 + j]) for T in [POSE_SYMBOLS] for j in range(4))
        columns = [x, y, z, subtracted(terms, p, (P[3], P[7], P[11]))]
        rows = [[dot(terms, axis, column) for column in columns] for axis in axes]
        return [entry for row in (*rows, [sp.S.Zero] * 3 + [sp.S.One]) for entry in row]


def carried_wrist(h: SolvedLoops) -> CarriedWrist | None:
    """Returns the platform and the wrist of a main chain, or None if the chain has another form.

    Args:
        h: The robot.
    """
    found = _found(h)
    return found if isinstance(found, CarriedWrist) else None


def missing(h: SolvedLoops) -> str:
    """Returns the reason why a platform on loops that carries further joints has no ``ik``.

    The text is empty if the chain is a platform with a wrist.
    """
    found = _found(h)
    if isinstance(found, CarriedWrist):
        return ""
    actuated = {c.moves for c in h.mechanism.coordinates}
    coupled = [joint.name for joint in h.robot.moving if joint.name not in actuated]
    couple = f"the loops couple {listed(coupled)}, so that " if coupled else ""
    return f"{couple}a pose of the tool does not determine the platform in closed form: {found}"


def keeps_planes(h: SolvedLoops) -> bool:
    """Whether the main chain is a platform with joints, and each leg keeps a ball in a plane."""
    parts = _parts(h)
    return not isinstance(parts, str) and not isinstance(_planes(h, parts[0]), str)


def _parts(h: SolvedLoops) -> tuple[SerialRobot, SerialRobot] | str:
    """Returns the joints before and on a platform, or the condition that fails."""
    m, chain = h.mechanism, h.mechanism.path_to(h.mechanism.tool_body)
    ends = {frame.body for item in m.loop_joints for frame in (item.a, item.b)}
    bodies = [joint.link for joint in chain if joint.link in ends]
    if len(bodies) != 1:
        return f"the main chain must have one body at which legs end, but it has {len(bodies)}"
    count = 1 + [joint.link for joint in chain].index(bodies[0])
    platform = replace(h.robot, joints=h.robot.joints[:count], tool=())
    wrist = replace(h.robot, joints=h.robot.joints[count:], base=())
    if not platform.moving or not wrist.moving:
        return f"no joint moves {'the' if wrist.moving else 'the tool on the'} body {bodies[0]}"
    return platform, wrist


def _found(h: SolvedLoops) -> CarriedWrist | str:
    """Returns the platform and the wrist of a main chain, or the condition that fails."""
    parts = _parts(h)
    if isinstance(parts, str):
        return parts
    platform, wrist = parts
    axes = Lines(h.terms, axes_of(wrist, h.terms))
    planes = _planes(h, platform)
    why = planes if isinstance(planes, str) else _unlike_wrist(wrist, axes)
    if isinstance(planes, str) or why:
        return why
    needed, body = LEGS + len(axes.axes), platform.joints[-1].link
    if len(h.q) != needed:
        return f"the robot must have {needed} actuated coordinates, but it has {len(h.q)}"
    structure, center = structure_of(platform, h.terms), _center(axes)
    least = min(float(np.linalg.norm(plane.ball - center)) for plane in planes)
    if structure is None:
        return f"the pose of {body} does not determine its joints in closed form"
    if least <= EXACT_STRUCTURE * h.numbers.size:
        return f"the axes of {listed(_names(wrist))} meet in the center of a ball joint"
    return CarriedWrist(h.robot, platform, wrist, *structure, axes, planes)


def _planes(h: SolvedLoops, platform: SerialRobot) -> tuple[Plane, ...] | str:
    """Returns the planes of the three ball joints, or the condition that fails."""
    found = {
        f"the leg that ends at {loop.loop_joint.name}": _plane(h, loop)
        for loop in loops(h.mechanism)
    }
    if len(platform.moving) != FREE:
        found[f"the leg of {listed(_names(platform))}"] = _plane_of_chain(platform, h.terms)
    if len(found) != LEGS:
        return f"the platform must have {LEGS} legs, but it has {len(found)}"
    planes = tuple(plane for plane in found.values() if plane is not None)
    if len(planes) == LEGS:
        return planes
    others = listed([leg for leg, plane in found.items() if plane is None])
    return f"each leg must keep a ball joint in a plane, unlike {others}"


def _unlike_wrist(wrist: SerialRobot, axes: Lines) -> str:
    """Returns the condition that the joints on a platform do not meet, or an empty text."""
    names = _names(wrist)
    slides = [name for name, axis in zip(names, axes.axes, strict=True) if not axis.turns]
    if len(names) > TURNS:
        return f"the platform may carry {TURNS} joints, but it carries {listed(names)}"
    if slides:
        return f"the joints on the platform must be revolute, unlike {listed(slides)}"
    if len(names) > 1 and not axes.meet(*range(len(names))):
        return f"the axes of {listed(names)} do not meet in one point"
    return ""


def _names(robot: SerialRobot) -> list[str]:
    return [joint.name for joint in robot.moving]


def _center(axes: Lines) -> FloatArray:
    """Returns the point in which the axes meet, or a point of a single axis (meter)."""
    if len(axes.axes) == 1:
        return axes.axes[0].origin
    return numbers(axes.terms, axes.meeting(0, 1))


def _plane(h: SolvedLoops, loop: Loop) -> Plane | None:
    """Returns the plane in which a leg's end ball moves, or None if the ball is not in a plane."""
    closure, chain = loop.loop_joint, {joint.name for joint in h.robot.joints}
    if not isinstance(closure, Closure) or closure.kind != "ball":
        return None
    for leg, own, other in (
        (loop.to_a, closure.a, closure.b),
        (loop.to_b, closure.b, closure.a),
    ):
        if chain.isdisjoint(joint.name for joint in leg):
            return _plane_of_leg(h, own, other)
    return None


def _plane_of_leg(h: SolvedLoops, own: Frame, other: Frame) -> Plane | None:
    """Returns the plane in which the ball joint at the end of a leg moves.

    Args:
        h: The robot.
        own: The frame of the ball joint on the leg.
        other: The frame of the ball joint on the platform.
    """
    m = h.mechanism
    joints = tuple(replace(joint, parent="") for joint in m.path_to(own.body))
    leg = SerialRobot(m.name, joints, base=m.base, tool=own.placement, parameters=m.parameters)
    axes = axes_of(leg, h.terms)
    normal = _normal(axes) if len(axes) == LEG_JOINTS else None
    if normal is None:
        return None
    *_, ball = _home(leg, h.terms)
    _, point = pose_along(m, h.terms, (), other.placement, {})
    return Plane(normal, float(normal @ ball), numbers(h.terms, point))


def _plane_of_chain(platform: SerialRobot, terms: Terms) -> Plane | None:
    """Returns the plane in which the ball joint of a leg in the main chain moves.

    The last three axes of the leg are the ball joint.
    """
    lines = Lines(terms, axes_of(platform, terms))
    if len(lines.axes) != LEG_JOINTS + TURNS or not all(a.turns for a in lines.axes[LEG_JOINTS:]):
        return None
    normal = _normal(lines.axes[:LEG_JOINTS])
    if normal is None or not lines.meet(*range(LEG_JOINTS, LEG_JOINTS + TURNS)):
        return None
    ball = numbers(terms, lines.meeting(LEG_JOINTS, LEG_JOINTS + 1))
    x, y, z, at = _home(platform, terms)
    return Plane(normal, float(normal @ ball), np.array([x, y, z]) @ (ball - at))


def _normal(axes: Sequence[Axis]) -> FloatArray | None:
    """Returns the normal of the plane in which the joints of a leg move points, or None."""
    normal = next((axis.direction for axis in axes if axis.turns), None)
    return normal if normal is not None and all(_keeps(a, normal) for a in axes) else None


def _keeps(axis: Axis, normal: FloatArray) -> bool:
    """Whether a joint moves points in a plane with this normal."""
    if axis.turns:
        return float(np.linalg.norm(np.cross(axis.direction, normal))) <= EXACT_STRUCTURE
    return axis.kind == "prismatic" and abs(float(axis.direction @ normal)) <= EXACT_STRUCTURE


def _home(robot: SerialRobot, terms: Terms) -> list[FloatArray]:
    """Returns the axes and the origin of the tool with all joints at zero."""
    return [numbers(terms, column[:3]) for column in home_of(robot, terms).T.tolist()]


def _floats(vector: FloatArray) -> tuple[float, ...]:
    return tuple(map(float, vector))
