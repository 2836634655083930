"""Solves for the position of a platform that keeps its orientation and rests on ball-ended struts.

The platform position is an intersection of three spheres.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Strut
from ...model.robot import Joint
from ...model.tolerances import ZERO_COMPONENT
from ...terms.generic_point import GenericPoint, coordinates_in
from ...terms.tangents import Tangent
from ...terms.terms import Terms
from ...terms.vectors import ONE, ZERO, Vector, cross, dot, named, subtracted
from ..model.body_frames import pose_of
from ..planar.loop_step import (
    HALF,
    SPACE,
    Cross,
    RateEquation,
    StepEquations,
    components,
    half,
    quantity,
    weighted,
)
from .struts import SIGNS, Legs, LegStep

SPHERES = 3
CENTERS = "ABC"


@dataclass(frozen=True)
class Sphere:
    """The sphere on which a strut keeps the origin of the platform.

    Attributes:
        center: The center of the sphere in the base frame (meter).
        square: The squared radius.
    """

    center: Vector
    square: sp.Expr


@dataclass(frozen=True, kw_only=True)
class ThreeSpheres(LegStep):
    """The position of a platform that only translates.

    Attributes:
        spheres: The three spheres.
        position: The origin of the platform in the base frame (meter).
    """

    spheres: tuple[Sphere, ...]
    position: Vector

    title: ClassVar[str] = "intersection of three spheres"
    branches: ClassVar[Mapping[int, str]] = {1: "above", -1: "below"}
    dead_point: ClassVar[str] = "${P}$ is in the plane of ${A}$, ${B}$ and ${C}$"

    @classmethod
    def use(cls, legs: Legs, struts: Sequence[Strut]) -> bool:
        """Solve for the displacements of the three prismatic joints of a platform on struts."""
        path = _joints_to_tip(legs, struts)
        # With fewer struts than unknown joints, the rotations of the platform are not determined.
        if path is None or len(struts) < len(path):
            return False
        sliders, (turned, still) = path[:SPHERES], _at_rest(legs, path)
        spheres = _distinct(legs.terms, spheres_of(legs, struts))
        if len(spheres) != SPHERES:
            return False
        axes = [legs.axis(joint, still) for joint in sliders]
        meet = _meeting(legs.terms, spheres, lambda h2: reduce(legs.while_long, struts, h2))
        distances = {}
        if legs.branch is None:
            distances = {s: _distance(legs, meet.position(s), axes, sliders) for s in SIGNS}
        sign = legs.sign(distances, struts[0].name)
        position = meet.position(sign)
        _note_rates(legs, position, [sphere.center for sphere in spheres])
        margin = legs.terms.let(meet.h2 / spheres[0].square)
        for joint, axis in zip(sliders, axes, strict=True):
            along = dot(legs.terms, axis, position)
            legs.known.values[joint.name] = joint.direction * along
        legs.known.values.update(turned)
        legs.known.steps.append(
            cls(
                joints=tuple(strut.name for strut in struts),
                axes=legs.mechanism.base_frame,
                margin=margin,
                root=meet.rise,
                sign=sign,
                spheres=tuple(spheres),
                position=position,
            )
        )
        return True

    def equations(self) -> StepEquations:
        """Return the equations for the position P, which has known distances from A, B and C."""
        A, B, C, P, n, u, v, w = map(quantity, (*CENTERS, "P", "n", "u", "v", "w"))
        alpha, beta = quantity("alpha"), quantity("beta")
        squares = [quantity(f"l{k}^2") for k in range(1, SPHERES + 1)]
        l1, l2, l3 = squares
        at = components("P", SPACE)
        rates = []
        for letter, center in zip(CENTERS, (A, B, C), strict=True):
            entries = components(letter, SPACE)
            normal = tuple(p - c for p, c in zip(at, entries, strict=True))
            rates.append(
                RateEquation(weighted(at, normal), weighted(entries, normal), (P - center, P))
            )
        return StepEquations(
            vectors={
                letter: sphere.center for letter, sphere in zip(CENTERS, self.spheres, strict=True)
            },
            scalars=dict(zip(squares, (sphere.square for sphere in self.spheres), strict=True)),
            unknowns=dict(zip(at, self.position, strict=True)),
            results=(
                (u, B - A),
                (v, C - A),
                (w, Cross(u, v)),
                (alpha, half(u**2 + l1 - l2)),
                (beta, half(v**2 + l1 - l3)),
                (n, (alpha * Cross(v, w) + beta * Cross(w, u)) / w**2),
                (P, A + n + self.sign * w * sp.sqrt((l1 - n**2) / w**2)),
            ),
            margin=(l1 - n**2) / l1,
            rates=tuple(rates),
        )

    @property
    def remark(self) -> str:
        """A sentence that states the platform's side of the plane through the sphere centers."""
        return (
            f"The sign of the root puts ${{P}}$ {self.branch} the plane of ${{A}}$, ${{B}}$ and"
            " ${C}$, where ${w}$ points up."
        )


