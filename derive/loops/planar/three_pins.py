"""Solves a loop of three pins by intersecting two circles.

Source: Assur groups of class II (dyad RRR); Myszka, Machines and Mechanisms, ch. 4. The closed form
for three pins needs no acos, and is accurate for thin triangles.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import sympy as sp

from ...terms.tangents import LoopRate, Tangent
from ...terms.terms import Terms
from ..model.phasors import REAL, Complex, cross, dot, product
from .arm import Arm, arm, rates_of, turn_of
from .clusters import Clusters, PlanarStep
from .dyads import SIDES, clear_ring, dyad_of, join_dyad, side_of
from .loop_step import (
    HALF,
    AngleEquation,
    RateEquation,
    StepEquations,
    components,
    half,
    length_of,
    quantity,
    weighted,
)


@dataclass(frozen=True)
class TwoCircles:
    """Two circles about the ends of the base vector D.

    The circles intersect at the shared pin.

    Attributes:
        C: The vector from the first end of D to the shared pin, in the axes of D.
        W: The vector from the second end of D to the shared pin, in the axes of D.
        D: The base.
        v: The vector C in the frame of the body on which C is fixed.
        w: The vector W in the frame of the body on which W is fixed.
        height: Twice the signed area of the triangle with the sides C, D and W.
        margin: Squared sine of the transmission angle, which is zero at a dead point.
    """

    C: Complex
    W: Complex
    D: Complex
    v: Arm
    w: Arm
    height: sp.Expr
    margin: sp.Expr


def two_circles(
    terms: Terms,
    v: Arm,
    w: Arm,
    D: Arm,
    sign: int,
    gate: Callable[[sp.Expr], sp.Expr] = lambda square: square,
) -> TwoCircles:
    """Intersect two circles about the ends of the vector D, with the radii |v| and |w|.

    Let d be the length of D, p = (d^2 + v^2 - w^2) / 2, and 4 h^2 = ((d + w)^2 - v^2)(v^2 - (d -
    w)^2). C and W are the vectors from the first and second end of D to the intersection.

        C = D (p + i h) / d^2,   W = C - D

    Args:
        terms: Names of all terms.
        v: The arm that rotates about the first end of the base D. The arm length |v| is the radius
            of the first circle.
        w: The arm that rotates about the second end of the base D. The arm length |w| is the radius
            of the second circle.
        D: The base.
        sign: 1 if C is to the left of D, -1 if C is to the right of D.
        gate: Function that makes the radicand of h negative if the length of a cylinder is not
            positive.
    """
    squares = v.square, w.square, D.square
    p = terms.let((D.square + v.square - w.square) * HALF)
    product_of_sums = gate(terms.let(_heron(terms, *squares)))
    h = terms.let(sign * HALF * sp.sqrt(product_of_sums))
    if terms.is_constant(D.vector[0]) and terms.is_constant(D.vector[1]):
        x, y = (terms.let(part / D.square) for part in D.vector)
        C = terms.let(x * p - y * h), terms.let(x * h + y * p)
    else:
        along, across = terms.let(p / D.square), terms.let(h / D.square)
        x, y = D.vector
        C = terms.let(x * along - y * across), terms.let(x * across + y * along)
    W = terms.let(C[0] - D.vector[0]), terms.let(C[1] - D.vector[1])
    margin = terms.let(product_of_sums / (4 * v.square * w.square))
    return TwoCircles(C, W, D.vector, v, w, h, margin)


def _heron(terms: Terms, *squares: sp.Expr) -> sp.Expr:
    """Return 16 times the squared triangle area by Heron's formula, without cancellation."""
    varying = sorted(squares, key=terms.is_constant)
    alone, a, b = varying
    side_a, side_b = (terms.let(sp.sqrt(square)) for square in (a, b))
    wide, narrow = terms.let((side_a + side_b) ** 2), terms.let((side_a - side_b) ** 2)
    return terms.let(wide - alone) * terms.let(alone - narrow)


def rate_of_first(triangle: TwoCircles, c: sp.Expr, s: sp.Expr) -> LoopRate:
    """Return the rate of the rotation angle phi of the vector v."""

    def rate(tangent: Tangent) -> sp.Expr:
        D, v, w = (rates_of(tangent, vector) for vector in _moving(triangle))
        turned = product((c, s), v)
        top = dot(D, triangle.W) - dot(turned, triangle.W) + dot(w, triangle.w.vector)
        return tangent.terms.let(tangent.terms.let(top) / triangle.height)

    return rate


