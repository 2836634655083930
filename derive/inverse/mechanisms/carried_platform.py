"""Main chain with a platform on three legs, such as a 3-RPS.

Each leg keeps a ball joint of the platform in a plane.

Further joints may be on the platform, or between the base and the body at which the legs start.
With such further joints, the tool pose does not directly determine the platform pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ...chain.forward import Pose
from ...loops.model.body_frames import pose_along
from ...loops.model.planes import Loop, loops
from ...loops.solve.solved_loops import SolvedLoops
from ...model.mechanism import Closure, Frame
from ...model.robot import Joint, SerialRobot
from ...model.tolerances import EXACT_STRUCTURE
from ...terms.terms import Terms
from ..arms.loop_arm import structure_of
from ..chain_solution import solve_chain
from ..classify import Attempt
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import Axis, Lines, axes_of, home_of, numbers
from ..structure.words import listed
from ..tasks.slots import POSE_SYMBOLS, values_of
from .differences import FloatArray

LEGS, LEG_JOINTS, TURNS = 3, 2, 3
"""Number of legs, number of joints per leg before the ball joint, and number of axes of a ball
joint."""
FREE = 6
"""Number of virtual joints that move a platform freely. If the main chain passes through a leg of
the platform, the five joints of this leg take the place of the virtual joints."""
Path = tuple[Joint, ...]


def pose_of_entries(entries: Sequence[sp.Expr]) -> Pose:
    """Return the axes and the origin of a pose, given its sixteen matrix entries in row order."""
    x, y, z, p = ((entries[j], entries[4 + j], entries[8 + j]) for j in range(4))
    return (x, y, z), p


TOOL = pose_of_entries(POSE_SYMBOLS)
"""Axes and origin of the target pose of the tool, as symbols."""


@dataclass(frozen=True)
class Plane:
    """The plane in which a leg keeps a ball joint, and the ball joint's position on the platform.

    Attributes:
        normal: Unit normal of the plane, in the axes of the body at which the legs start.
        offset: Distance of the plane from the origin of the body at which the legs start (meter),
            positive along `normal`.
        ball: Position of the ball joint in the platform frame (meter).
    """

    normal: FloatArray
    offset: float
    ball: FloatArray


@dataclass(frozen=True)
class CarriedPlatform:
    """A main chain that contains a platform.

    Each leg of the platform keeps a ball joint in a plane.

    Attributes:
        before: All joints, including fixed joints, before the body at which the legs start.
        platform: Serial robot with the virtual joints of a free platform, or with the joints of the
            leg in the main chain.
        behind: All joints after the platform, including fixed joints.
        lines: Axes of the joints in `platform`.
        found: The detected structure of the axes in `lines`.
        planes: Planes in which the three legs keep their ball joints.
    """

    before: Path
    platform: SerialRobot
    behind: Path
    lines: Lines
    found: Attempt
    planes: tuple[Plane, ...]

    @property
    def others(self) -> tuple[Joint, ...]:
        """Return the moving joints of the main chain before and after the platform."""
        return tuple(j for j in (*self.before, *self.behind) if j.kind != "fixed")

    def place(self, work: Work, entries: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Solve for the joints of the platform at a platform pose with the given matrix entries."""
        target = of_pose(work.terms, entries, home_of(self.platform, work.terms))
        solve_chain(work, self.lines, self.found, target, {})
        return values_of(work, self.platform, {})


@dataclass(frozen=True)
class _Parts:
    """Three consecutive parts of the main chain, and the body ``start`` that carries the legs."""

    before: Path
    middle: Path
    behind: Path
    start: str


def carried_platform(h: SolvedLoops) -> CarriedPlatform | str:
    """Return the parallel platform in a main chain, or the condition that the robot violates."""
    parts = _parts(h)
    if isinstance(parts, str):
        return parts
    platform = _robot(h, parts)
    planes = _planes(h, parts, platform)
    if isinstance(planes, str):
        return planes
    others = [j.name for j in (*parts.before, *parts.behind) if j.kind != "fixed"]
    actuated = {c.moves for c in h.mechanism.coordinates}
    passive = [name for name in others if name not in actuated]
    if passive:
        return f"no joint before or on the platform may be passive, unlike {listed(passive)}"
    if len(h.q) != LEGS + len(others):
        return (
            f"the robot must have {LEGS + len(others)} actuated coordinates, but it has {len(h.q)}"
        )
    structure = structure_of(platform, h.terms)
    if structure is None:
        return (
            f"the pose of {platform.joints[-1].link} does not determine its joints in closed form"
        )
    return CarriedPlatform(parts.before, platform, parts.behind, *structure, planes)


def keeps_planes(h: SolvedLoops) -> bool:
    """Whether the main chain has joints and a platform whose legs keep ball joints in planes."""
    parts = _parts(h)
    return not isinstance(parts, str) and not isinstance(_planes(h, parts, _robot(h, parts)), str)


def _parts(h: SolvedLoops) -> _Parts | str:
    """Return the parts of the main chain, or the condition that the main chain violates."""
    m, chain = h.mechanism, h.mechanism.path_to(h.mechanism.tool_body)
    ends = {frame.body for item in m.loop_joints for frame in (item.a, item.b)}
    starts = _starts(h)
    if len(starts) != 1:
        return f"the legs must start at one body, but they start at {listed(starts)}"
    (start,) = starts
    links = [joint.link for joint in chain]
    first = 1 + links.index(start) if start in links else 0
    bodies = [link for link in links[first:] if link in ends]
    if len(bodies) != 1:
        return f"the main chain must have one body at which legs end, but it has {len(bodies)}"
    last = 1 + links.index(bodies[0])
    parts = _Parts(tuple(chain[:first]), tuple(chain[first:last]), tuple(chain[last:]), start)
    if all(joint.kind == "fixed" for joint in (*parts.before, *parts.behind)):
        return f"no joint moves the legs or the tool on the body {bodies[0]}"
    return parts


