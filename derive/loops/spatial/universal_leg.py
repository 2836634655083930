"""Solves for the angles of the universal joint of a rod that ends at a ball joint.

The axes of the last two joints before the ball intersect in the center of the universal joint. The
rod keeps the ball joint at a constant distance from the center of the universal joint. Therefore,
the universal joint is first treated as a ball joint, so that the rod is a leg between two ball
joints. The known length of this leg determines one unknown joint that moves the center of the
universal joint or the ball. If the center and the ball are known, the direction of the rod
determines both angles of the universal joint. On the second of two branches, the fork is rotated by
half a turn, and the rod has the supplementary angle.

Source:
    Hunt, Kinematic Geometry of Mechanisms, 1978, ch. 13, for RSUR as a spatial four-bar.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Closure, Frame, Strut
from ...model.robot import Joint
from ...terms.generic_point import vanishes
from ...terms.tangents import LoopRate, Tangent
from ...terms.terms import Terms
from ...terms.vectors import ZERO, Vector, cross, dot, subtracted
from ..model.body_frames import pose_of
from ..model.planes import Loop
from ..planar.arm import Arm, turn_of
from ..planar.loop_step import (
    SPACE,
    AngleEquation,
    LoopStep,
    RateEquation,
    StepEquations,
    components,
    quantity,
    weighted,
)
from ..planar.reference import wrapped
from ..planar.two_pins import rate_of_direction
from .ball_ends import BallEnd, Fork, ball_ends, fork_of, pin_ends
from .struts import SIGNS, Legs

FORKS = {1: "forward", -1: "turned over"}
"""Names of the two orientations of the fork for one direction of the rod."""


@dataclass(frozen=True)
class UniversalJoint:
    """Two revolute joints with intersecting axes, and the ball at the end of the rod.

    Attributes:
        closure: The closure that contains the ball.
        first: The joint that rotates the fork.
        second: The joint between the fork and the rod.
        target: The frame of the ball joint on the other body that the ball joint connects.
        axes: The axes x, y and z of the first joint at angle zero, expressed in the axes of the
            second joint.
        tip: The vector (meter) from the joint center to the ball at second joint angle zero, in the
            axes of the second joint.
        rod: The equivalent rod with two ball joints, from the center of the universal joint to the
            ball.
    """

    closure: Closure
    first: Joint
    second: Joint
    target: Frame
    axes: tuple[Vector, Vector, Vector]
    tip: Vector
    rod: Strut

    @classmethod
    def of(cls, legs: Legs, loop: Loop) -> "UniversalJoint | None":
        """Return the universal joint before a ball joint that closes a loop, or None.

        A pin joint whose axis contains the center of the universal joint acts like a ball joint at
        another point of the pin axis.
        """
        pins = (_of_pin(legs, points) for points in pin_ends(legs, loop))
        ends = [*ball_ends(legs, loop), *(end for end in pins if end is not None)]
        found = (_joint_before(legs, end) for end in ends)
        return next((joint for joint in found if joint is not None), None)

    def solved(self, legs: Legs) -> bool:
        """Solve the two angles of a universal joint if its center and the ball joint are known."""
        return UniversalLeg.use(legs, self)


def _of_pin(legs: Legs, points: tuple[BallEnd, BallEnd]) -> BallEnd | None:
    """Return a point on a pin axis, or None if the axis misses the universal joint's center."""
    forks = [_fork_and_tip(legs, end) for end in points]
    if forks[0] is None or forks[1] is None:
        return None
    across = cross(legs.terms, forks[0][1], forks[1][1])
    return points[1] if vanishes(legs.terms, dot(legs.terms, across, across)) else None


def _fork_and_tip(legs: Legs, end: BallEnd) -> tuple[Fork, Vector] | None:
    """Return the intersection of the last two unknown joint axes, and the leg end.

    The vector to the leg end starts at the intersection and is expressed in the frame of the last
    joint.
    """
    places = end.last("revolute", "revolute")
    fork = fork_of(legs, end.path, *places) if places else None
    if fork is None:
        return None
    x, y, z = end.ball(legs, places[1])
    return fork, (x, y, legs.terms.let(z + fork.height))


