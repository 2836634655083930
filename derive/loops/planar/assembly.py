"""Planar loops solved in closed form: bodies are joined, three at a time, until all are one.

At the start every body of a linkage stands alone. Bodies that a known joint or a weld holds are
joined; then any two that share two pins, and any three that pins and slides hold in a triangle
(:mod:`chasles.derive.loops.planar.dyads`), and so on: the mechanism is a sequence of Assur groups
of class II. Whether the actuated joints are known, or those of the main chain, makes no difference
here.

A body's pose in its cluster is an angle, a constant turn and a point that is a sum of turning
vectors; so a parallelogram is recognised by its vectors, and needs no root.
"""

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import sympy as sp

from ...model.errors import RobotError
from ...model.mechanism import Mechanism
from ...terms.tangents import LoopRate
from ...terms.terms import Terms
from .dyads import (
    arm,
    circle_and_line,
    rate_of_direction,
    rate_of_first,
    rate_of_second,
    rate_of_third,
    turn_of,
    two_circles,
    two_lines,
)
from .phasors import (
    REAL,
    ZERO,
    Complex,
    PhasorSum,
    PlanarPose,
    conjugate,
    dot,
    is_zero,
    product,
    quotient,
)
from .planes import Edge, Linkage, Slide, Turn, Weld, tidied_entry
from .reference import AtReference, wrapped

SIDES = {1: "left", -1: "right"}
TRAVELS = {1: "far", -1: "near"}
CLEAR = 1e-6
"""Two branches that differ by less from the reference are not told apart (radian, metre)."""
Turned = tuple[sp.Expr, Complex]
"""A turn: an exact angle, and a constant unit rotor."""


Cluster = dict[str, PlanarPose]
"""Bodies that are rigid together, each with its pose in the cluster's axes."""


@dataclass(frozen=True)
class Step:
    """One group of bodies that was joined, for the reader.

    Attributes:
        kind: ``two circles``, ``circle and line``, ``two lines``, ``parallelogram``, ``two pins``.
        axes: The body in whose axes the loop is written.
        bodies: One body of each cluster: the one at rest first.
        joints: Names of the pins and slides that hold them.
        relation: The loop: a sum of turning vectors that is zero.
        solved: Named angles and travels that the step gives, with their meaning.
        vectors: Components of what the step is solved from, as
            :mod:`chasles.derive.loops.planar.dyads` calls them: ``D`` with the arms ``v`` and
            ``w``; the ``offset``, ``direction`` and ``r``; the ``offset`` with ``e`` and ``f``; or
            ``there`` and ``here``. In space, a distance ``d``, or the spheres' centres ``c1`` to
            ``c3`` with ``l^2`` and the point ``p``.
        travels: Named travels of the slides that the step gives.
        turned: The angle by which the axes of ``D``, ``offset`` or ``there`` are turned.
        margin: 0 at a dead point, below 0 out of reach; None where the step always closes.
        branch: Name of the branch, empty where there is one only.
        sign: Its sign.
    """

    kind: str
    axes: str
    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    relation: PhasorSum
    solved: tuple[sp.Symbol, ...] = ()
    vectors: Mapping[str, tuple[sp.Expr, ...]] = field(default_factory=dict)
    travels: tuple[sp.Expr, ...] = ()
    turned: sp.Expr = ZERO
    margin: sp.Expr | None = None
    branch: str = ""
    sign: int = 0

    def name(self, mechanism: Mechanism) -> str:
        """Names of the closures and struts that it closes."""
        swings = {strut.swing_name: strut.name for strut in mechanism.struts}
        names = [swings.get(name, name.split(".")[0]) for name in self.joints]
        closers = {closer.name for closer in mechanism.closers}
        return " and ".join(dict.fromkeys(name for name in names if name in closers))


@dataclass(frozen=True)
class Assembly:
    """A linkage, solved as far as it goes.

    Attributes:
        steps: In the order of the solution.
        values: Joint, swing and cylinder values as far as determined; angles are sums of solved
            angles and coordinates, and may exceed a turn.
        loops: Rates of the solved angles.
        relations: Sums of turning vectors that are zero.
        open: Names of the edges between bodies that could not be joined.
    """

    steps: tuple[Step, ...]
    values: Mapping[str, sp.Expr]
    loops: Mapping[sp.Symbol, LoopRate]
    relations: tuple[PhasorSum, ...]
    open: tuple[str, ...]