def _starts(h: SolvedLoops) -> list[str]:
    """Return the bodies at which the legs start, that is, at which the loops branch."""
    found = []
    for loop in loops(h.mechanism):
        paths = [path for path in (loop.to_a, loop.to_b) if path]
        found += [path[0].parent for path in paths]
    return list(dict.fromkeys(found))


def _robot(h: SolvedLoops, parts: _Parts) -> SerialRobot:
    """Return the joints from the body at which the legs start to the platform as a serial robot."""
    base = () if parts.before else h.robot.base
    count = len(parts.before)
    joints = h.robot.joints[count : count + len(parts.middle)]
    return replace(h.robot, joints=joints, base=base, tool=())


def _planes(h: SolvedLoops, parts: _Parts, platform: SerialRobot) -> tuple[Plane, ...] | str:
    """Return the planes of the three ball joints, or the condition that the legs violate."""
    found = {
        f"the leg that ends at {loop.loop_joint.name}": _plane(h, parts, loop)
        for loop in loops(h.mechanism)
    }
    if len(platform.moving) != FREE:
        found[f"the leg of {listed(names_of(platform))}"] = _plane_of_chain(platform, h.terms)
    if len(found) != LEGS:
        return f"the platform must have {LEGS} legs, but it has {len(found)}"
    planes = tuple(plane for plane in found.values() if plane is not None)
    if len(planes) == LEGS:
        return planes
    others = listed([leg for leg, plane in found.items() if plane is None])
    return f"each leg must keep a ball joint in a plane, unlike {others}"


def names_of(robot: SerialRobot) -> list[str]:
    """Return the names of the moving joints of a serial robot."""
    return [joint.name for joint in robot.moving]


def _plane(h: SolvedLoops, parts: _Parts, loop: Loop) -> Plane | None:
    """Return the plane in which a leg keeps its ball joint, or None if there is no such plane."""
    closure, chain = loop.loop_joint, {joint.name for joint in h.robot.joints}
    if not isinstance(closure, Closure) or closure.kind != "ball":
        return None
    for leg, own, other in (
        (loop.to_a, closure.a, closure.b),
        (loop.to_b, closure.b, closure.a),
    ):
        if chain.isdisjoint(joint.name for joint in leg):
            return _plane_of_leg(h, parts, own, other)
    return None


def _plane_of_leg(h: SolvedLoops, parts: _Parts, own: Frame, other: Frame) -> Plane | None:
    """Return the plane in which a leg moves its ball joint.

    Args:
        h: The robot.
        parts: The joints of the main chain before, on and behind the platform.
        own: The frame of the ball joint on the leg.
        other: The frame of the ball joint on the platform.
    """
    m = h.mechanism
    path = m.path_to(own.body)[len(parts.before) :]
    joints = tuple(replace(joint, parent="") for joint in path)
    base = () if parts.before else m.base
    leg = SerialRobot(m.name, joints, base=base, tool=own.placement, parameters=m.parameters)
    axes = axes_of(leg, h.terms)
    normal = _normal(axes) if len(axes) == LEG_JOINTS else None
    if normal is None:
        return None
    *_, ball = home(leg, h.terms)
    _, point = pose_along(m, h.terms, (), other.placement, {})
    return Plane(normal, float(normal @ ball), numbers(h.terms, point))


def _plane_of_chain(platform: SerialRobot, terms: Terms) -> Plane | None:
    """Return the plane in which a leg moves its ball joint, or None if there is no such plane.

    The last three joint axes of the leg must intersect and form the ball joint.
    """
    lines = Lines(terms, axes_of(platform, terms))
    if len(lines.axes) != LEG_JOINTS + TURNS or not all(a.turns for a in lines.axes[LEG_JOINTS:]):
        return None
    normal = _normal(lines.axes[:LEG_JOINTS])
    if normal is None or not lines.meet(*range(LEG_JOINTS, LEG_JOINTS + TURNS)):
        return None
    ball = numbers(terms, lines.meeting(LEG_JOINTS, LEG_JOINTS + 1))
    x, y, z, at = home(platform, terms)
    return Plane(normal, float(normal @ ball), np.array([x, y, z]) @ (ball - at))


def _normal(axes: Sequence[Axis]) -> FloatArray | None:
    """Return the normal of the parallel planes in which the joints move points.

    Return None if the joints do not move points in parallel planes or if no joint is revolute.
    """
    normal = next((axis.direction for axis in axes if axis.turns), None)
    return normal if normal is not None and all(_keeps(a, normal) for a in axes) else None


def _keeps(axis: Axis, normal: FloatArray) -> bool:
    """Whether a joint moves points only in planes with the given normal."""
    if axis.turns:
        return float(np.linalg.norm(np.cross(axis.direction, normal))) <= EXACT_STRUCTURE
    return axis.kind == "prismatic" and abs(float(axis.direction @ normal)) <= EXACT_STRUCTURE


def home(robot: SerialRobot, terms: Terms) -> list[FloatArray]:
    """Return the axes and the origin of the tool with all joints at zero (meter)."""
    return [numbers(terms, column[:3]) for column in home_of(robot, terms).T.tolist()]
