"""A cylinder between two known points: its length is their distance."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Strut
from ...terms.vectors import Vector, dot, subtracted
from ..planar.loop_step import SPACE, RateEquation, StepEquations, components, quantity, weighted
from .struts import Legs, LegStep


@dataclass(frozen=True, kw_only=True)
class CylinderLength(LegStep):
    """The distance of a cylinder's ends.

    Attributes:
        d: From its beginning to its end.
        distance: The length of d (metre).
    """

    d: Vector
    distance: sp.Expr

    title: ClassVar[str] = "a distance"

    @classmethod
    def use(cls, legs: Legs, struts: Sequence[Strut]) -> bool:
        """Measures a single cylinder whose ends are known."""
        if len(struts) != 1 or legs.length(struts[0]) is not None or legs.moving(struts[0]):
            return False
        (strut,) = struts
        terms = legs.terms
        d = subtracted(terms, legs.point(strut.b), legs.point(strut.a))
        distance = terms.let(sp.sqrt(dot(terms, d, d)))
        legs.known.values[strut.name] = terms.let(distance - strut.length)
        axes = legs.mechanism.base_frame
        legs.known.steps.append(cls(joints=(strut.name,), axes=axes, d=d, distance=distance))
        return True

    def equations(self) -> StepEquations:
        """The length t of the vector D."""
        D, t = components("D", SPACE), quantity("t")
        return StepEquations(
            vectors={"D": self.d},
            unknowns={t: self.distance},
            results=((t, sp.sqrt(sp.Add(*(part**2 for part in D)))),),
            rates=(RateEquation(((t, t),), weighted(D, D)),),
        )