# --- platform with constant orientation ---


def spheres_of(legs: Legs, struts: Sequence[Strut]) -> list[Sphere]:
    """Return, for each strut, the sphere on which the strut keeps the platform origin.

    The list of spheres is empty unless three unknown prismatic joints move the platform, and all
    strut lengths are known.
    """
    path = _joints_to_tip(legs, struts)
    if path is None:
        return []
    _, still = _at_rest(legs, path)
    return [_sphere(legs, strut, path, still) for strut in struts]


def _at_rest(
    legs: Legs, path: Sequence[Joint]
) -> tuple[Mapping[str, sp.Expr], Mapping[str, sp.Expr]]:
    """Return the reference angles of the platform joints, and a mapping of all known values.

    The mapping of known values includes the reference angles, and the value 0 for each slider of
    the platform.
    """
    turned = {joint.name: legs.mechanism.reference_of(joint.name) for joint in path[SPHERES:]}
    at_zero = dict.fromkeys((joint.name for joint in path[:SPHERES]), ZERO)
    return turned, {**legs.known.values, **turned, **at_zero}


def _joints_to_tip(legs: Legs, struts: Sequence[Strut]) -> list[Joint] | None:
    """Return the joints of the platform on which all struts end, or None. Sliders come first."""
    if len(struts) < SPHERES or any(legs.length(strut) is None for strut in struts):
        return None
    if any(legs.unknown(strut.a) and legs.unknown(strut.b) for strut in struts):
        return None
    paths = [legs.unknown(strut.b) or legs.unknown(strut.a) for strut in struts]
    path = paths[0]
    sliders = [joint for joint in path if joint.kind == "prismatic"]
    is_free = len(sliders) == SPHERES and path[:SPHERES] == sliders
    return path if is_free and all(other == path for other in paths) else None


def _sphere(
    legs: Legs, strut: Strut, path: Sequence[Joint], still: Mapping[str, sp.Expr]
) -> Sphere:
    """Return the sphere on which a strut keeps the origin of the moving body."""
    on_a = path[0] in legs.mechanism.path_to(strut.a.body)
    moved, fixed = (strut.a, strut.b) if on_a else (strut.b, strut.a)
    _, offset = pose_of(legs.mechanism, legs.terms, moved, still)
    _, point = pose_of(legs.mechanism, legs.terms, fixed, legs.known.values)
    length = legs.length(strut)
    assert length is not None
    return Sphere(subtracted(legs.terms, point, offset), legs.terms.let(length**2))


def _distinct(terms: Terms, spheres: Sequence[Sphere]) -> list[Sphere]:
    """Remove duplicates from a sequence of spheres."""
    entries = [entry for sphere in spheres for entry in (*sphere.center, sphere.square)]
    generic = GenericPoint(terms, coordinates_in(terms, entries))
    found: list[Sphere] = []
    seen: list[list[sp.Expr]] = []
    for sphere in spheres:
        numbers = [generic.value(entry) for entry in (*sphere.center, sphere.square)]
        if not any(_are_equal(numbers, other) for other in seen):
            found.append(sphere)
            seen.append(numbers)
    return found