def assemble(
    terms: Terms,
    linkage: Linkage,
    known: Mapping[str, sp.Expr],
    reference: AtReference,
    signs: Iterator[int] | None = None,
) -> Assembly:
    """Solves a linkage for given values of some of its joints.

    Args:
        terms: Names of all terms.
        linkage: Bodies and joints.
        known: Values of joints, swings or cylinders by name (radian, metre).
        reference: The configuration whose branch is meant.
        signs: Signs of the branches, step by step, instead of those at the reference.

    Raises:
        RobotError: A loop does not close at the reference, or its branch there is not clear.
    """
    solver = _Solver(terms, linkage, known, reference, signs)
    solver.run()
    return Assembly(
        tuple(solver.steps),
        solver.values(),
        solver.loops,
        tuple(solver.relations),
        tuple(edge.name for edge in solver.between() if edge in linkage.edges),
    )


class _Solver:
    """The clusters of one linkage on their way to being one."""

    def __init__(
        self,
        terms: Terms,
        linkage: Linkage,
        known: Mapping[str, sp.Expr],
        reference: AtReference,
        signs: Iterator[int] | None,
    ) -> None:
        self.terms, self.linkage, self.known = terms, linkage, known
        self.reference, self.signs = reference, signs
        self.edges = (*linkage.edges, *_implied(linkage.edges))
        self.clusters: list[Cluster] = [{body: PlanarPose()} for body in linkage.bodies]
        self.steps: list[Step] = []
        self.loops: dict[sp.Symbol, LoopRate] = {}
        self.relations: list[PhasorSum] = []
        self.travels: dict[str, sp.Expr] = {}

    def run(self) -> None:
        while self._join_known() or self._join_pinned() or self._join_triangle():
            pass

    def between(self) -> list[Edge]:
        """The edges whose bodies are not yet rigid together."""
        return [e for e in self.edges if self.cluster(e.a) is not self.cluster(e.b)]

    def cluster(self, body: str) -> Cluster:
        return next(cluster for cluster in self.clusters if body in cluster)

    def values(self) -> dict[str, sp.Expr]:
        """Values of all joints between bodies that are rigid together."""
        found = dict(self.known)
        for edge in self.linkage.edges:
            cluster = self.cluster(edge.a)
            if edge.b not in cluster or edge.name in found or isinstance(edge, Weld):
                continue
            if isinstance(edge, Turn):
                found[edge.name] = self._turned(edge, cluster)
            else:
                found[edge.name] = self._travelled(edge, cluster)
        return found

    # --- joining clusters ---

    def _joined(self, base: Cluster, other: Cluster, pose: PlanarPose) -> None:
        base.update({body: pose.carried(there) for body, there in other.items()})
        self.clusters = [cluster for cluster in self.clusters if cluster is not other]

    def _mounted(
        self,
        base: Cluster,
        other: Cluster,
        turn: tuple[sp.Expr, Complex],
        at: PhasorSum,
        at_other: PhasorSum,
    ) -> None:
        """Joins a cluster that is turned by an angle and a rotor and shares a point."""
        angle, rotor = sp.expand(turn[0]), turn[1]
        origin = at - at_other.times(rotor).turned(angle)
        self._joined(base, other, PlanarPose(angle, rotor, origin))

    def _first(self, *clusters: Cluster) -> list[Cluster]:
        """Clusters in order: that of the root first, then those of more bodies."""
        return sorted(clusters, key=lambda c: (self.linkage.root not in c, -len(c)))

    def _join_known(self) -> bool:
        for edge in self.between():
            a, b = self.cluster(edge.a), self.cluster(edge.b)
            on_a, on_b = a[edge.a], b[edge.b]
            rotor = product(product(on_a.rotor, edge.rotor), conjugate(on_b.rotor))
            angle = on_a.angle - on_b.angle
            at_a = edge.at_a
            if isinstance(edge, Weld):
                at_b: Complex = (ZERO, ZERO)
            elif edge.name not in self.known:
                continue
            else:
                at_b = edge.at_b
                value = self.known[edge.name]
                if isinstance(edge, Turn):
                    angle += edge.sense * value
                else:
                    at_a = tuple(p + value * d for p, d in zip(at_a, edge.direction, strict=True))
            turn = angle, self._tidy(rotor)
            self._mounted(a, b, turn, on_a.point(at_a), on_b.point(at_b))
            return True
        return False

    # --- two pins ---

    def _join_pinned(self) -> bool:
        pins = [edge for edge in self.between() if isinstance(edge, Turn)]
        for first, second in combinations(pins, 2):
            base, other = self._first(self.cluster(first.a), self.cluster(first.b))
            if {self._id(second.a), self._id(second.b)} != {id(base), id(other)}:
                continue
            here, there = (self._span(c, first, second) for c in (other, base))
            if not here.terms or not there.terms:
                continue
            turn, solved, vectors = self._turn_between(here, there)
            at = self._pin(base, first), self._pin(other, first)
            bodies = self._named(first, base), self._named(first, other)
            relation = here.times(turn[1]).turned(turn[0]) - there
            self._mounted(base, other, turn, *at)
            self.relations.append(relation)
            joints, axes = (first.name, second.name), next(iter(base))
            step = Step("two pins", axes, bodies, joints, relation, solved, vectors)
            self.steps.append(replace(step, turned=there.common_angle()))
            return True
        return False

    def _turn_between(
        self, here: PhasorSum, there: PhasorSum
    ) -> tuple[Turned, tuple[sp.Symbol, ...], dict[str, Complex]]:
        """The turn that carries one vector to another of the same length."""
        exact = _exact_turn(here, there)
        if exact is not None:
            return exact, (), {}
        a, b = arm(self.terms, there), arm(self.terms, here)
        re, im = product(a.vector, conjugate(b.vector))
        size = self.terms.let(sp.sqrt(a.square * b.square))
        c, s = (self.terms.let(self.terms.let(sp.expand(part)) / size) for part in (re, im))
        angle = self._solved(c, s, rate_of_direction(a.vector, b))
        return (a.angle + angle - b.angle, REAL), (angle,), {"there": a.vector, "here": b.vector}

    # --- triangles ---

    def _join_triangle(self) -> bool:
        """Joins the triangle that costs least: parallelograms need no root, two slides neither."""
        triangles = [edges for edges in combinations(self.between(), 3) if self._is_triangle(edges)]
        ranked = sorted(triangles, key=_slides, reverse=True)
        if not ranked:
            return False
        for edges in ranked:
            pins = [edge for edge in edges if isinstance(edge, Turn)]
            if len(pins) == len(edges) and self._join_parallelogram(self._dyad(pins)):
                return True
        edges = ranked[0]
        slides = [edge for edge in edges if isinstance(edge, Slide)]
        pins = [edge for edge in edges if isinstance(edge, Turn)]
        if len(slides) == 0:
            self._join_three_pins(self._dyad(pins))
        elif len(slides) == 1:
            self._join_two_pins_and_slide(pins, slides[0])
        else:
            self._join_pin_and_two_slides(pins[0], slides)
        return True

    def _is_triangle(self, edges: tuple[Edge, ...]) -> bool:
        """Whether three edges hold three clusters in a ring, at different points."""
        pairs = {frozenset((self._id(edge.a), self._id(edge.b))) for edge in edges}
        if len(pairs) != len(edges) or len(frozenset.union(*pairs)) != len(edges):
            return False
        pins = [edge for edge in edges if isinstance(edge, Turn)]
        if not pins:
            return False
        spans = [
            self._span(self.cluster(body), *pair)
            for pair in combinations(pins, 2)
            for body in (pair[0].a, pair[0].b)
            if self._id(body) in (self._id(pair[1].a), self._id(pair[1].b))
        ]
        return all(span.terms for span in spans)

    def _dyad(self, pins: Sequence[Turn]) -> "_Dyad":
        corners = {id(c): c for pin in pins for c in (self.cluster(pin.a), self.cluster(pin.b))}
        base, X, Y = self._first(*corners.values())
        to_X, to_Y, far = (self._shared(pins, *pair) for pair in ((base, X), (base, Y), (X, Y)))
        return _Dyad(
            (base, X, Y),
            (to_X, far, to_Y),
            V=self._pin(X, far) - self._pin(X, to_X),
            W=self._pin(Y, far) - self._pin(Y, to_Y),
            D=self._pin(base, to_Y) - self._pin(base, to_X),
        )

    def _join_parallelogram(self, dyad: "_Dyad") -> bool:
        D = dyad.D.reduced(self.relations, lambda total: len(total.terms))
        turns = self._parallelogram(dyad.V, dyad.W, D, self._side(dyad))
        if turns:
            self._join_dyad(dyad, *turns, self._step_of(dyad, "parallelogram"))
        return bool(turns)

    def _join_three_pins(self, dyad: "_Dyad") -> None:
        sign = self._sign(self._side(dyad), dyad.pins)
        step = self._step_of(dyad, "two circles")
        self._join_dyad(dyad, *self._two_circles(dyad.V, dyad.W, dyad.D, sign, step))

    def _step_of(self, dyad: "_Dyad", kind: str) -> Step:
        base, X, Y = dyad.clusters
        to_X, _, to_Y = dyad.pins
        bodies = self._named(to_X, base), self._named(to_X, X), self._named(to_Y, Y)
        return Step(
            kind, next(iter(base)), bodies, tuple(pin.name for pin in dyad.pins), PhasorSum()
        )

    def _join_dyad(self, dyad: "_Dyad", turn_X: Turned, turn_Y: Turned, step: Step) -> None:
        base, X, Y = dyad.clusters
        to_X, _, to_Y = dyad.pins
        relation = dyad.V.times(turn_X[1]).turned(turn_X[0])
        relation = relation - dyad.W.times(turn_Y[1]).turned(turn_Y[0]) - dyad.D
        if relation.terms:
            self.relations.append(relation)
        self.steps.append(replace(step, relation=relation))
        at_X = self._pin(base, to_X), self._pin(X, to_X)
        at_Y = self._pin(base, to_Y), self._pin(Y, to_Y)
        self._mounted(base, X, turn_X, *at_X)
        self._mounted(base, Y, turn_Y, *at_Y)

    def _side(self, dyad: "_Dyad") -> int:
        """The side of the base on which the far pin is at the reference; 0 where neither is."""
        v, w, d = (self.reference.vector(vector) for vector in (dyad.V, dyad.W, dyad.D))
        base, X, Y = dyad.clusters
        distances = {}
        for sign in SIDES:
            C = meeting(abs(v), abs(w), d, sign)
            if C is None:
                return 0
            turns = {id(base): 0.0, id(X): cmath.phase(C / v), id(Y): cmath.phase((C - d) / w)}
            distances[sign] = self._distance(dyad.pins, turns)
        return self._nearer(distances)

    def _parallelogram(
        self, V: PhasorSum, W: PhasorSum, D: PhasorSum, sign: int
    ) -> tuple[Turned, Turned] | None:
        """The turns where the base is a sum of two vectors as long as the arms."""
        if len(D.terms) != 2:  # noqa: PLR2004
            return None
        one, two = (PhasorSum.of(vector, angle) for angle, vector in D.terms.items())
        for C, rest in ((one, two), (two, one)):
            turn_V, turn_W = _exact_turn(V, C), _exact_turn(W, -rest)
            c, d = self.reference.vector(C), self.reference.vector(D)
            side = (d.conjugate() * c).imag
            # Away from the reference's branch it is the vectors alone that tell.
            is_meant = side * sign > 0 or self.signs is not None
            if turn_V is not None and turn_W is not None and is_meant:
                return turn_V, turn_W
        return None

    def _two_circles(
        self, V: PhasorSum, W: PhasorSum, D: PhasorSum, sign: int, step: Step
    ) -> tuple[Turned, Turned, Step]:
        v, w, d = (arm(self.terms, vector) for vector in (V, W, D))
        found = two_circles(self.terms, v, w, d, sign)
        c1, s1 = turn_of(self.terms, found.C, v)
        c2, s2 = turn_of(self.terms, found.W, w)
        first = self._solved(c1, s1, rate_of_first(found, c1, s1))
        second = self._solved(c2, s2, rate_of_second(found, c2, s2))
        step = replace(
            step,
            kind="two circles",
            solved=(first, second),
            vectors={"D": d.vector, "v": v.vector, "w": w.vector},
            turned=d.angle,
            margin=found.margin,
            branch=SIDES[sign],
            sign=sign,
        )
        return (d.angle + first - v.angle, REAL), (d.angle + second - w.angle, REAL), step

    def _join_two_pins_and_slide(self, pins: Sequence[Turn], slide: Slide) -> None:
        base, Y = self._first(self.cluster(slide.a), self.cluster(slide.b))
        Z = next(
            cluster
            for pin in pins
            for cluster in (self.cluster(pin.a), self.cluster(pin.b))
            if cluster is not base and cluster is not Y
        )
        near, far = self._shared(pins, base, Z), self._shared(pins, Y, Z)
        guide = self._guide(slide, base, Y)
        delta = guide.along.common_angle()
        mount = guide.mounted(ZERO)
        offset = mount.origin + self._pin(Y, far).times(mount.rotor).turned(mount.angle)
        offset = (offset - self._pin(base, near)).turned(-delta)
        direction = guide.along.turned(-delta).coordinates(self.terms)
        R = self._pin(Z, far) - self._pin(Z, near)
        r = arm(self.terms, R)
        edges = slide, near, far
        sign = self._sign(self._reach(offset, direction, R, guide, edges, (base, Y, Z)), edges)
        found = circle_and_line(self.terms, offset.coordinates(self.terms), direction, r, sign)
        c, s = turn_of(self.terms, found.vector, r)
        turn = self._solved(c, s, rate_of_third(found))
        bodies = self._named(near, base), self._named(far, Y), self._named(near, Z)
        angle = sp.expand(delta + turn - r.angle)
        relation = offset.turned(delta) + guide.along.times((found.travel, ZERO))
        relation = relation - R.turned(angle)
        step = Step(
            "circle and line",
            next(iter(base)),
            bodies,
            (slide.name, far.name, near.name),
            relation,
            (turn,),
            {"offset": found.offset, "direction": direction, "r": r.vector},
            (found.travel,),
            delta,
            None if found.margin == 1 else found.margin,
            TRAVELS[sign] if found.margin != 1 else "",
            sign,
        )
        self.steps.append(step)
        self.relations.append(relation)
        self.travels[slide.name] = found.travel
        at = self._pin(base, near), self._pin(Z, near)
        self._joined(base, Y, guide.mounted(found.travel))
        self._mounted(base, Z, (angle, REAL), *at)

    def _join_pin_and_two_slides(self, pin: Turn, slides: Sequence[Slide]) -> None:
        ends = [{self._id(slide.a), self._id(slide.b)} for slide in slides]
        middle = next(c for c in self.clusters if id(c) in ends[0] & ends[1])
        base, Z = self._first(self.cluster(pin.a), self.cluster(pin.b))
        first, second = slides if id(base) in ends[0] else slides[::-1]
        to_middle = self._guide(first, base, middle)
        still = to_middle.mounted(ZERO)
        onward = self._guide(second, middle, Z)
        mount = still.carried(onward.mounted(ZERO))
        along = onward.along.times(still.rotor).turned(still.angle)
        delta = to_middle.along.common_angle()
        offset = self._pin(base, pin) - mount.origin
        offset = offset - self._pin(Z, pin).times(mount.rotor).turned(mount.angle)
        e, f, d = (
            vector.turned(-delta).coordinates(self.terms)
            for vector in (to_middle.along, along, offset)
        )
        t, u = two_lines(self.terms, d, e, f)
        relation = to_middle.along.times((t, ZERO)) + along.times((u, ZERO)) - offset
        self.travels |= {first.name: t, second.name: u}
        self.relations.append(relation)
        bodies = self._named(pin, base), self._named(first, middle), self._named(pin, Z)
        vectors = {"offset": d, "e": e, "f": f}
        names = (first.name, second.name, pin.name)
        axes = next(iter(base))
        self.steps.append(
            Step("two lines", axes, bodies, names, relation, (), vectors, (t, u), delta)
        )
        self._joined(middle, Z, onward.mounted(u))
        self._joined(base, middle, to_middle.mounted(t))

    def _guide(self, slide: Slide, base: Cluster, other: Cluster) -> "_Guide":
        """How one cluster slides along the other."""
        forward = slide.a in base
        a, b = (base, other) if forward else (other, base)
        on_a, on_b = a[slide.a], b[slide.b]
        rotor = self._tidy(product(product(on_a.rotor, slide.rotor), conjugate(on_b.rotor)))
        angle = sp.expand(on_a.angle - on_b.angle)
        along, at_a, at_b = (
            on_a.vector(slide.direction),
            on_a.point(slide.at_a),
            on_b.point(slide.at_b),
        )
        if forward:
            return _Guide(angle, rotor, at_a, at_b, along)
        back = conjugate(rotor)
        return _Guide(-angle, back, at_b, at_a, -along.times(back).turned(-angle))

    # --- branches ---

    def _sign(self, at_reference: int, edges: Sequence[Edge]) -> int:
        """The sign of the branch: that at the reference, or the next one asked for."""
        if self.signs is not None:
            return next(self.signs, 1)
        if at_reference == 0:
            # The far ends of struts are no names of the description.
            names = ", ".join(edge.name for edge in edges if "." not in edge.name)
            raise RobotError(f"the loop of {names} does not close at the reference, or not clearly")
        return at_reference

    def _reach(
        self,
        offset: PhasorSum,
        direction: Complex,
        R: PhasorSum,
        guide: "_Guide",
        edges: Sequence[Edge],
        clusters: tuple[Cluster, Cluster, Cluster],
    ) -> int:
        """Which of both travels the reference has: 1 for the greater; 0 where none is clear."""
        o, r = self.reference.vector(offset), self.reference.vector(R)
        d = self.reference.number(direction)
        n, m = (d.conjugate() * o).imag, (d.conjugate() * o).real
        square = abs(r) ** 2 - n**2
        if not square >= 0:
            return 0
        base, Y, Z = clusters
        turn_Y = self.reference.turn(guide.angle, guide.rotor)
        delta = self.reference.of(guide.along.common_angle())
        distances = {}
        for sign in TRAVELS:
            along = sign * math.sqrt(square)
            turn_Z = delta + cmath.phase(d * complex(along, n) / r)
            turns = {id(base): 0.0, id(Y): turn_Y, id(Z): turn_Z}
            distances[sign] = self._distance(edges, turns, along - m)
        return self._nearer(distances)

    def _distance(
        self, edges: Sequence[Edge], turns: Mapping[int, float], travel: float = 0.0
    ) -> float:
        """How far the joints are from where the reference has them."""
        hints = self.reference.hints_of([edge.name for edge in edges])
        total = 0.0
        for edge in edges:
            if edge.name not in hints:
                continue
            if isinstance(edge, Turn):
                on_a, on_b = self.cluster(edge.a)[edge.a], self.cluster(edge.b)[edge.b]
                turn = turns[self._id(edge.b)] + self.reference.turn(on_b.angle, on_b.rotor)
                turn -= turns[self._id(edge.a)] + self.reference.turn(on_a.angle, on_a.rotor)
                turn -= cmath.phase(self.reference.number(edge.rotor))
                total += wrapped(edge.sense * turn - hints[edge.name]) ** 2
            else:
                total += (travel - hints[edge.name]) ** 2
        return math.sqrt(total)

    def _nearer(self, distances: Mapping[int, float]) -> int:
        """The sign of the smaller distance; 0 where both are alike."""
        if abs(distances[1] - distances[-1]) < CLEAR:
            return 0
        return min(distances, key=distances.__getitem__)

    # --- reading what is joined ---

    def _turned(self, edge: Turn, cluster: Cluster) -> sp.Expr:
        on_a, on_b = cluster[edge.a], cluster[edge.b]
        rest = product(conjugate(product(on_a.rotor, edge.rotor)), on_b.rotor)
        re, im = self._tidy(rest)
        constant = ZERO if (re, im) == REAL else sp.atan2(im, re)
        return sp.expand(edge.sense * (on_b.angle - on_a.angle + constant))

    def _travelled(self, edge: Slide, cluster: Cluster) -> sp.Expr:
        if edge.name in self.travels:
            return self.travels[edge.name]
        on_a, on_b = cluster[edge.a], cluster[edge.b]
        between = on_b.point(edge.at_b) - on_a.point(edge.at_a)
        x, y = between.turned(-on_a.angle).times(conjugate(on_a.rotor)).coordinates(self.terms)
        return self.terms.let(dot((x, y), edge.direction))

    def _solved(self, c: sp.Expr, s: sp.Expr, rate: LoopRate) -> sp.Symbol:
        angle = self.terms.solved_angle(c, s)
        self.loops.setdefault(angle, rate)
        return angle

    def _span(self, cluster: Cluster, first: Turn, second: Turn) -> PhasorSum:
        return self._pin(cluster, second) - self._pin(cluster, first)

    def _pin(self, cluster: Cluster, pin: Turn) -> PhasorSum:
        """Where a pin is in a cluster that it holds."""
        if pin.a in cluster:
            return cluster[pin.a].point(pin.at_a)
        return cluster[pin.b].point(pin.at_b)

    def _named(self, edge: Edge, cluster: Cluster) -> str:
        """The body of a cluster that an edge holds."""
        return edge.a if edge.a in cluster else edge.b

    def _shared(self, pins: Sequence[Turn], one: Cluster, other: Cluster) -> Turn:
        ends = {id(one), id(other)}
        return next(pin for pin in pins if {self._id(pin.a), self._id(pin.b)} == ends)

    def _id(self, body: str) -> int:
        return id(self.cluster(body))

    def _tidy(self, rotor: Complex) -> Complex:
        return tidied_entry(self.terms, rotor[0]), tidied_entry(self.terms, rotor[1])


