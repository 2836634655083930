"""Solves for the angle of a revolute joint that moves one end of a ball-ended leg.

The two solutions for the angle are the intersections of a circle with a sphere.
"""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Strut
from ...model.tolerances import OFF_AXIS
from ...terms.generic_point import vanishes
from ..model.phasors import ZERO
from ..planar.arm import Arm, turn_of
from ..planar.dyads import SIDES, meeting
from ..planar.loop_step import StepEquations, length_of, quantity
from ..planar.three_pins import (
    TwoCircles,
    circle_equations,
    rate_of_first,
    side_remark,
    two_circles,
)
from .struts import Legs, LegStep

OPENING = "Let, with $z$ along the joint,"


@dataclass(frozen=True, kw_only=True)
class TurningLeg(LegStep):
    """Two circles in a plane normal to the axis of a revolute joint.

    The first circle is the path of the moved leg end. The second circle is the intersection of the
    first circle's plane with a sphere whose radius is the leg length.

    Attributes:
        circles: The two circles in the joint frame, where the vector w is the leg, projected onto
            the plane normal to the joint axis.
        square: The square of the leg length.
    """

    circles: TwoCircles
    square: sp.Expr

    title: ClassVar[str] = "intersection of a circle and a sphere"
    branches: ClassVar[Mapping[int, str]] = SIDES
    opening: ClassVar[str] = OPENING
    dead_point: ClassVar[str] = "${A}$ and ${B}$ are in line"

    @classmethod
    def use(cls, legs: Legs, struts: Sequence[Strut]) -> bool:
        """Solve for the revolute joint that a single strut determines."""
        reach = legs.reach(struts, sliding=False)
        if reach is None:
            return False
        terms, let = legs.terms, legs.terms.let
        tip, target, joint = reach.tip, reach.target, reach.joint
        if any(_is_on_axis(legs, let(x**2 + y**2)) for x, y, _ in (tip, target)):
            # If an end of the strut is on the joint axis, the distance between both ends does not
            # depend on the joint angle.
            return False
        height = let(target[2] - tip[2])
        flat = let(reach.square - height**2)
        D = Arm((target[0], target[1]), ZERO, let(target[0] ** 2 + target[1] ** 2))
        v = Arm((tip[0], tip[1]), ZERO, let(tip[0] ** 2 + tip[1] ** 2))
        w = Arm((let(sp.sqrt(flat)), ZERO), ZERO, flat)
        sign = legs.chosen(reach, lambda s: _angle_at_reference(legs, v, w, D, s))
        gate = partial(legs.while_long, strut=reach.strut)
        found = two_circles(terms, v, w, D, sign, gate)
        c, s = turn_of(terms, found.C, v)
        angle = terms.solved_angle(c, s)
        legs.known.loops.setdefault(angle, rate_of_first(found, c, s))
        legs.known.values[joint.name] = joint.direction * angle
        # The margin is relative to the squared length of the whole leg, because the squared
        # projection of the leg may be negative.
        margin = let(found.margin * let(flat / reach.square))
        legs.known.steps.append(
            cls(
                joints=(joint.name, reach.strut.name),
                axes=joint.parent,
                solved=(angle,),
                margin=margin,
                root=found.height,
                sign=sign,
                circles=found,
                square=reach.square,
            )
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equations of the intersecting circles and the margin of the leg."""
        flat = circle_equations(self.circles, self.sign, *self.solved)
        square = quantity("l^2")
        assert flat.margin is not None
        margin = flat.margin * length_of("B") ** 2 / square
        return replace(flat, scalars={square: self.square}, margin=margin)

    @property
    def remark(self) -> str:
        """A sentence that states on which side of the joint axis the end of the leg lies."""
        return side_remark(self.sign)


def _is_on_axis(legs: Legs, square: sp.Expr) -> bool:
    """Whether the squared distance of a leg end from the joint axis is always zero."""
    # If the distance is positive at the reference, the end of the leg is not on the joint axis. If
    # the distance is zero at the reference, `vanishes` tests whether the distance is zero in all
    # configurations.
    return legs.reference.of(square) < OFF_AXIS and vanishes(legs.terms, square)


def _angle_at_reference(legs: Legs, v: Arm, w: Arm, D: Arm, sign: int) -> float:
    """Return the joint angle at the reference, or NaN if the leg does not close."""
    d, u = legs.reference.number(D.vector), legs.reference.number(v.vector)
    square = legs.reference.of(w.square)
    C = meeting(abs(u), math.sqrt(square), d, sign) if square >= 0 and u != 0 else None
    return math.nan if C is None else cmath.phase(C / u)
