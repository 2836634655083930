"""Solves rings of three bodies with two pins and a slide by intersecting a circle with a line.

Source:
    Assur groups of class II (dyads RRP, RPR and PRR, and the triangle of a cylinder); Myszka,
    Machines and Mechanisms, ch. 4.
"""

import cmath
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import sympy as sp

from ...terms.tangents import LoopRate, Tangent
from ...terms.terms import Terms
from ..model.phasors import REAL, ZERO, Complex, PhasorSum, cross, dot
from ..model.planes import Edge, PinEdge, SlideEdge, is_cylinder
from .arm import Arm, arm, rates_of, turn_of
from .clusters import Cluster, Clusters, Guide, PlanarStep
from .loop_step import (
    AngleEquation,
    RateEquation,
    StepEquations,
    components,
    length_of,
    quantity,
    weighted,
)

TRAVELS = {1: "far", -1: "near"}
"""Names of the branch with the larger travel and of the branch with the smaller travel."""


@dataclass(frozen=True)
class CircleAndLine:
    """A point on a line at a known distance from a second point.

    Attributes:
        offset: Vector from the first to the second pin at zero travel, in the frame of the line.
        direction: Unit vector along the line.
        r: The vector between both pins on the third body.
        travel: Travel along the line (meter).
        vector: The vector from the first pin to the second pin, in the frame of the line.
        margin: cos^2 of the angle between the line and the vector from the first to the second pin.
            The margin is zero at a dead point, and negative if the circle and the line do not
            intersect.
        root: Signed position of the second pin on the line. The position 0 is the foot of the
            perpendicular from the first pin to the line. The root is NaN if the circle and the line
            do not intersect.
    """

    offset: Complex
    direction: Complex
    r: Arm
    travel: sp.Expr
    vector: Complex
    margin: sp.Expr
    root: sp.Expr


def circle_and_line(
    terms: Terms,
    offset: Complex,
    direction: Complex,
    r: Arm,
    sign: int,
    gate: Callable[[sp.Expr], sp.Expr] = lambda square: square,
) -> CircleAndLine:
    """Solve ``|offset + t direction| = |r|`` for the travel t.

    With n = direction x offset and m = direction . offset, the travel is t = -m + sign sqrt((|r| -
    n)(|r| + n)).

    Args:
        terms: Receives the terms.
        offset: The vector from the first to the second pin at zero travel of the slide.
        direction: Unit vector along the slide.
        r: The vector between the pins on the third body.
        sign: 1 for the larger travel, -1 for the smaller travel.
        gate: Function of the radicand that returns a negative number if the arm length is invalid.
    """
    n = terms.let(sp.expand(cross(direction, offset)))
    m = terms.let(sp.expand(dot(direction, offset)))
    radius = terms.let(sp.sqrt(r.square))
    inside = gate(r.square if n == 0 else terms.let(terms.let(radius - n) * terms.let(radius + n)))
    along = terms.let(sign * sp.sqrt(inside))
    x = terms.let(direction[0] * along - direction[1] * n)
    y = terms.let(direction[1] * along + direction[0] * n)
    margin = sp.Integer(1) if inside == r.square else terms.let(inside / r.square)
    return CircleAndLine(offset, direction, r, terms.let(along - m), (x, y), margin, along)


def rate_of_third(line: CircleAndLine) -> LoopRate:
    """Return the function for the rate phi' of the third body.

    The rate phi' satisfies |r|^2 phi' = u x u' - r x r', where u is the vector between the two
    pins.
    """

    def rate(tangent: Tangent) -> sp.Expr:
        let = tangent.terms.let
        along = tangent.of(line.travel)
        offset, r = rates_of(tangent, line.offset), rates_of(tangent, line.r.vector)
        u = let(offset[0] + along * line.direction[0]), let(offset[1] + along * line.direction[1])
        top = cross(line.vector, u) - cross(line.r.vector, r)
        return let(let(top) / line.r.square)

    return rate


def travel_remark(sign: int) -> str:
    """Return a sentence that states which of the two solutions for the travel is used."""
    size = "greater" if sign > 0 else "smaller"
    return f"The sign of the root selects the {size} of two displacements."


