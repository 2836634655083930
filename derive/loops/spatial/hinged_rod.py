"""Solves for the angle of the hinge before the ball joint of a PRS or RRS leg.

The ball moves on a circle about the hinge axis. If the joint before the hinge moves this circle
within its plane, a rod from the circle center to the ball replaces the hinged body. The constant
length of this rod determines the joint before the hinge. Then the direction from the center to the
ball gives the hinge angle.

Source:
    Tsai, Robot Analysis, 1999, ch. 3, for the legs of platforms.
"""

from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Closure, Frame, Strut
from ...model.robot import Joint, Translation
from ...terms.generic_point import vanishes
from ...terms.vectors import ZERO, dot, subtracted
from ..model.body_frames import pose_along, pose_of
from ..model.phasors import Complex
from ..model.planes import Loop
from ..planar.arm import Arm, turn_of
from ..planar.loop_step import LoopStep, StepEquations
from ..planar.two_pins import direction_equations, rate_of_direction
from .ball_ends import BallEnd, ball_ends
from .struts import Legs
from .turning_leg import OPENING


@dataclass(frozen=True)
class HingedRod:
    """The revolute joint (hinge) before a ball joint that closes a loop.

    Attributes:
        closure: The closure whose joint is the ball joint of the leg.
        joint: The joint.
        target: The frame of the ball joint on the other body that the ball joint connects.
        center: A frame with the axes of the hinge, and with its origin at the point of the hinge
            axis nearest to the ball.
        tip: The vector from the hinge axis to the ball at hinge angle zero, in the axes of the
            hinge.
        rod: The equivalent rod with two ball joints, from the hinge axis to the ball joint of the
            leg. ``rod`` is None if the joint before the hinge can move the ball out of the plane
            normal to the hinge. With such motion, the rod length does not close the loop.
    """

    closure: Closure
    joint: Joint
    target: Frame
    center: Frame
    tip: Arm
    rod: Strut | None

    @classmethod
    def of(cls, legs: Legs, loop: Loop) -> "HingedRod | None":
        """Return the unknown hinge before a ball joint that closes a loop, or None."""
        found = (_hinge_before(legs, end) for end in ball_ends(legs, loop))
        return next((hinge for hinge in found if hinge is not None), None)

    def solved(self, legs: Legs) -> bool:
        """Solve for the hinge angle if the positions of the hinge axis and the ball are known."""
        return HingePoints.use(legs, self)


def _hinge_before(legs: Legs, end: BallEnd) -> HingedRod | None:
    """Return the hinge that precedes a ball joint, or None.

    The hinge must be the last unknown joint before the ball, and its axis must not contain the ball
    center.
    """
    places = end.last("revolute")
    if not places:
        return None
    joint, terms = end.path[places[0]], legs.terms
    x, y, height = end.ball(legs, places[0])
    square = terms.let(x**2 + y**2)
    if vanishes(terms, square):
        return None
    center = Frame(joint.parent, (*joint.before, Translation((ZERO, ZERO, height))))
    length = terms.let(sp.sqrt(square))
    rod = Strut(end.closure.name, center, end.target, length, ends="ball")
    tip, kept = Arm((x, y), ZERO, square), rod if _is_flat(legs, end) else None
    return HingedRod(end.closure, joint, end.target, center, tip, kept)


def _is_flat(legs: Legs, end: BallEnd) -> bool:
    """Whether the unknown joint before a hinge is parallel to the hinge, or slides normal to it."""
    i, k = [-1, *end.open][-2:]
    if i < 0:
        return False
    path, values = end.path, legs.known.values
    axes, _ = pose_along(
        legs.mechanism, legs.terms, path[i + 1 : k], path[k].before, values, path[i].after
    )
    x, y, z = axes[2]
    off = z if path[i].kind == "prismatic" else legs.terms.let(x**2 + y**2)
    return vanishes(legs.terms, off)


@dataclass(frozen=True, kw_only=True)
class HingePoints(LoopStep):
    """The angle of a hinge whose link points to a ball joint with a known position.

    Attributes:
        direction: The vector from the hinge axis to the known ball position, in the axes of the
            hinge frame at hinge angle zero (meter).
        tip: The vector from the hinge axis to the ball if the hinge angle is zero.
    """

    direction: Complex
    tip: Arm

    title: ClassVar[str] = "a hinge that points to a ball"
    opening: ClassVar[str] = OPENING

    @classmethod
    def use(cls, legs: Legs, hinge: HingedRod) -> bool:
        """Solve the hinge angle.

        Return False if the position of the ball or of the hinge axis is unknown.
        """
        values, joint = legs.known.values, hinge.joint
        if legs.unknown(hinge.target) or legs.unknown(hinge.center):
            return False
        terms = legs.terms
        axes, center = pose_of(legs.mechanism, terms, hinge.center, values)
        between = subtracted(terms, legs.point(hinge.target), center)
        flat = dot(terms, axes[0], between), dot(terms, axes[1], between)
        angle = terms.solved_angle(*turn_of(terms, flat, hinge.tip))
        legs.known.loops.setdefault(angle, rate_of_direction(flat, hinge.tip))
        values[joint.name] = joint.direction * angle
        legs.known.steps.append(
            cls(
                joints=(joint.name, hinge.closure.name),
                axes=joint.parent,
                solved=(angle,),
                direction=flat,
                tip=hinge.tip,
            )
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equation of the angle that rotates the vector A to the direction C."""
        (angle,) = self.solved
        return direction_equations(angle, {"C": self.direction, "A": self.tip.vector})
