"""Computes the length of a cylinder between two known points."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Strut
from ...terms.vectors import Vector, dot, subtracted
from ..model.body_frames import pose_along
from ..model.planes import loops
from ..planar.loop_step import SPACE, RateEquation, StepEquations, components, quantity, weighted
from .struts import Legs, LegStep


@dataclass(frozen=True, kw_only=True)
class CylinderLength(LegStep):
    """The distance between a cylinder's ends.

    Attributes:
        d: The vector from the first to the second end of the cylinder.
        distance: The length of the vector d (meter).
    """

    d: Vector
    distance: sp.Expr

    title: ClassVar[str] = "a distance"

    @classmethod
    def use(cls, legs: Legs, struts: Sequence[Strut]) -> bool:
        """Compute the length of a cylinder between two points with known positions."""
        if len(struts) != 1 or legs.length(struts[0]) is not None or legs.moving(struts[0]):
            return False
        (strut,) = struts
        terms = legs.terms
        # Joints that precede both ends do not change the distance between the ends.
        loop = next(loop for loop in loops(legs.mechanism) if loop.loop_joint == strut)
        (_, begin), (_, end) = (
            pose_along(legs.mechanism, terms, path, frame.placement, legs.known.values)
            for path, frame in ((loop.to_a, strut.a), (loop.to_b, strut.b))
        )
        d = subtracted(terms, end, begin)
        distance = terms.let(sp.sqrt(dot(terms, d, d)))
        legs.known.values[strut.name] = terms.let(distance - strut.length)
        legs.known.steps.append(
            cls(joints=(strut.name,), axes=loop.meeting, d=d, distance=distance)
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equation for the length t of the vector D between the cylinder ends."""
        D, t = components("D", SPACE), quantity("t")
        return StepEquations(
            vectors={"D": self.d},
            unknowns={t: self.distance},
            results=((t, sp.sqrt(sp.Add(*(part**2 for part in D)))),),
            rates=(RateEquation(((t, t),), weighted(D, D)),),
        )
