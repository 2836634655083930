"""Dyads with three pins: two arms rotate on a base, and a pin connects the arms."""

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import NEARLY_DEAD, VANISHED
from ..model.phasors import PhasorSum, dot, is_zero, quotient
from ..model.planes import Edge, PinEdge
from .clusters import Cluster, Clusters, Turned

SIDES = {1: "left", -1: "right"}
"""Side of the base on which the pin between the two arms lies, keyed by the branch sign."""


@dataclass(frozen=True)
class Dyad:
    """A ring of three rigid groups and three pins.

    The two arms have the vectors V and W, and are connected by a pin.

    Attributes:
        clusters: The three rigid groups: the base group, and the arm groups X and Y.
        pins: The pins between base and X, between X and Y, and between base and Y.
        V: Vector on X, from the pin between base and X to the pin between X and Y.
        W: Vector on Y, from the pin between base and Y to the pin between X and Y.
        D: Vector on the base, from the pin between base and X to the pin between base and Y.
    """

    clusters: tuple[Cluster, Cluster, Cluster]
    pins: tuple[PinEdge, PinEdge, PinEdge]
    V: PhasorSum
    W: PhasorSum
    D: PhasorSum


def dyad_of(clusters: Clusters, edges: Sequence[Edge]) -> Dyad:
    """Return the dyad of three bodies that are connected pairwise by three pins."""
    pins = [edge for edge in edges if isinstance(edge, PinEdge)]
    corners = {id(c): c for pin in pins for c in map(clusters.cluster, (pin.a, pin.b))}
    base, X, Y = clusters.first(*corners.values())
    to_X, to_Y, far = (clusters.shared(pins, *pair) for pair in ((base, X), (base, Y), (X, Y)))
    return Dyad(
        (base, X, Y),
        (to_X, far, to_Y),
        V=clusters.pin(X, far) - clusters.pin(X, to_X),
        W=clusters.pin(Y, far) - clusters.pin(Y, to_Y),
        D=clusters.pin(base, to_Y) - clusters.pin(base, to_X),
    )


def join_dyad(
    clusters: Clusters, dyad: Dyad, turn_X: Turned, turn_Y: Turned
) -> tuple[tuple[str, ...], str, PhasorSum]:
    """Join the rigid groups of a dyad after their rotations are solved.

    Returns:
        The pin names, the name of the body in whose axes the loop equation is written, and the loop
        equation.
    """
    base, X, Y = dyad.clusters
    to_X, _, to_Y = dyad.pins
    axes = next(iter(base))
    relation = dyad.V.times(turn_X[1]).turned(turn_X[0])
    relation = relation - dyad.W.times(turn_Y[1]).turned(turn_Y[0]) - dyad.D
    if relation.terms:
        clusters.relations.append(relation)
    at_X = clusters.pin(base, to_X), clusters.pin(X, to_X)
    at_Y = clusters.pin(base, to_Y), clusters.pin(Y, to_Y)
    clusters.mount(base, X, turn_X, *at_X)
    clusters.mount(base, Y, turn_Y, *at_Y)
    return tuple(pin.name for pin in dyad.pins), axes, relation


def side_of(clusters: Clusters, dyad: Dyad) -> int:
    """Return the side of the base on which the middle pin lies at the reference configuration.

    The returned side is 0 if the side is ambiguous, or if ``clusters`` specifies a branch.
    """
    if clusters.branch is not None:
        return 0
    v, w, d = (clusters.reference.vector(vector) for vector in (dyad.V, dyad.W, dyad.D))
    base, X, Y = dyad.clusters
    distances = {}
    for sign in SIDES:
        C = meeting(abs(v), abs(w), d, sign)
        if C is None:
            return 0
        turns = {id(base): 0.0, id(X): cmath.phase(C / v), id(Y): cmath.phase((C - d) / w)}
        distances[sign] = clusters.distance(dyad.pins, turns)
    return clusters.nearer(distances)


def meeting(v: float, w: float, d: complex, sign: int) -> complex | None:
    """Return an intersection of two circles about the ends of the vector d.

    The function returns None if the circles do not intersect.
    """
    p = (abs(d) ** 2 + v**2 - w**2) / 2
    square = abs(d) ** 2 * v**2 - p**2
    if not square >= 0 or d == 0:
        return None
    return d * complex(p, sign * math.sqrt(square)) / abs(d) ** 2


def exact_turn(here: PhasorSum, there: PhasorSum) -> Turned | None:
    """Return the rotation from ``here`` to ``there``, or None if the rotation is not exact.

    The rotation is exact if both vectors have a single term and equal lengths.
    """
    if len(here.terms) != 1 or len(there.terms) != 1:
        return None
    ((angle, a),) = here.terms.items()
    ((angle_there, b),) = there.terms.items()
    if not is_zero(dot(a, a) - dot(b, b)):
        return None
    return angle_there - angle, quotient(b, a)


def clear_ring(clusters: Clusters) -> tuple[Edge, ...] | None:
    """Return the first loop with three pins that is not near a dead point.

    If all loops with three pins are near a dead point, the first loop is returned. If there is no
    loop with three pins, None is returned.
    """
    rings = list(clusters.rings(slides=0))
    clear = (ring for ring in rings if _margin(clusters, dyad_of(clusters, ring)) > NEARLY_DEAD)
    return next(clear, rings[0] if rings else None)


def _margin(clusters: Clusters, dyad: Dyad) -> float:
    """Return sin^2 of the angle between the arms of a dyad.

    The returned number is negative if the arms cannot meet.
    """
    v, w, d = (abs(clusters.reference.vector(vector)) for vector in (dyad.V, dyad.W, dyad.D))
    if not v * w:
        return -1.0
    return ((v + w) ** 2 - d**2) * (d**2 - (v - w) ** 2) / (4 * v**2 * w**2)


def may_be_parallelogram(clusters: Clusters, dyad: Dyad) -> bool:
    """Whether the dyad may be a parallelogram.

    This function tests numerically, which is much faster than the exact test for a parallelogram.
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
    if len(best) != len(SIDES):
        return False
    sides = sorted(map(abs, best.values()))
    arms = sorted(abs(clusters.reference.vector(arm)) for arm in (dyad.V, dyad.W))
    return all(abs(a - b) <= VANISHED * b for a, b in zip(sides, arms, strict=True))


def _less(
    total: dict[sp.Expr, complex], relation: dict[sp.Expr, complex], factor: complex
) -> dict[sp.Expr, complex]:
    """Subtract ``factor`` times ``relation`` from ``total``.

    Drop coefficients of the difference that are rounding errors.
    """
    size = max(map(abs, total.values()))
    rest = {
        angle: total.get(angle, 0j) - factor * relation.get(angle, 0j)
        for angle in {**total, **relation}
    }
    return {angle: c for angle, c in rest.items() if abs(c) > VANISHED * size}
