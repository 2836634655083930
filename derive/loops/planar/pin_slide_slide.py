"""Solves a ring of three bodies with one pin and two prismatic joints by intersecting two lines.

Source:
    Assur groups of class II (dyad PRP and its inversions).
"""

from dataclasses import dataclass
from typing import ClassVar

import sympy as sp

from ...terms.terms import Terms
from ..model.phasors import ZERO, Complex, cross
from ..model.planes import PinEdge, SlideEdge
from .clusters import Clusters, PlanarStep
from .loop_step import RateEquation, StepEquations, components, quantity, weighted


def two_lines(terms: Terms, offset: Complex, e: Complex, f: Complex) -> tuple[sp.Expr, sp.Expr]:
    """Solve ``t e + u f = offset`` for the travels t and u along the vectors e and f."""
    area = terms.let(sp.expand(cross(e, f)))
    t = terms.let(sp.expand(cross(offset, f))) / area
    u = terms.let(sp.expand(cross(e, offset))) / area
    return terms.let(t), terms.let(u)


@dataclass(frozen=True, kw_only=True)
class PinAndTwoSlides(PlanarStep):
    """Two consecutive slides whose outer bodies share a pin.

    Attributes:
        offset: Vector between the pin positions on the two outer bodies if both slides are at 0.
        first: Direction of the first slide.
        second: Direction of the second slide.
        travels: Travels along the first and the second slide (meter).
    """

    offset: Complex
    first: Complex
    second: Complex
    travels: tuple[sp.Expr, sp.Expr]

    title: ClassVar[str] = "one pin and two prismatic joints"

    @classmethod
    def join(cls, clusters: Clusters) -> bool:
        """Join three rigid groups that one pin and two slides connect in a loop."""
        edges = clusters.ring(slides=2)
        if edges is None:
            return False
        (pin,) = (edge for edge in edges if isinstance(edge, PinEdge))
        slides = [edge for edge in edges if isinstance(edge, SlideEdge)]
        terms = clusters.terms
        ends = [{id(clusters.cluster(slide.a)), id(clusters.cluster(slide.b))} for slide in slides]
        middle = next(c for c in clusters.all if id(c) in ends[0] & ends[1])
        base, Z = clusters.first(clusters.cluster(pin.a), clusters.cluster(pin.b))
        first, second = slides if id(base) in ends[0] else slides[::-1]
        to_middle = clusters.guide(first, base, middle)
        still = to_middle.mounted(ZERO)
        onward = clusters.guide(second, middle, Z)
        mount = still.carried(onward.mounted(ZERO))
        along = onward.along.times(still.rotor).turned(still.angle)
        delta = to_middle.along.common_angle()
        offset = clusters.pin(base, pin) - mount.origin
        offset = offset - clusters.pin(Z, pin).times(mount.rotor).turned(mount.angle)
        e, f, d = (
            vector.turned(-delta).coordinates(terms) for vector in (to_middle.along, along, offset)
        )
        t, u = two_lines(terms, d, e, f)
        relation = to_middle.along.times((t, ZERO)) + along.times((u, ZERO)) - offset
        clusters.travels |= {first.name: t, second.name: u}
        clusters.relations.append(relation)
        clusters.steps.append(
            cls(
                joints=(first.name, second.name, pin.name),
                axes=next(iter(base)),
                relation=relation,
                turned=delta,
                offset=d,
                first=e,
                second=f,
                travels=(t, u),
            )
        )
        clusters.join(middle, Z, onward.mounted(u))
        clusters.join(base, middle, to_middle.mounted(t))
        return True

    def equations(self) -> StepEquations:
        """Return the equation t A + u B = D for the travels t and u along the slides A and B."""
        D, A, B = (components(letter) for letter in "DAB")
        n, t, u = map(quantity, "ntu")
        rates = []
        for unknown, other, sign in ((t, B, 1), (u, A, -1)):
            normal = sign * other[1], -sign * other[0]
            right = (*weighted(D, normal), *weighted(A, normal, -t), *weighted(B, normal, -u))
            rates.append(RateEquation(((unknown, n),), right))
        return StepEquations(
            vectors={"D": self.offset, "A": self.first, "B": self.second},
            unknowns=dict(zip((t, u), self.travels, strict=True)),
            results=((n, cross(A, B)), (t, cross(D, B) / n), (u, cross(A, D) / n)),
            rates=tuple(rates),
        )