@dataclass(frozen=True)
class _Guide:
    """How one cluster slides along another, in the axes of the other.

    Attributes:
        angle: The sliding cluster's turn, with ``rotor``.
        rotor: Constant part of the turn.
        at: The point of the guide where the travel is zero.
        at_other: The sliding cluster's point there, in its own axes.
        along: The direction of the travel.
    """

    angle: sp.Expr
    rotor: Complex
    at: PhasorSum
    at_other: PhasorSum
    along: PhasorSum

    def mounted(self, travel: sp.Expr) -> PlanarPose:
        """The sliding cluster's pose."""
        at = self.at + self.along.times((travel, ZERO))
        origin = at - self.at_other.times(self.rotor).turned(self.angle)
        return PlanarPose(self.angle, self.rotor, origin)


@dataclass(frozen=True)
class _Dyad:
    """Three clusters in a ring of pins: the base, and two whose pins are V and W apart.

    Attributes:
        clusters: The base, X and Y.
        pins: Base to X, X to Y, base to Y.
        V: On X, from its pin on the base to that on Y.
        W: On Y, from its pin on the base to that on X.
        D: On the base, from the pin of X to that of Y.
    """

    clusters: tuple[Cluster, Cluster, Cluster]
    pins: tuple[Turn, Turn, Turn]
    V: PhasorSum
    W: PhasorSum
    D: PhasorSum


