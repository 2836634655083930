"""A hinge before a ball, as the last of a leg PRS or RRS: its body is a rod to the ball.

The ball is at a constant distance from the point of the hinge's axis that is nearest to it. A leg
on balls between both points determines the joint that moves one of them; where both are known, the
hinge points to the ball.

Source:
    Tsai, Robot Analysis, 1999, ch. 3, for the legs of platforms.
"""

from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Closure, Frame, Strut
from ...model.robot import Joint, Translation
from ...terms.vectors import ZERO, dot, subtracted
from ..planar.arm import Arm, turn_of
from ..planar.loop_step import LoopStep, StepEquations
from ..planar.phasors import Complex
from ..planar.planes import Loop
from ..planar.reference import vanishes
from ..planar.two_pins import direction_equations, rate_of_direction
from .ball_ends import BallEnd, ball_ends
from .body_frames import pose_of
from .struts import Legs
from .turning_leg import OPENING


@dataclass(frozen=True)
class HingedRod:
    """The revolute joint before the ball of a closure.

    Attributes:
        closure: The closure of the ball.
        joint: The joint.
        target: The ball's frame on the other body.
        tip: From the axis to the ball where the joint is at zero, in the joint's axes.
        rod: The rod from the axis to the ball, as a strut on balls.
    """

    closure: Closure
    joint: Joint
    target: Frame
    tip: Arm
    rod: Strut

    @classmethod
    def of(cls, legs: Legs, loop: Loop) -> "HingedRod | None":
        """The hinge before the ball of a closure; None where there is none that is not known."""
        found = (_hinge_before(legs, end) for end in ball_ends(legs, loop))
        return next((hinge for hinge in found if hinge is not None), None)

    def solved(self, legs: Legs) -> bool:
        """Solves for the hinge where its axis and the ball are known."""
        return HingePoints.use(legs, self)


def _hinge_before(legs: Legs, end: BallEnd) -> HingedRod | None:
    """The last unknown joint of a way, where it is revolute and off the ball."""
    places = end.last("revolute")
    if not places:
        return None
    joint, terms = end.way[places[0]], legs.terms
    x, y, height = end.ball(legs, places[0])
    square = terms.let(x**2 + y**2)
    if vanishes(terms, square):
        return None
    centre = Frame(joint.parent, (*joint.before, Translation((ZERO, ZERO, height))))
    rod = Strut(end.closure.name, centre, end.target, terms.let(sp.sqrt(square)), ends="ball")
    return HingedRod(end.closure, joint, end.target, Arm((x, y), ZERO, square), rod)


@dataclass(frozen=True, kw_only=True)
class HingePoints(LoopStep):
    """The angle of a hinge whose body points to a known ball.

    Attributes:
        direction: From the axis to the ball, in the joint's axes (metre).
        tip: The same where the joint is at zero.
    """

    direction: Complex
    tip: Arm

    title: ClassVar[str] = "a hinge points to a ball"
    opening: ClassVar[str] = OPENING

    @classmethod
    def use(cls, legs: Legs, hinge: HingedRod) -> bool:
        """Solves for the angle; False where the ball or the axis is not known."""
        values, joint = legs.known.values, hinge.joint
        if legs.unknown(hinge.target) or legs.unknown(hinge.rod.a):
            return False
        terms = legs.terms
        axes, centre = pose_of(legs.mechanism, terms, hinge.rod.a, values)
        between = subtracted(terms, legs.point(hinge.target), centre)
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
        """The turn of A to C."""
        (angle,) = self.solved
        return direction_equations(angle, {"C": self.direction, "A": self.tip.vector})