def rate_of_second(triangle: TwoCircles, c: sp.Expr, s: sp.Expr) -> LoopRate:
    """Return the rate of the rotation angle psi of the vector w."""

    def rate(tangent: Tangent) -> sp.Expr:
        D, v, w = (rates_of(tangent, vector) for vector in _moving(triangle))
        turned = product((c, s), w)
        top = dot(D, triangle.C) - dot(v, triangle.v.vector) + dot(turned, triangle.C)
        return tangent.terms.let(tangent.terms.let(top) / triangle.height)

    return rate


def _moving(triangle: TwoCircles) -> tuple[Complex, Complex, Complex]:
    return triangle.D, triangle.v.vector, triangle.w.vector


def circle_equations(triangle: TwoCircles, sign: int, *solved: sp.Symbol) -> StepEquations:
    """Return the equations for the intersection of two circles.

    In the returned equations, the vectors v and w of ``TwoCircles`` are called A and B.

    Args:
        triangle: The triangle.
        sign: Sign of the square root h, which selects one of the two intersections.
        solved: The angle of the vector A, followed by the angle of the vector B if B rotates.
    """
    D, A, B, C, E = (components(letter) for letter in "DABCE")
    d, a, b = map(length_of, "DAB")
    p, h = quantity("p"), quantity("h")
    results = (
        (p, half(d**2 + a**2 - b**2)),
        (h, sign * sp.sqrt(d**2 * a**2 - p**2)),
        (C[0], (D[0] * p - D[1] * h) / d**2),
        (C[1], (D[1] * p + D[0] * h) / d**2),
        (E[0], C[0] - D[0]),
        (E[1], C[1] - D[1]),
    )
    sides = (("A", C), ("B", E))
    angles = tuple(AngleEquation(s, *side) for s, side in zip(solved, sides, strict=False))
    rates = []
    for phi, side in zip(solved, "AB", strict=False):
        turn = sp.cos(phi), sp.sin(phi)
        if side == "A":
            back = dot(turn, E), cross(turn, E)
            right = (*weighted(D, E), *weighted(A, back, -1), *weighted(B, B))
        else:
            back = dot(turn, C), cross(turn, C)
            right = (*weighted(D, C), *weighted(A, A, -1), *weighted(B, back))
        rates.append(RateEquation(((phi, h),), right))
    return StepEquations(
        vectors={"D": triangle.D, "A": triangle.v.vector, "B": triangle.w.vector},
        lengths=("D", "A", "B"),
        results=results,
        angles=angles,
        margin=h**2 / (a**2 * b**2),
        rates=tuple(rates),
    )


def side_remark(sign: int) -> str:
    """Return a sentence that states which intersection of the two circles is used."""
    sense = "positive" if sign > 0 else "negative"
    return (
        f"With ${{h}}$ {sense}, the vector ${{C}}$ points to the {SIDES[sign]} of ${{D}}$; the"
        " other sign gives the mirror image."
    )


@dataclass(frozen=True, kw_only=True)
class ThreePins(PlanarStep):
    """Three rigid groups of bodies, connected in a ring by three pins.

    Attributes:
        triangle: The triangle with the three pins as its corners.
    """

    triangle: TwoCircles

    title: ClassVar[str] = "three pins"
    branches: ClassVar[Mapping[int, str]] = SIDES
    dead_point: ClassVar[str] = "the three pins are in line"

    @classmethod
    def join(cls, clusters: Clusters) -> bool:
        """Join three rigid groups that are connected pairwise by three pins."""
        pins = clear_ring(clusters)
        if pins is None:
            return False
        dyad = dyad_of(clusters, pins)
        clusters.bases.append(dyad.D)
        sign = clusters.sign(side_of(clusters, dyad), dyad.pins)
        terms = clusters.terms
        v, w, d = (arm(terms, vector) for vector in (dyad.V, dyad.W, dyad.D))
        gate = partial(clusters.while_long, parts=dyad.clusters)
        found = two_circles(terms, v, w, d, sign, gate)
        turn_v, turn_w = turn_of(terms, found.C, v), turn_of(terms, found.W, w)
        first = clusters.solved(*turn_v, rate_of_first(found, *turn_v))
        second = clusters.solved(*turn_w, rate_of_second(found, *turn_w))
        turns = (d.angle + first - v.angle, REAL), (d.angle + second - w.angle, REAL)
        joints, axes, relation = join_dyad(clusters, dyad, *turns)
        clusters.steps.append(
            cls(
                joints=joints,
                axes=axes,
                relation=relation,
                turned=d.angle,
                solved=(first, second),
                margin=found.margin,
                root=found.height,
                sign=sign,
                triangle=found,
            )
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equations for the intersection of the circles about the two base pins."""
        return circle_equations(self.triangle, self.sign, *self.solved)

    @property
    def remark(self) -> str:
        """A sentence that names the side of the base on which the far pin lies."""
        return side_remark(self.sign)
