"""Solves rings of three rigid groups and three pins that form parallelograms.

The base vector of a parallelogram is the sum of two vectors with the lengths of the arms. A
parallelogram has two assembly modes, which are computed without a square root. In the parallelogram
mode, each arm stays parallel to one of the two vectors whose sum is the base vector. In the crossed
mode, the vector C of an arm is mirrored about the base D:

    C* = D conj(C) / conj(D), where conj is the complex conjugate.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import ClassVar

import sympy as sp

from ...terms.tangents import LoopRate, Tangent
from ..model.phasors import Complex, PhasorSum, conjugate, cross, product, quotient
from .arm import rates_of
from .clusters import Clusters, PlanarStep, Turned
from .dyads import Dyad, dyad_of, exact_turn, join_dyad, may_be_parallelogram, side_of
from .loop_step import (
    AngleEquation,
    LoopStep,
    RateEquation,
    StepEquations,
    components,
    length_of,
    weighted,
)

SIDES_OF_THE_BASE = 2
FIGURES = {1: "parallel", -1: "crossed"}
"""Names of the two assembly modes of a parallelogram. In the parallel mode, the arms are parallel
to the two vectors whose sum is the base vector. In the crossed mode, the arms are mirrored about
the base vector."""


@dataclass(frozen=True)
class Sides:
    """The base vector of a parallelogram as the sum of two vectors with the lengths of the arms.

    Attributes:
        dyad: The ring of three rigid groups and three pins.
        first: The vector that is parallel to the arm vector V in the parallelogram mode.
        turns: The rotations of the two arms in the parallelogram mode.
        crossed: The rotations of the two arms in the crossed mode if the parallelogram is a
            rhombus, or None if its sides are unequal.
        base: The base vector.
    """

    dyad: Dyad
    first: PhasorSum
    turns: tuple[Turned, Turned]
    crossed: tuple[Turned, Turned] | None
    base: PhasorSum


@dataclass(frozen=True, kw_only=True)
class Parallelogram(PlanarStep):
    """Two sides of a parallelogram, which stay parallel to the known opposite sides."""

    title: ClassVar[str] = "a parallelogram"
    branches: ClassVar[Mapping[int, str]] = FIGURES
    reason: ClassVar[str] = (
        "Opposite sides have equal lengths and stay parallel; the crossed parallelogram with these"
        " sides is another branch."
    )

    @classmethod
    def join(cls, clusters: Clusters) -> bool:
        """Join the first ring of three pins that forms a parallelogram or a crossed parallelogram.

        Raises:
            DescriptionError: The parallelogram is stretched at the reference configuration, so both
                assembly modes coincide.
        """
        for pins in clusters.rings(slides=0):
            sides = _sides(clusters, dyad_of(clusters, pins))
            if sides is None:
                continue
            sign = clusters.figure(_figure(clusters, sides), sides.dyad.pins)
            turns = sides.turns if sign > 0 else sides.crossed
            if turns is None:
                clusters.steps.append(_mirrored(clusters, sides))
                return True
            joints, axes, relation = join_dyad(clusters, sides.dyad, *turns)
            step = cls(joints=joints, axes=axes, relation=relation, sign=sign)
            clusters.steps.append(step)
            return True
        return False

    def equations(self) -> StepEquations:
        """Return no equations."""
        return StepEquations()


@dataclass(frozen=True, kw_only=True)
class CrossedParallelogram(LoopStep):
    """The mirror image of a parallelogram about the base line.

    Attributes:
        base: The base vector as named components.
    """

    base: Complex

    title: ClassVar[str] = "a crossed parallelogram"
    branches: ClassVar[Mapping[int, str]] = FIGURES

    def equations(self) -> StepEquations:
        """Return the equation for the angle from the vector (x, -y) to the base vector (x, y)."""
        (angle,) = self.solved
        D, d = components("D"), length_of("D")
        x, y = self.base
        across = (-2 * D[1], 2 * D[0])
        return StepEquations(
            vectors={"D": self.base, "A": (x, -y)},
            lengths=("D",),
            angles=(AngleEquation(angle, "A", D),),
            rates=(RateEquation(((angle, d**2),), weighted(D, across)),),
        )

    @property
    def remark(self) -> str:
        """A sentence that compares the crossed mode with the parallelogram."""
        return (
            "The arms are the mirror images about ${D}$ of two vectors whose sum is ${D}$; the"
            " other branch is the parallelogram."
        )


def _mirrored(clusters: Clusters, sides: Sides) -> CrossedParallelogram:
    terms, dyad = clusters.terms, sides.dyad
    x, y = D = sides.base.coordinates(terms)
    square = terms.let(terms.let(x * x) + terms.let(y * y))
    # The mirror image of a vector C about the base D is e^(i psi) conj(C), where e^(i psi) = D /
    # conj(D).
    c = terms.let(terms.let((x - y) * (x + y)) / square)
    s = terms.let(terms.let(2 * x * y) / square)
    psi = clusters.solved(c, s, _rate_of_mirror(D, square))
    turn_V, turn_W = sides.turns
    turns = _mirror(dyad.V, turn_V, psi), _mirror(dyad.W, turn_W, psi)
    joints, axes, relation = join_dyad(clusters, dyad, *turns)
    return CrossedParallelogram(
        joints=joints, axes=axes, relation=relation, solved=(psi,), sign=-1, base=D
    )


def _sides(clusters: Clusters, dyad: Dyad) -> Sides | None:
    """Return the sides of a dyad that is a parallelogram, or None for other dyads."""
    if not may_be_parallelogram(clusters, dyad):
        return None
    D = dyad.D.reduced(clusters.relations, lambda total: len(total.terms))
    if len(D.terms) != SIDES_OF_THE_BASE:
        return None
    parts = [PhasorSum.of(vector, angle) for angle, vector in D.terms.items()]
    found = []
    for C, rest in permutations(parts):
        turn_V, turn_W = exact_turn(dyad.V, C), exact_turn(dyad.W, -rest)
        if turn_V is not None and turn_W is not None:
            found.append((C, (turn_V, turn_W)))
    if not found:
        return None
    (C, turns), *others = found
    return Sides(dyad, C, turns, others[0][1] if others else None, D)


def _figure(clusters: Clusters, sides: Sides) -> int:
    """Return the mode at the reference: 1 for a parallelogram, -1 if crossed, 0 if ambiguous."""
    if clusters.branch is not None:
        return 0
    c, d = (clusters.reference.vector(total) for total in (sides.first, sides.base))
    return side_of(clusters, sides.dyad) * (1 if (d.conjugate() * c).imag > 0 else -1)


def _mirror(arm: PhasorSum, turn: Turned, mirrored: sp.Expr) -> Turned:
    """Return the rotation from an arm to its mirror image about the base.

    Let V = v e^(i beta) be the arm vector, and C = e^(i alpha) r V the rotated arm vector. The
    mirror image e^(i psi) conj(C) equals e^(i (psi - alpha - 2 beta)) conj(r v) / v V.
    """
    ((beta, v),) = arm.terms.items()
    alpha, rotor = turn
    return sp.expand(mirrored - alpha - 2 * beta), quotient(conjugate(product(rotor, v)), v)


def _rate_of_mirror(D: Complex, square: sp.Expr) -> LoopRate:
    def rate(tangent: Tangent) -> sp.Expr:
        let = tangent.terms.let
        return let(2 * let(cross(D, rates_of(tangent, D))) / square)

    return rate
