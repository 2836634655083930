"""A ring of three pins whose base is the sum of two vectors as long as the arms: no root."""

from dataclasses import dataclass
from itertools import permutations
from typing import ClassVar

import sympy as sp

from ...model.tolerances import VANISHED
from .clusters import Clusters, PlanarStep, Turned
from .dyads import Dyad, dyad_of, exact_turn, join_dyad, side_of
from .loop_step import StepEquations
from .phasors import PhasorSum

SIDES_OF_THE_BASE = 2


@dataclass(frozen=True, kw_only=True)
class Parallelogram(PlanarStep):
    """Arms that stay parallel to the two vectors that the base is the sum of."""

    title: ClassVar[str] = "a parallelogram"
    reason: ClassVar[str] = "Opposite sides are of equal length and stay parallel."

    @classmethod
    def join(cls, clusters: Clusters) -> bool:
        """Joins the first ring of three pins that is a parallelogram on the branch meant."""
        for pins in clusters.rings(slides=0):
            dyad = dyad_of(clusters, pins)
            turns = _turns(clusters, dyad)
            if turns is not None:
                joints, axes, relation = join_dyad(clusters, dyad, *turns)
                clusters.steps.append(cls(joints=joints, axes=axes, relation=relation))
                return True
        return False

    def equations(self) -> StepEquations:
        """No equations: the body turns with other bodies."""
        return StepEquations()


def _may_be_one(clusters: Clusters, dyad: Dyad) -> bool:
    """Whether the base is a sum of vectors as long as the arms, in numbers.

    Exact arithmetic takes much longer.
    """

    def in_numbers(total: PhasorSum) -> dict[sp.Expr, complex]:
        return {angle: clusters.reference.number(c) for angle, c in total.terms.items()}

    relations = [in_numbers(relation) for relation in clusters.relations]
    best = in_numbers(dyad.D)
    fewer = True
    while fewer:
        candidates = [
            _less(best, relation, best[angle] / vector)
            for relation in relations
            for angle, vector in relation.items()
            if angle in best
        ]
        least = min(candidates, key=len, default=best)
        fewer = len(least) < len(best)
        best = least if fewer else best
    if len(best) != SIDES_OF_THE_BASE:
        return False
    sides = sorted(map(abs, best.values()))
    arms = sorted(abs(clusters.reference.vector(arm)) for arm in (dyad.V, dyad.W))
    return all(abs(a - b) <= VANISHED * b for a, b in zip(sides, arms, strict=True))


def _less(
    total: dict[sp.Expr, complex], relation: dict[sp.Expr, complex], factor: complex
) -> dict[sp.Expr, complex]:
    """A sum of turning vectors less a multiple of another, without vectors that are rounding."""
    size = max(map(abs, total.values()))
    rest = {
        angle: total.get(angle, 0j) - factor * relation.get(angle, 0j)
        for angle in {**total, **relation}
    }
    return {angle: c for angle, c in rest.items() if abs(c) > VANISHED * size}


def _turns(clusters: Clusters, dyad: Dyad) -> tuple[Turned, Turned] | None:
    """The turns of both arms, where the base is a sum of two vectors as long as they are."""
    if not _may_be_one(clusters, dyad):
        return None
    D = dyad.D.reduced(clusters.relations, lambda total: len(total.terms))
    sign = side_of(clusters, dyad)
    if len(D.terms) != SIDES_OF_THE_BASE:
        return None
    sides = [PhasorSum.of(vector, angle) for angle, vector in D.terms.items()]
    for C, rest in permutations(sides):
        turn_V, turn_W = exact_turn(dyad.V, C), exact_turn(dyad.W, -rest)
        c, d = clusters.reference.vector(C), clusters.reference.vector(D)
        side = (d.conjugate() * c).imag
        # Where branches are asked for by their signs, the vectors alone decide.
        is_meant = side * sign > 0 or clusters.signs is not None
        if turn_V is not None and turn_W is not None and is_meant:
            return turn_V, turn_W
    return None