@dataclass(frozen=True, kw_only=True)
class TwoPinsAndSlide(PlanarStep):
    """A slide whose two bodies are connected to a third body by pins.

    Attributes:
        line: The line along which a pin slides, and the circle on which the third body carries this
            pin.
        is_length: Whether the displacement of the slide is the length of a cylinder between known
            points. A cylinder between known points has a single length.
    """

    line: CircleAndLine
    is_length: bool = False

    title: ClassVar[str] = "two pins and a prismatic joint"
    branches: ClassVar[Mapping[int, str]] = TRAVELS
    dead_point: ClassVar[str] = "the line through the pins is perpendicular to the prismatic joint"

    @classmethod
    def join(cls, clusters: Clusters) -> bool:
        """Join the first three rigid groups that two pins and a slide connect."""
        edges = clusters.ring(slides=1)
        if edges is None:
            return False
        (slide,) = (edge for edge in edges if isinstance(edge, SlideEdge))
        pins = [edge for edge in edges if isinstance(edge, PinEdge)]
        terms = clusters.terms
        base, Y = clusters.first(clusters.cluster(slide.a), clusters.cluster(slide.b))
        ends = (clusters.cluster(body) for pin in pins for body in (pin.a, pin.b))
        Z = next(cluster for cluster in ends if cluster is not base and cluster is not Y)
        near, far = clusters.shared(pins, base, Z), clusters.shared(pins, Y, Z)
        guide = clusters.guide(slide, base, Y)
        delta = guide.along.common_angle()
        mount = guide.mounted(ZERO)
        offset = mount.origin + clusters.pin(Y, far).times(mount.rotor).turned(mount.angle)
        offset = (offset - clusters.pin(base, near)).turned(-delta)
        direction = guide.along.turned(-delta).coordinates(terms)
        R = clusters.pin(Z, far) - clusters.pin(Z, near)
        r = arm(terms, R)
        joints = slide, near, far
        parts = base, Y, Z
        at_zero = offset.coordinates(terms)
        # The length of a cylinder is the positive root. If the guide is not the axis of a cylinder,
        # two travels are possible.
        is_length = is_cylinder(slide) and terms.let(sp.expand(cross(direction, at_zero))) == 0
        sign = 1
        if not is_length:
            reach = _reach(clusters, offset, direction, R, guide, joints, parts)
            sign = clusters.sign(reach, joints)
        gate = partial(clusters.while_long, parts=parts)
        line = circle_and_line(terms, at_zero, direction, r, sign, gate)
        turn = clusters.solved(*turn_of(terms, line.vector, r), rate_of_third(line))
        angle = sp.expand(delta + turn - r.angle)
        relation = offset.turned(delta) + guide.along.times((line.travel, ZERO))
        relation = relation - R.turned(angle)
        clusters.steps.append(
            cls(
                joints=(slide.name, far.name, near.name),
                axes=next(iter(base)),
                relation=relation,
                turned=delta,
                solved=(turn,),
                margin=None if line.margin == 1 else line.margin,
                root=line.root,
                sign=sign,
                line=line,
                is_length=is_length,
            )
        )
        clusters.relations.append(relation)
        clusters.travels[slide.name] = line.travel
        at = clusters.pin(base, near), clusters.pin(Z, near)
        clusters.join(base, Y, guide.mounted(line.travel))
        clusters.mount(base, Z, (angle, REAL), *at)
        return True

    def equations(self) -> StepEquations:
        """Return the equations for the travel t and the third-body rotation that maps A to C."""
        D, A, B, C = (components(letter) for letter in "DABC")
        a = length_of("A")
        n, m, t = map(quantity, "nmt")
        # If the pin is on the line of the guide (n = 0), the square root is the length |a|.
        root = sp.Abs(a) if self.margin is None else sp.sqrt(a**2 - n**2)
        (angle,) = self.solved
        across = -C[1], C[0]
        right = (*weighted(D, across), (t, dot(across, B)), *weighted(A, (-A[1], A[0]), -1))
        return StepEquations(
            vectors={"D": self.line.offset, "B": self.line.direction, "A": self.line.r.vector},
            lengths=("A",),
            unknowns={t: self.line.travel},
            results=(
                (n, cross(B, D)),
                (m, dot(B, D)),
                (t, self.sign * root - m),
                (C[0], B[0] * (t + m) - B[1] * n),
                (C[1], B[1] * (t + m) + B[0] * n),
            ),
            angles=(AngleEquation(angle, "A", C),),
            margin=None if self.margin is None else (a**2 - n**2) / a**2,
            rates=(
                RateEquation(((t, t + m),), (*weighted(A, A), *weighted(D, C, -1))),
                RateEquation(((angle, a**2),), right),
            ),
        )

    @property
    def branch(self) -> str:
        """Name of the branch, or "" if the travel is the length of a cylinder and has no branch."""
        return "" if self.is_length else self.branches[self.sign]

    @property
    def is_choice(self) -> bool:
        """Whether the travel of the slide has two solutions."""
        return not self.is_length

    @property
    def remark(self) -> str:
        """A sentence that states which of two travel solutions is used, or "" for one solution."""
        return travel_remark(self.sign) if self.branch else ""


def _reach(
    clusters: Clusters,
    offset: PhasorSum,
    direction: Complex,
    R: PhasorSum,
    guide: Guide,
    edges: tuple[Edge, ...],
    parts: tuple[Cluster, Cluster, Cluster],
) -> int:
    """Return 1 if the slide travel at the reference is the larger root, or -1 for the smaller root.

    The function returns 0 if a branch is given, no real root exists, or both roots are equally near
    the reference.
    """
    if clusters.branch is not None:
        return 0
    reference = clusters.reference
    o, r = reference.vector(offset), reference.vector(R)
    d = reference.number(direction)
    n, m = (d.conjugate() * o).imag, (d.conjugate() * o).real
    square = abs(r) ** 2 - n**2
    if not square >= 0:
        return 0
    base, Y, Z = parts
    turn_Y = reference.turn(guide.angle, guide.rotor)
    delta = reference.of(guide.along.common_angle())
    distances = {}
    for sign in TRAVELS:
        along = sign * math.sqrt(square)
        turn_Z = delta + cmath.phase(d * complex(along, n) / r)
        turns = {id(base): 0.0, id(Y): turn_Y, id(Z): turn_Z}
        distances[sign] = clusters.distance(edges, turns, along - m)
    return clusters.nearer(distances)
