"""Joins two bodies that share two pins, or a pin and a slide."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from itertools import product as product_of
from typing import ClassVar

import sympy as sp

from ...terms.tangents import LoopRate, Tangent
from ..model.phasors import REAL, ZERO, Complex, PhasorSum, conjugate, cross, dot, product
from ..model.planes import PinEdge, SlideEdge
from .arm import Arm, arm, rates_of
from .clusters import Clusters, PlanarStep, Turned
from .dyads import exact_turn
from .loop_step import (
    AngleEquation,
    RateEquation,
    StepEquations,
    components,
    length_of,
    quantity,
    weighted,
)


@dataclass(frozen=True, kw_only=True)
class TwoPins(PlanarStep):
    """The rotation that aligns the vector between two pins of a body with a vector of the base.

    Attributes:
        vectors: Vectors between the two pins, on the base (key C) and on the rotated body (key A).
            The dictionary is empty if the rotation angle is a sum of known angles.
    """

    vectors: dict[str, Complex] = field(default_factory=dict)

    title: ClassVar[str] = "two pins"
    reason: ClassVar[str] = "The rotations of both vectors between the pins are known."

    @classmethod
    def join(cls, clusters: Clusters) -> bool:
        """Join the first two rigid groups that share two different pins."""
        pins = [edge for edge in clusters.between() if isinstance(edge, PinEdge)]
        for first, second in combinations(pins, 2):
            pair = clusters.cluster(first.a), clusters.cluster(first.b)
            base, other = clusters.first(*pair)
            if not clusters.holds(second, base, other):
                continue
            here, there = (clusters.span(c, first, second) for c in (other, base))
            if not here.terms or not there.terms:
                continue
            turn, solved, vectors = _turn_between(clusters, here, there)
            at = clusters.pin(base, first), clusters.pin(other, first)
            relation = here.times(turn[1]).turned(turn[0]) - there
            axes = next(iter(base))
            clusters.mount(base, other, turn, *at)
            clusters.relations.append(relation)
            clusters.steps.append(
                cls(
                    joints=(first.name, second.name),
                    axes=axes,
                    relation=relation,
                    turned=there.common_angle(),
                    solved=solved,
                    vectors=vectors,
                )
            )
            return True
        return False

    def equations(self) -> StepEquations:
        """Return the equations for the rotation angle from vector A to vector C.

        No equations are returned if the rotation angle is a sum of known angles.
        """
        if not self.vectors:
            return StepEquations()
        (angle,) = self.solved
        return direction_equations(angle, self.vectors)


def direction_equations(angle: sp.Symbol, vectors: Mapping[str, Complex]) -> StepEquations:
    """Return the equations for the rotation from a vector A to a vector C.

    Args:
        angle: The rotation angle.
        vectors: Components of the vectors A and C, keyed by letter.
    """
    C, A = components("C"), components("A")
    c, a = length_of("C"), length_of("A")
    across_C, across_A = (-C[1], C[0]), (-A[1], A[0])
    right = (*weighted(C, across_C), *weighted(A, across_A, -(c**2) / a**2))
    return StepEquations(
        vectors=vectors,
        lengths=("C", "A"),
        angles=(AngleEquation(angle, "A", C),),
        rates=(RateEquation(((angle, c**2),), right),),
    )


def _turn_between(
    clusters: Clusters, here: PhasorSum, there: PhasorSum
) -> tuple[Turned, tuple[sp.Symbol, ...], dict[str, Complex]]:
    exact = exact_turn(here, there)
    if exact is not None:
        return exact, (), {}
    terms = clusters.terms
    a, b = arm(terms, there), arm(terms, here)
    re, im = product(a.vector, conjugate(b.vector))
    size = terms.let(sp.sqrt(a.square * b.square))
    c, s = (terms.let(terms.let(sp.expand(part)) / size) for part in (re, im))
    angle = clusters.solved(c, s, rate_of_direction(a.vector, b))
    return (a.angle + angle - b.angle, REAL), (angle,), {"C": a.vector, "A": b.vector}


def rate_of_direction(there: Complex, here: Arm) -> LoopRate:
    """Return the rate of the angle between vectors a and b: a x a' / a^2 - b x b' / b^2."""

    def rate(tangent: Tangent) -> sp.Expr:
        let = tangent.terms.let
        a, b = rates_of(tangent, there), rates_of(tangent, here.vector)
        first = let(cross(there, a)) / let(dot(there, there))
        return let(first - let(cross(here.vector, b)) / here.square)

    return rate


@dataclass(frozen=True, kw_only=True)
class PinAndSlide(PlanarStep):
    """The displacement of a prismatic joint that moves a pin to its position on the base.

    Attributes:
        offset: The required displacement of the pin from its position at zero travel of the slide.
        direction: Unit vector along the slide.
        travel: Travel along the slide (meter).
    """

    offset: Complex
    direction: Complex
    travel: sp.Expr

    title: ClassVar[str] = "a pin and a prismatic joint"

    @classmethod
    def join(cls, clusters: Clusters) -> bool:
        """Join the first two rigid groups that share a pin and a slide."""
        edges = clusters.between()
        pairs = product_of(
            [edge for edge in edges if isinstance(edge, SlideEdge)],
            [edge for edge in edges if isinstance(edge, PinEdge)],
        )
        for slide, pin in pairs:
            base, other = clusters.first(clusters.cluster(slide.a), clusters.cluster(slide.b))
            if not clusters.holds(pin, base, other):
                continue
            terms, guide = clusters.terms, clusters.guide(slide, base, other)
            still = guide.mounted(ZERO)
            there = clusters.pin(other, pin).times(still.rotor).turned(still.angle)
            offset = clusters.pin(base, pin) - still.origin - there
            delta = guide.along.common_angle()
            d, e = (v.turned(-delta).coordinates(terms) for v in (offset, guide.along))
            travel = terms.let(sp.expand(dot(d, e)))
            clusters.travels[slide.name] = travel
            clusters.steps.append(
                cls(
                    joints=(slide.name, pin.name),
                    axes=next(iter(base)),
                    relation=guide.along.times((travel, ZERO)) - offset,
                    turned=delta,
                    offset=d,
                    direction=e,
                    travel=travel,
                )
            )
            clusters.join(base, other, guide.mounted(travel))
            return True
        return False

    def equations(self) -> StepEquations:
        """Return the equation t = dot(D, B) for the travel t along the slide direction B."""
        D, B = components("D"), components("B")
        t = quantity("t")
        return StepEquations(
            vectors={"D": self.offset, "B": self.direction},
            unknowns={t: self.travel},
            results=((t, dot(D, B)),),
            rates=(RateEquation(((t, sp.Integer(1)),), (*weighted(D, B), *weighted(B, D))),),
        )