def _implied(edges: Sequence[Edge]) -> list[Turn]:
    """Pins between bodies that turn about the same point of a third."""
    turns = [edge for edge in edges if isinstance(edge, Turn)]
    found = []
    for one, other in combinations(turns, 2):
        for body in {one.a, one.b} & {other.a, other.b}:
            (a, at_a, here), (b, at_b, there) = (_seen_from(turn, body) for turn in (one, other))
            if here == there:
                found.append(Turn(f"{one.name}.{other.name}", a, at_a, b, at_b))
    return found


def _seen_from(turn: Turn, body: str) -> tuple[str, Complex, Complex]:
    """The other body of a pin, the pin on it, and the pin on this body."""
    if turn.a == body:
        return turn.b, turn.at_b, turn.at_a
    return turn.a, turn.at_a, turn.at_b


def _slides(edges: Sequence[Edge]) -> int:
    return sum(isinstance(edge, Slide) for edge in edges)


def _exact_turn(here: PhasorSum, there: PhasorSum) -> Turned | None:
    """The turn between two single vectors of the same length, without a root."""
    if len(here.terms) != 1 or len(there.terms) != 1:
        return None
    ((angle, a),) = here.terms.items()
    ((angle_there, b),) = there.terms.items()
    if not is_zero(dot(a, a) - dot(b, b)):
        return None
    return angle_there - angle, quotient(b, a)


def meeting(v: float, w: float, d: complex, sign: int) -> complex | None:
    """Where circles of radius v and w about the ends of d meet; None where they do not."""
    p = (abs(d) ** 2 + v**2 - w**2) / 2
    square = abs(d) ** 2 * v**2 - p**2
    if not square >= 0 or d == 0:
        return None
    return d * complex(p, sign * math.sqrt(square)) / abs(d) ** 2