def _joint_before(legs: Legs, end: BallEnd) -> UniversalJoint | None:
    """Return the universal joint that the last two unknown joints form, or None.

    The axes of these two joints must intersect at a point other than the ball.
    """
    found, terms = _fork_and_tip(legs, end), legs.terms
    if found is None:
        return None
    fork, tip = found
    if vanishes(terms, terms.let(tip[0] ** 2 + tip[1] ** 2)):
        return None
    first, second = (end.path[place] for place in end.open[-2:])
    length = terms.let(sp.sqrt(dot(terms, tip, tip)))
    rod = Strut(end.closure.name, fork.center, end.target, length, ends="ball")
    return UniversalJoint(end.closure, first, second, end.target, fork.axes, tip, rod)


@dataclass(frozen=True, kw_only=True)
class UniversalLeg(LoopStep):
    """The angles of a universal joint whose rod ends at a ball joint of known position.

    Attributes:
        joint: The universal joint.
        direction: The vector from the center of the universal joint to the ball, in the axes of the
            first joint (meter).
    """

    joint: UniversalJoint
    direction: Vector

    title: ClassVar[str] = "a universal joint that points to a ball"
    branches: ClassVar[Mapping[int, str]] = FORKS
    opening: ClassVar[str] = (
        "Let, with the vector $D$ from the joint's center to the ball in the axes of its first"
        " joint at zero, and the other vectors in the axes of its second joint,"
    )
    dead_point: ClassVar[str] = "the angle between the rod and the first joint's axis is minimal"

    @classmethod
    def use(cls, legs: Legs, joint: UniversalJoint) -> bool:
        """Solve the two angles of a universal joint if its center and the ball joint are known."""
        unknown = [j.name for j in (*legs.unknown(joint.target), *legs.unknown(joint.rod.a))]
        values = legs.known.values
        if unknown or joint.first.name in values or joint.second.name in values:
            return False
        terms = legs.terms
        axes, center = pose_of(legs.mechanism, terms, joint.rod.a, values)
        between = subtracted(terms, legs.point(joint.target), center)
        x, y, z = (dot(terms, axis, between) for axis in axes)
        aim = _Aim(terms, joint, (x, y, z))
        distances = {}
        if legs.branch is None:
            distances = {sign: aim.distance(legs, sign) for sign in SIGNS}
        sign = legs.sign(distances, joint.second.name)
        first, second = aim.angles(sign, legs)
        values[joint.first.name] = joint.first.direction * first
        values[joint.second.name] = joint.second.direction * second
        legs.known.steps.append(
            cls(
                joints=(joint.first.name, joint.second.name, joint.closure.name),
                axes=joint.first.parent,
                solved=(first, second),
                margin=terms.let(aim.inside / aim.most),
                root=aim.h,
                sign=sign,
                joint=joint,
                direction=(x, y, z),
            )
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equations for the angle of the rod, and then for the angle of the fork."""
        A, B, C, D, E, F = (components(letter, SPACE) for letter in "ABCDEF")
        V = components("V")
        n, h, a, b = map(quantity, "nhab")
        first, second = self.solved
        turned = (C[0], C[1], B[2])
        parts = [sp.Add(*(e * c for e, c in zip(axis, turned, strict=True))) for axis in (E, F)]
        c, s = sp.cos(second), sp.sin(second)
        back = (c * A[0] + s * A[1], c * A[1] - s * A[0], A[2])
        return StepEquations(
            vectors=dict(zip("EFA", self.joint.axes, strict=True))
            | {"B": self.joint.tip, "D": self.direction},
            results=(
                (n, D[2] - A[2] * B[2]),
                (a, A[0] ** 2 + A[1] ** 2),
                (b, B[0] ** 2 + B[1] ** 2),
                (h, self.sign * sp.sqrt(a * b - n**2)),
                (C[0], (A[0] * n - A[1] * h) / a),
                (C[1], (A[1] * n + A[0] * h) / a),
                (V[0], parts[0]),
                (V[1], parts[1]),
            ),
            angles=(
                AngleEquation(second, "B", (C[0], C[1])),
                AngleEquation(first, "V", (D[0], D[1])),
            ),
            margin=h**2 / (a * b),
            rates=(RateEquation(((second, h),), ((D[2], sp.Integer(-1)), *weighted(B, back))),),
        )

    @property
    def remark(self) -> str:
        """A sentence that describes the second branch of a universal joint."""
        return (
            "The other sign of ${h}$ is the flipped fork: the rod then points in the same"
            " direction."
        )


class _Aim:
    """The direction of the rod, and intermediate results of both branches.

    Let a be the first joint axis and b the rod, in a frame whose z axis is the second joint axis.
    The vector C is b, rotated by the second joint angle, and D is the rod in the axes of the first
    joint. Then a . C = D_z, so C_xy = (a_xy n + sign h (z x a_xy)) / a_xy^2 with n = D_z - a_z b_z
    and h^2 = a_xy^2 b_xy^2 - n^2.
    """

    def __init__(self, terms: Terms, joint: UniversalJoint, direction: Vector) -> None:
        let = terms.let
        self.terms, self.joint, self.direction = terms, joint, direction
        (ax, ay, az), (bx, by, bz) = joint.axes[2], joint.tip
        self.across = let(ax**2 + ay**2)
        self.tip = Arm((bx, by), ZERO, let(bx**2 + by**2))
        self.n = let(direction[2] - az * bz)
        self.most = let(self.across * self.tip.square)
        self.inside = let(self.most - self.n**2)
        self.h = let(sp.sqrt(self.inside))

    def turned(self, sign: int) -> tuple[sp.Expr, sp.Expr]:
        """Return the rod component that is normal to the second joint axis."""
        let, (ax, ay, _) = self.terms.let, self.joint.axes[2]
        return (
            let(let(ax * self.n - sign * ay * self.h) / self.across),
            let(let(ay * self.n + sign * ax * self.h) / self.across),
        )

    def on_fork(self, C: tuple[sp.Expr, sp.Expr]) -> Arm:
        """Return the rod in the fork frame, projected onto the plane normal to the first axis."""
        rod = (*C, self.joint.tip[2])
        x, y = (dot(self.terms, axis, rod) for axis in self.joint.axes[:2])
        return Arm((x, y), ZERO, self.terms.let(x**2 + y**2))

    def angles(self, sign: int, legs: Legs) -> tuple[sp.Symbol, sp.Symbol]:
        """Return both angles of the universal joint, and record the rates of these angles."""
        terms, flat = self.terms, (self.direction[0], self.direction[1])
        C = self.turned(sign)
        V = self.on_fork(C)
        second = terms.solved_angle(*turn_of(terms, C, self.tip))
        legs.known.loops.setdefault(second, self._rate_of_second(sign, second))
        first = terms.solved_angle(*turn_of(terms, flat, V))
        legs.known.loops.setdefault(first, rate_of_direction(flat, V))
        return first, second

    def _rate_of_second(self, sign: int, second: sp.Symbol) -> LoopRate:
        """Return the rate psi' of the angle psi, from h psi' = a . (b' rotated by psi) - D_z'."""
        (ax, ay, az), (bx, by, bz) = self.joint.axes[2], self.joint.tip
        h = self.terms.let(sign * self.h)

        def rate(tangent: Tangent) -> sp.Expr:
            let = tangent.terms.let
            c, s = tangent.terms.cos_sin(second)
            x, y, z = (tangent.of(part) for part in (bx, by, bz))
            moved = let(let(c * ax + s * ay) * x + let(c * ay - s * ax) * y + az * z)
            return let(let(moved - tangent.of(self.direction[2])) / h)

        return rate

    def distance(self, legs: Legs, sign: int) -> float:
        """Return the largest deviation of a joint angle from its reference value (radian).

        The deviation is NaN if the leg does not close.
        """
        of = legs.reference.of
        C = self.turned(sign)
        if math.isnan(of(C[0])):
            return math.nan
        here = complex(*map(of, self.tip.vector))
        V = complex(*map(of, self.on_fork(C).vector))
        flat = complex(*map(of, self.direction[:2]))
        angles = (cmath.phase(flat / V), cmath.phase(complex(*map(of, C)) / here))
        joints = (self.joint.first, self.joint.second)
        hints = legs.reference.hints_of([j.name for j in joints])
        return max(
            abs(wrapped(joint.direction * angle - hints.get(joint.name, 0.0)))
            for joint, angle in zip(joints, angles, strict=True)
        )
