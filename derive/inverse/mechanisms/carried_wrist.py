"""Wrist on a platform, such as a 3-RPS, whose loops couple its position with its orientation.

Each of three legs keeps a ball joint in a plane that is fixed to the base. The joints on the
platform are revolute, and their axes meet in the wrist center c. The tool pose determines the
position w of the wrist center in the base frame. The platform rotation R is unknown. The plane of
leg i has the unit normal n_i and the offset d_i, and contains the ball joint at b_i on the
platform. The condition that the ball joint at b_i lies in the plane of leg i is the equation

    n_i . R (b_i - c) = d_i - n_i . w,   i = 1, 2, 3.

The equation for i = 1 leaves two angles of the platform rotation R unknown. The rotation R maps the
direction of b_1 - c to the direction with the azimuth alpha about n_1, and rotates by beta about
this direction. The equations for i = 2 and i = 3 are linear in cos(beta) and sin(beta). The
resultant of these two equations is a trigonometric polynomial of degree 4 in alpha, so at most
eight platform rotations exist. Handwritten C code computes the platform rotations. For each
platform pose, the function ``ik_legs`` solves for the joints of the legs and the wrist.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ...chain.coordinates import InProportion
from ...chain.groups import groups
from ...chain.kinematics import Kinematics
from ...loops.model.body_frames import relative_entries
from ...loops.solve.solved_loops import SolvedLoops
from ...model.robot import SerialRobot
from ...model.tolerances import EXACT_STRUCTURE
from ...terms.symbolic_function import Argument, SymbolicFunction, Tables
from ...terms.vectors import IDENTITY, Vector, cross
from ..steps.rotations import last_turn, three_turns, two_turns
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import Lines, axes_of, home_of, numbers
from ..tasks.slots import values_of
from .carried_platform import TOOL, TURNS, CarriedPlatform, carried_platform, home, pose_of_entries
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


@dataclass(frozen=True)
class CarriedWristTables(Tables):
    """The fields of the C struct ``chasles_carried_wrist_arm`` after its function pointers.

    Attributes:
        slots: Number of solution slots per platform pose.
        coordinates: Number of actuated coordinates.
        size: Length of the mechanism (meter).
        normals: Unit normal of the plane of each leg, in base axes.
        offsets: Distance of the plane of each leg from the base origin (meter).
        levers: Unit vector from the wrist center to each ball joint, in platform axes.
        lengths: Distance between the wrist center and each ball joint (meter).
        center: Position of the wrist center in the platform frame (meter).
        tool_center: Position of the wrist center in the tool frame (meter).
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
class CarriedWrist:
    """A main chain that consists of a platform and a wrist.

    Attributes:
        whole: The main chain.
        carried: The platform.
        wrist: The joints on the platform, as a serial robot whose base is the platform.
        axes: The axes of the wrist.
    """

    whole: SerialRobot
    carried: CarriedPlatform
    wrist: SerialRobot
    axes: Lines

    given = ()
    """Indices of the joints whose values are inputs of ``ik``: none for a wrist on a platform."""
    solver, solutions, label = SOLVER, ROTATIONS, "platform rotation"
    """Name of the C solver, its maximum number of solutions, and the name of a solution."""

    def arguments(self) -> tuple[Argument, ...]:
        """Return no arguments, because no joint values are inputs of ``ik``."""
        return ()

    @property
    def center(self) -> FloatArray:
        """The wrist center in the platform frame (meter)."""
        return _center(self.axes)

    def coordinates(self, work: Work) -> tuple[tuple[Argument, ...], list[sp.Expr]]:
        """Return (extra arguments of ``ik_legs``, coordinates of the main chain).

        The only extra argument is the platform pose.

        Args:
            work: Object that receives the branch signs and the solution steps.
        """
        values, platform = [], pose_of_entries(PLATFORM.symbols)
        seen = relative_entries(work.terms, platform, TOOL)
        for solve, entries in ((self.carried.place, PLATFORM.symbols), (self.turn, seen)):
            own = replace(work, turns={}, lengths={})
            values += solve(own, entries)
            work.choices = own.choices
        moving = zip(self.whole.moving, values, strict=True)
        return (PLATFORM,), [joint.direction * value for joint, value in moving]

    def turn(self, work: Work, entries: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Solve for the joints of the wrist at a tool pose relative to the platform."""
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
        """Return the platform pose as a function of the main-chain joints."""
        motion = InProportion(h.robot, h.terms, h.theta)
        platform = self.carried.platform
        found = groups(platform, h.terms, motion.values[: len(platform.moving)])
        arguments = {f"q{d}": h.arguments[f"theta{d}"] for d in ("", "d", "dd")}
        return Kinematics.of(platform, h.terms, found, motion, arguments).function("fk")

    def tables(self, slots: int, coordinates: int, size: float) -> CarriedWristTables:
        """Return the tables of the C solver.

        Args:
            slots: Number of solution slots per platform pose.
            coordinates: Number of actuated coordinates.
            size: Length of the mechanism (meter).
        """
        center = self.center
        x, y, z, at = home(self.wrist, self.axes.terms)
        levers = [plane.ball - center for plane in self.carried.planes]
        lengths = [float(np.linalg.norm(lever)) for lever in levers]
        return CarriedWristTables(
            slots,
            coordinates,
            size,
            tuple(_floats(plane.normal) for plane in self.carried.planes),
            tuple(plane.offset for plane in self.carried.planes),
            tuple(_floats(m / length) for m, length in zip(levers, lengths, strict=True)),
            tuple(lengths),
            _floats(center),
            _floats(np.array([x, y, z]) @ (center - at)),
        )


def carried_wrist(h: SolvedLoops) -> CarriedWrist | None:
    """Return the platform and the wrist of a main chain, or None if the chain has another form.

    Args:
        h: The robot.
    """
    carried = carried_platform(h)
    if isinstance(carried, str) or any(joint.kind != "fixed" for joint in carried.before):
        return None
    count = len(h.robot.joints) - len(carried.behind)
    wrist = replace(h.robot, joints=h.robot.joints[count:], base=())
    axes = Lines(h.terms, axes_of(wrist, h.terms))
    if not _meet(axes):
        return None
    least = min(float(np.linalg.norm(plane.ball - _center(axes))) for plane in carried.planes)
    if least <= EXACT_STRUCTURE * h.numbers.size:
        return None
    return CarriedWrist(h.robot, carried, wrist, axes)


def _meet(axes: Lines) -> bool:
    """Whether one to three revolute axes meet in a point."""
    if not all(axis.turns for axis in axes.axes) or not 0 < len(axes.axes) <= TURNS:
        return False
    return len(axes.axes) == 1 or axes.meet(*range(len(axes.axes)))


def _center(axes: Lines) -> FloatArray:
    """Return the point in which wrist axes meet, or a point on a single wrist axis (meter)."""
    if len(axes.axes) == 1:
        return axes.axes[0].origin
    return numbers(axes.terms, axes.meeting(0, 1))


def _floats(vector: FloatArray) -> tuple[float, ...]:
    return tuple(map(float, vector))
