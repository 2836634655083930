"""A ring of three pins whose base is the sum of two vectors as long as the arms: no root."""

from dataclasses import dataclass
from itertools import permutations
from typing import ClassVar

from .clusters import Clusters, PlanarStep, Turned
from .dyads import Dyad, dyad_of, exact_turn, join_dyad, may_be_parallelogram, side_of
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


def _turns(clusters: Clusters, dyad: Dyad) -> tuple[Turned, Turned] | None:
    """The turns of both arms, where the base is a sum of two vectors as long as they are."""
    if not may_be_parallelogram(clusters, dyad):
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