def _are_equal(numbers: Sequence[sp.Expr], others: Sequence[sp.Expr]) -> bool:
    return all(abs(a - b) < ZERO_COMPONENT for a, b in zip(numbers, others, strict=True))


# --- intersection of three spheres ---


@dataclass(frozen=True)
class _Meeting:
    """The two intersections of three spheres. The sign of a square root selects an intersection.

    The vectors u and v point from the first center to the second and third center, and w is u x v.
    The vector p from the first center to an intersection satisfies p . u = alpha and p . v = beta.
    Therefore, p = n / w^2 + sign w sqrt(h^2 / w^2) with n = alpha (v x w) + beta (w x u). In this
    formula for p, h^2 = l^2 - n^2 / w^4, and l is the radius of the first sphere.
    """

    terms: Terms
    center: Vector
    foot: Vector
    w: Vector
    h2: sp.Expr
    rise: sp.Expr

    def position(self, sign: int) -> Vector:
        parts = zip(self.center, self.foot, self.w, strict=True)
        return named(self.terms, (c + f + sign * self.rise * e for c, f, e in parts))


def _meeting(
    terms: Terms, spheres: Sequence[Sphere], gate: Callable[[sp.Expr], sp.Expr]
) -> _Meeting:
    let = terms.let
    (c1, c2, c3), (l1, l2, l3) = zip(*((s.center, s.square) for s in spheres), strict=True)
    u, v = subtracted(terms, c2, c1), subtracted(terms, c3, c1)
    w = cross(terms, u, v)
    alpha = let(HALF * (dot(terms, u, u) + l1 - l2))
    beta = let(HALF * (dot(terms, v, v) + l1 - l3))
    vw, wu = cross(terms, v, w), cross(terms, w, u)
    w2 = dot(terms, w, w)
    foot = named(terms, (let(alpha * a + beta * b) / w2 for a, b in zip(vw, wu, strict=True)))
    h2 = gate(let(l1 - dot(terms, foot, foot)))
    return _Meeting(terms, c1, foot, w, h2, let(sp.sqrt(let(h2 / w2))))


def _distance(
    legs: Legs, position: Vector, axes: Sequence[Vector], sliders: Sequence[Joint]
) -> float:
    """Return how far a position is from the reference position, relative to the mechanism size."""
    of = legs.reference.of
    hints = legs.reference.hints_of([joint.name for joint in sliders])
    p = [of(entry) for entry in position]
    return (
        math.hypot(
            *(
                joint.direction * sum(of(a) * x for a, x in zip(axis, p, strict=True))
                - hints.get(joint.name, 0.0)
                for joint, axis in zip(sliders, axes, strict=True)
            )
        )
        / legs.reference.size
    )


def _note_rates(legs: Legs, position: Vector, centers: Sequence[Vector]) -> None:
    """Record the time derivative of the platform position p.

    The derivative follows from the equations ``(p - c_i) . (p' - c_i') = 0`` for the sphere centers
    c_i.
    """
    terms = legs.terms
    normals = [subtracted(terms, position, center) for center in centers]
    pairs = [(normals[k - 2], normals[k - 1]) for k in range(SPHERES)]
    crosses = [cross(terms, *pair) for pair in pairs]
    volume = dot(terms, normals[0], crosses[0])
    for k, component in enumerate(position):
        factors = named(terms, (product[k] / volume for product in crosses))
        sign = -ONE if (-component).is_Symbol else ONE
        rate = partial(_rate_on_spheres, normals, centers, factors, sign)
        legs.known.loops.setdefault(sign * component, rate)


def _rate_on_spheres(
    normals: Sequence[Vector],
    centers: Sequence[Vector],
    factors: Vector,
    sign: sp.Integer,
    tangent: Tangent,
) -> sp.Expr:
    terms = tangent.terms
    along = named(
        terms,
        (
            dot(terms, n, named(terms, tangent.of_each(c)))
            for n, c in zip(normals, centers, strict=True)
        ),
    )
    return sign * dot(terms, factors, along)
