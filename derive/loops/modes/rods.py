"""The rods of a platform on legs, and their rows of the velocity relation.

Let n be the direction of a rod towards the platform, and r = b - p its moment arm about the tool.
The time derivative of the length equation |b - a| = l is linear in the platform twist (v, omega).

    n . v + (r x n) . omega = (n . da/dq + dl/dq) q'

Source:
    Gosselin and Angeles 1990.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...model.mechanism import Frame, Strut
from ...model.robot import Joint
from ...terms.tangents import Tangent
from ...terms.terms import Terms
from ...terms.vectors import ORIGIN, ZERO, Vector, cross, dot, named, subtracted
from ..model.body_frames import pose_of
from ..solve.solved_loops import SolvedLoops


@dataclass(frozen=True)
class Rod:
    """A strut of a platform, in the base frame (meter).

    The ends and the length of the strut depend on joint values theta and actuator values q.

    Attributes:
        a: The endpoint of the strut on an actuated body or on the base.
        b: The endpoint of the strut on the platform.
        d: The vector from the strut end a to the strut end b.
        distance: The distance between the strut ends a and b.
        length: The constant or actuated length of the strut.
    """

    a: Vector
    b: Vector
    d: Vector
    distance: sp.Expr
    length: sp.Expr

    def actuator_row(
        self, terms: Terms, n: Sequence[sp.Expr], q: Sequence[sp.Symbol]
    ) -> list[sp.Expr]:
        """Return the row of the matrix J_q for this rod, with one entry per actuator.

        Each entry is the velocity of rod end a along the rod plus the rate of the rod length, at
        unit rate of one actuator.

        Args:
            terms: Receives the terms.
            n: The unit direction of the rod towards the platform.
            q: The actuated coordinates.
        """
        row = []
        for symbol in q:
            tangent = Tangent(terms, {symbol: sp.S.One})
            speed = sp.Add(*map(sp.Mul, n, tangent.of_each(self.a)))
            row.append(speed + tangent.of(self.length))
        return row


def is_right_handed(terms: Terms, axes: Sequence[Vector]) -> bool:
    """Whether the third of three axes is the cross product of the first two."""
    x, y, z = axes
    return subtracted(terms, cross(terms, x, y), z) == ORIGIN


def line_coordinates(n: Sequence[sp.Expr], r: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return the direction n of a rod and its moment r x n."""
    return (*n, *(r[k - 2] * n[k - 1] - r[k - 1] * n[k - 2] for k in range(3)))


def rods_of(h: SolvedLoops) -> list[Rod]:
    """Return the rods of a platform in the order of the description."""
    values = joint_values(h)
    found = []
    for strut in h.mechanism.struts:
        (_, a), (_, b) = (pose_of(h.mechanism, h.terms, end, values) for end in from_base(h, strut))
        d = subtracted(h.terms, b, a)
        length = strut.length + (values[strut.name] if strut.is_cylinder else ZERO)
        found.append(Rod(a, b, d, h.terms.let(sp.sqrt(dot(h.terms, d, d))), length))
    return found


def pins_in_tool(h: SolvedLoops) -> list[Vector]:
    """Return the platform ends of the rods in the tool frame (meter)."""
    still = joint_values(h) | {joint.name: ZERO for joint in h.robot.moving}
    axes, tool = pose_of(h.mechanism, h.terms, h.mechanism.tool_mounting, still)
    pins = []
    for strut in h.mechanism.struts:
        _, end = from_base(h, strut)
        _, at_rest = pose_of(h.mechanism, h.terms, end, still)
        offset = subtracted(h.terms, at_rest, tool)
        x, y, z = (dot(h.terms, axis, offset) for axis in axes)
        pins.append((x, y, z))
    return pins


def tool_position(h: SolvedLoops) -> Vector:
    """Return the tool position in the base frame (meter) at the main-chain joint values theta."""
    return pose_of(h.mechanism, h.terms, h.mechanism.tool_mounting, joint_values(h))[1]


@dataclass(frozen=True)
class FreePlatform:
    """Virtual joints of a free platform, and the end points of all struts, at zero joint values.

    Attributes:
        directions: The positive direction of each virtual joint, in the base frame.
        points: The origin of the frame of each virtual joint, in the base frame (meter).
        ends: For each strut, the coordinates of its two ends (platform end second) along the first
            three joint directions, relative to the origin of the last joint.
    """

    directions: tuple[Vector, ...]
    points: tuple[Vector, ...]
    ends: tuple[tuple[Vector, Vector], ...]


def free_platform(h: SolvedLoops, kinds: Sequence[str]) -> FreePlatform | None:
    """Return the platform with a chain of virtual joints of the given kinds.

    Return None if there is no such platform.

    Args:
        h: The robot.
        kinds: The kinds of the moving main-chain joints. A platform must have as many struts as
            ``kinds`` has entries.
    """
    mechanism, terms = h.mechanism, h.terms
    moving = [joint for joint in mechanism.path_to(mechanism.tool_body) if joint.kind != "fixed"]
    if [joint.kind for joint in moving] != kinds or len(mechanism.struts) != len(kinds):
        return None
    still = joint_values(h) | {joint.name: ZERO for joint in moving}
    frames = [pose_of(mechanism, terms, joint_frame(joint), still) for joint in moving]
    directions = tuple(
        named(terms, (joint.direction * component for component in axes[2]))
        for joint, (axes, _) in zip(moving, frames, strict=True)
    )
    points = tuple(point for _, point in frames)

    def seen(frame: Frame) -> Vector:
        offset = subtracted(terms, pose_of(mechanism, terms, frame, still)[1], points[-1])
        x, y, z = (dot(terms, direction, offset) for direction in directions[:3])
        return x, y, z

    ends = [tuple(map(seen, from_base(h, strut))) for strut in mechanism.struts]
    return FreePlatform(directions, points, tuple((a, b) for a, b in ends))


def joint_values(h: SolvedLoops) -> dict[str, sp.Expr]:
    """Return symbolic values of joints and cylinders by name.

    The values of main-chain joints are theta, and the values of actuated joints and cylinders are
    proportional to q.
    """
    coordinates = zip(h.mechanism.coordinates, h.q, strict=True)
    values = {c.moves: c.ratio * symbol for c, symbol in coordinates}
    return values | {j.name: s for j, s in zip(h.robot.moving, h.theta, strict=True)}


def from_base(h: SolvedLoops, strut: Strut) -> tuple[Frame, Frame]:
    """Return the frames at both ends of a rod, with the platform end second."""
    chain = {joint.name for joint in h.robot.moving}
    at_end = any(joint.name in chain for joint in h.mechanism.path_to(strut.b.body))
    return (strut.a, strut.b) if at_end else (strut.b, strut.a)


def joint_frame(joint: Joint) -> Frame:
    """Return the fixed frame of a joint on its parent body, without the joint's motion."""
    return Frame(joint.parent, joint.before)
