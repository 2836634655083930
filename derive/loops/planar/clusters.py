"""Rigid groups of planar bodies with known relative poses.

At first, each body is a separate group. The pose of a body in its group consists of an angle, a
constant rotation and an origin.
"""

import cmath
import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import combinations

import sympy as sp

from ...model.errors import DescriptionError
from ...model.roots import angle_of
from ...model.tolerances import BRANCHES_APART, OFF_BRANCH
from ...terms.tangents import LoopRate
from ...terms.terms import Terms
from ..model.phasors import REAL, ZERO, Complex, PhasorSum, PlanarPose, conjugate, dot, product
from ..model.planes import Edge, Linkage, PinEdge, SlideEdge, WeldEdge, is_cylinder, tidied_entry
from .described_joints import described_joints
from .loop_step import LoopStep
from .reference import AtReference, Branch, wrapped

Turned = tuple[sp.Expr, Complex]
"""A rotation as an exact angle and a constant unit complex number."""
Cluster = dict[str, PlanarPose]
"""The bodies of a rigid group with their poses in the axes of the group."""
RING = 3
"""Number of rigid groups in a ring. One solution step joins a ring, in which each group is
connected to the other two groups."""


class PlanarStep(LoopStep):
    """A solution step that joins several rigid groups of bodies into one rigid group."""

    @classmethod
    @abstractmethod
    def join(cls, clusters: "Clusters") -> bool:
        """Join the first rigid groups to which the step applies.

        Args:
            clusters: The partially solved linkage.

        Returns:
            Whether rigid groups were joined.

        Raises:
            DescriptionError: The loop does not close at the reference configuration, or the branch
                of the loop is ambiguous at the reference configuration.
        """


@dataclass(frozen=True)
class Guide:
    """The guide on which a rigid group slides, in the axes of the base group.

    Attributes:
        angle: The rotation angle of the group that slides on the guide, without the constant part.
        rotor: The constant part of the rotation of the sliding group.
        at: The point of the guide at which the travel is 0.
        at_other: The point of the sliding group, in axes of this group, that coincides with the
            point ``at`` if the travel is 0.
        along: The direction in which the sliding group travels.
    """

    angle: sp.Expr
    rotor: Complex
    at: PhasorSum
    at_other: PhasorSum
    along: PhasorSum

    def mounted(self, travel: sp.Expr) -> PlanarPose:
        """Return the pose of the sliding group for a known travel."""
        at = self.at + self.along.times((travel, ZERO))
        origin = at - self.at_other.times(self.rotor).turned(self.angle)
        return PlanarPose(self.angle, self.rotor, origin)


class Clusters:
    """The rigid groups of a linkage, which the solution steps join to a single group.

    Attributes:
        terms: Receives the terms.
        linkage: Bodies and joints.
        known: Known values of joints, swing angles or cylinders by name (radian, meter).
        reference: The reference configuration, which selects the branch if ``branch`` is None.
        branch: The branch to solve, or None for the branch that contains the reference
            configuration.
        all: The rigid groups.
        steps: The solution steps that are already found.
        loops: Functions that return the rates of the solved angles, keyed by the symbol of the
            angle.
        relations: Loop equations, each a sum of rotated vectors that is zero.
        travels: Solved displacements of prismatic joints and cylinders, keyed by name.
        bases: Vectors between the two base pins of each solved dyad.
    """

    def __init__(
        self,
        terms: Terms,
        linkage: Linkage,
        known: Mapping[str, sp.Expr],
        reference: AtReference,
        branch: Branch | None = None,
    ) -> None:
        """Create one rigid group per body."""
        self.terms, self.linkage, self.known = terms, linkage, known
        self.reference, self.branch = reference, branch
        self.edges = (*linkage.edges, *_implied(linkage.edges))
        self.all: list[Cluster] = [{body: PlanarPose()} for body in linkage.bodies]
        self.steps: list[LoopStep] = []
        self.loops: dict[sp.Symbol, LoopRate] = {}
        self.relations: list[PhasorSum] = []
        self.travels: dict[str, sp.Expr] = {}
        self.bases: list[PhasorSum] = []

    def on(self, branch: Branch) -> "Clusters":
        """Return a copy of the rigid groups for another branch."""
        other = copy(self)
        other.branch, other.all = branch, [dict(cluster) for cluster in self.all]
        other.steps, other.relations = [*self.steps], [*self.relations]
        other.loops, other.travels, other.bases = {**self.loops}, {**self.travels}, [*self.bases]
        return other

    # --- selection of rigid groups ---

    def cluster(self, body: str) -> Cluster:
        """Return the rigid group of a body."""
        return next(cluster for cluster in self.all if body in cluster)

    def between(self) -> list[Edge]:
        """Return the joints between different rigid groups."""
        return [e for e in self.edges if self.cluster(e.a) is not self.cluster(e.b)]

    def holds(self, edge: Edge, one: Cluster, other: Cluster) -> bool:
        """Whether a joint connects two given rigid groups."""
        return {self._id(edge.a), self._id(edge.b)} == {id(one), id(other)}

    def shared(self, pins: Sequence[PinEdge], one: Cluster, other: Cluster) -> PinEdge:
        """Return the pin between two rigid groups."""
        return next(pin for pin in pins if self.holds(pin, one, other))

    def first(self, *clusters: Cluster) -> list[Cluster]:
        """Sort rigid groups by decreasing number of bodies.

        The group of the root body comes first.
        """
        return sorted(clusters, key=lambda c: (self.linkage.root not in c, -len(c)))

    def rings(self, slides: int) -> Iterator[tuple[Edge, ...]]:
        """Yield rings of three rigid groups.

        Each ring contains ``slides`` prismatic joints, and the other joints of the ring are pins.
        """
        for edges in combinations(self.between(), RING):
            count = sum(isinstance(edge, SlideEdge) for edge in edges)
            if count == slides and self._is_ring(edges):
                yield edges

    def ring(self, slides: int) -> tuple[Edge, ...] | None:
        """Return the first ring with the given number of prismatic joints, or None."""
        return next(self.rings(slides), None)

    def _is_ring(self, edges: tuple[Edge, ...]) -> bool:
        pairs = {frozenset((self._id(edge.a), self._id(edge.b))) for edge in edges}
        if len(pairs) != len(edges) or len(frozenset.union(*pairs)) != len(edges):
            return False
        pins = [edge for edge in edges if isinstance(edge, PinEdge)]
        if not pins:
            return False
        spans = [
            self.span(self.cluster(body), *pair)
            for pair in combinations(pins, 2)
            for body in (pair[0].a, pair[0].b)
            if self._id(body) in (self._id(pair[1].a), self._id(pair[1].b))
        ]
        return all(span.terms for span in spans)

    def _id(self, body: str) -> int:
        return id(self.cluster(body))

    # --- revolute and prismatic joints of a rigid group ---

    def pin(self, cluster: Cluster, pin: PinEdge) -> PhasorSum:
        """Return the position of a pin in a rigid group."""
        if pin.a in cluster:
            return cluster[pin.a].point(pin.at_a)
        return cluster[pin.b].point(pin.at_b)

    def span(self, cluster: Cluster, first: PinEdge, second: PinEdge) -> PhasorSum:
        """Return the vector between two pins of a rigid group."""
        return self.pin(cluster, second) - self.pin(cluster, first)

    def guide(self, slide: SlideEdge, base: Cluster, other: Cluster) -> Guide:
        """Return the guide of a slide between the rigid groups ``base`` and ``other``."""
        forward = slide.a in base
        a, b = (base, other) if forward else (other, base)
        on_a, on_b = a[slide.a], b[slide.b]
        rotor = self._tidy(product(product(on_a.rotor, slide.rotor), conjugate(on_b.rotor)))
        angle = sp.expand(on_a.angle - on_b.angle)
        along = on_a.vector(slide.direction)
        at_a, at_b = on_a.point(slide.at_a), on_b.point(slide.at_b)
        if forward:
            return Guide(angle, rotor, at_a, at_b, along)
        back = conjugate(rotor)
        return Guide(-angle, back, at_b, at_a, -along.times(back).turned(-angle))

    # --- joining of rigid groups ---

    def join(self, base: Cluster, other: Cluster, pose: PlanarPose) -> None:
        """Merge the group ``other`` into the group ``base``.

        ``pose`` is the pose of ``other`` in ``base``.
        """
        base.update({body: pose.carried(there) for body, there in other.items()})
        self.all = [cluster for cluster in self.all if cluster is not other]

    def mount(
        self, base: Cluster, other: Cluster, turn: Turned, at: PhasorSum, at_other: PhasorSum
    ) -> None:
        """Merge a group into the base group.

        The relative rotation and a shared point determine the pose of the merged group.
        """
        angle, rotor = sp.expand(turn[0]), turn[1]
        origin = at - at_other.times(rotor).turned(angle)
        self.join(base, other, PlanarPose(angle, rotor, origin))

    def join_known(self) -> bool:
        """Join the first two rigid groups with a weld or a known joint between them."""
        for edge in self.between():
            a, b = self.cluster(edge.a), self.cluster(edge.b)
            on_a, on_b = a[edge.a], b[edge.b]
            rotor = product(product(on_a.rotor, edge.rotor), conjugate(on_b.rotor))
            angle = on_a.angle - on_b.angle
            at_a = edge.at_a
            if isinstance(edge, WeldEdge):
                at_b: Complex = (ZERO, ZERO)
            elif edge.name not in self.known:
                continue
            else:
                at_b = edge.at_b
                value = self.known[edge.name]
                if isinstance(edge, PinEdge):
                    angle += edge.sense * value
                else:
                    at_a = tuple(p + value * d for p, d in zip(at_a, edge.direction, strict=True))
            turn = angle, self._tidy(rotor)
            self.mount(a, b, turn, on_a.point(at_a), on_b.point(at_b))
            return True
        return False

    def solved(self, c: sp.Expr, s: sp.Expr, rate: LoopRate) -> sp.Symbol:
        """Return the symbol of an angle with known cosine and sine, and record its rate."""
        angle = self.terms.solved_angle(c, s)
        self.loops.setdefault(angle, rate)
        return angle

    def while_long(self, square: sp.Expr, parts: Sequence[Cluster]) -> sp.Expr:
        """Return the radicand ``square``, or -1 if the known length of a cylinder is not positive.

        Args:
            square: The radicand of a square root.
            parts: The rigid groups that the step joins.
        """
        lengths = [
            edge.at_a[0] + self.known[edge.name]
            for edge in self.linkage.edges
            if isinstance(edge, SlideEdge)
            and is_cylinder(edge)
            and edge.name in self.known
            and any(part.keys() == {edge.a, edge.b} for part in parts)
        ]
        if not lengths:
            return square
        is_long = sp.And(*(sp.Gt(length, 0) for length in lengths))
        gated = self.terms.let(sp.Piecewise((square, is_long), (-1, True)))
        self.loops.setdefault(gated, lambda tangent: tangent.of(square))
        return gated

    # --- branches ---

    def sign(self, at_reference: int, edges: Sequence[Edge]) -> sp.Expr:
        """Return the branch sign of a solution step.

        Args:
            at_reference: The branch sign at the reference configuration, or 0 if the sign is
                ambiguous.
            edges: The joints that the step solves.

        Raises:
            DescriptionError: The branch sign at the reference configuration is ambiguous.
        """
        joined = tuple(edge.name for edge in edges)
        if self.branch is not None:
            return self.branch.side(joined)
        if at_reference == 0:
            # A name with a dot is the internal name of the far end of a strut and does not occur in
            # the description.
            names = ", ".join(edge.name for edge in edges if "." not in edge.name)
            raise DescriptionError(
                f"{names}: the loop does not close at the reference, or is at a dead point there:"
                " choose a reference at which it closes and can move"
            )
        self.reference.sides[joined] = at_reference
        return at_reference

    def figure(self, at_reference: int, edges: Sequence[Edge]) -> int:
        """Return the assembly mode of a dyad: 1 for a parallelogram, -1 if it is crossed.

        Args:
            at_reference: Assembly mode at the reference configuration: 1 for the parallelogram, -1
                for the crossed parallelogram, or 0 if the mode is ambiguous.
            edges: The joints that the step solves.

        Raises:
            DescriptionError: The assembly mode at the reference is ambiguous.
        """
        if self.branch is not None:
            return self.branch.figure(tuple(edge.name for edge in edges))
        return int(self.sign(at_reference, edges))

    def distance(
        self, edges: Sequence[Edge], turns: Mapping[int, float], travel: float = 0.0
    ) -> float:
        """Return the Euclidean distance between joint values and their reference values.

        Before the distance is computed, slide travels are divided by the mechanism size.

        Args:
            edges: The joints.
            turns: Rotation of each rigid group (radian), by the id of the group.
            travel: Travel of the slide (meter).
        """
        hints = self._hints([edge.name for edge in edges])
        total = 0.0
        for edge in edges:
            if edge.name not in hints:
                continue
            if isinstance(edge, PinEdge):
                on_a, on_b = self.cluster(edge.a)[edge.a], self.cluster(edge.b)[edge.b]
                turn = turns[self._id(edge.b)] + self.reference.turn(on_b.angle, on_b.rotor)
                turn -= turns[self._id(edge.a)] + self.reference.turn(on_a.angle, on_a.rotor)
                turn -= cmath.phase(self.reference.number(edge.rotor))
                total += wrapped(edge.sense * turn - hints[edge.name]) ** 2
            else:
                total += ((travel - hints[edge.name]) / self.reference.size) ** 2
        return math.sqrt(total)

    def _hints(self, names: Sequence[str]) -> dict[str, float]:
        """Return known reference values of the named joints, keyed by joint name."""
        stated, assumed = self.reference.given, self.reference.assumed
        for known in (stated, assumed | stated):
            for hints in (known, described_joints(self.linkage.edges, self.reference, known)):
                found = {name: hints[name] for name in names if name in hints}
                if found:
                    return found
        return {}

    def nearer(self, distances: Mapping[int, float]) -> int:
        """Return the sign of the branch that is nearer to the reference.

        For nearly equal distances, return 0.
        """
        if abs(distances[1] - distances[-1]) < BRANCHES_APART:
            return 0
        return min(distances, key=distances.__getitem__)

    def closure_errors(self, everywhere: Sequence[AtReference]) -> list[float]:
        """Return the largest closure error of redundant joints at each configuration.

        On a branch other than the reference branch, the equation of a redundant joint may not hold.

        Args:
            everywhere: The configurations.

        Returns:
            The largest closure error of each configuration (radian, or relative to the size of the
            robot). An error is NaN if a loop does not close.
        """
        errors = [self._closure_error(edge) for edge in self.linkage.edges]
        found = [[error(at) for error in errors if error is not None] for at in everywhere]
        return [math.nan if any(map(math.isnan, at)) else max(at, default=0.0) for at in found]

    def coincide(self, everywhere: Sequence[AtReference]) -> bool:
        """Whether the two base pins of a dyad coincide at every closed configuration.

        Args:
            everywhere: The tested configurations. Configurations at which a loop does not close are
                ignored.
        """
        lengths = [[abs(at.vector(base)) / at.size for at in everywhere] for base in self.bases]
        closed = ([part for part in of if not math.isnan(part)] for of in lengths)
        return any(of and max(of) < OFF_BRANCH for of in closed)

    def _closure_error(self, edge: Edge) -> Callable[[AtReference], float] | None:
        """Return a function that computes the closure error of a joint.

        Return None if the two bodies of the joint are in different rigid groups.
        """
        cluster = self.cluster(edge.a)
        if edge.b not in cluster:
            return None
        on_a, on_b = cluster[edge.a], cluster[edge.b]
        at_b = (ZERO, ZERO) if isinstance(edge, WeldEdge) else edge.at_b
        between = on_b.point(at_b) - on_a.point(edge.at_a)

        def closure_error(at: AtReference) -> float:
            apart = at.vector(between) / at.size
            if isinstance(edge, PinEdge):
                return abs(apart)
            turn = at.turn(on_b.angle, on_b.rotor) - at.turn(on_a.angle, on_a.rotor)
            turn -= cmath.phase(at.number(edge.rotor))
            if isinstance(edge, SlideEdge):
                along = at.vector(on_a.vector(edge.direction))
                apart = complex(0.0, (along.conjugate() * apart).imag)
            return max(abs(apart), abs(wrapped(turn)))

        return closure_error

    # --- values of joints ---

    def values(self) -> dict[str, sp.Expr]:
        """Return the values of all joints that connect bodies of one rigid group."""
        found = dict(self.known)
        for edge in self.linkage.edges:
            cluster = self.cluster(edge.a)
            if edge.b not in cluster or edge.name in found or isinstance(edge, WeldEdge):
                continue
            if isinstance(edge, PinEdge):
                found[edge.name] = self._turned(edge, cluster)
            else:
                found[edge.name] = self._travelled(edge, cluster)
        return found

    def _turned(self, edge: PinEdge, cluster: Cluster) -> sp.Expr:
        on_a, on_b = cluster[edge.a], cluster[edge.b]
        rest = product(conjugate(product(on_a.rotor, edge.rotor)), on_b.rotor)
        re, im = self._tidy(rest)
        constant = ZERO if (re, im) == REAL else angle_of(im, re)
        if constant.is_Rational:
            constant = self.terms.let(constant)
        return sp.expand(edge.sense * (on_b.angle - on_a.angle + constant))

    def _travelled(self, edge: SlideEdge, cluster: Cluster) -> sp.Expr:
        if edge.name in self.travels:
            return self.travels[edge.name]
        on_a, on_b = cluster[edge.a], cluster[edge.b]
        between = on_b.point(edge.at_b) - on_a.point(edge.at_a)
        x, y = between.turned(-on_a.angle).times(conjugate(on_a.rotor)).coordinates(self.terms)
        return self.terms.let(dot((x, y), edge.direction))

    def _tidy(self, rotor: Complex) -> Complex:
        return tidied_entry(self.terms, rotor[0]), tidied_entry(self.terms, rotor[1])


def _implied(edges: Sequence[Edge]) -> list[PinEdge]:
    """Return a pin for each pair of bodies that rotate about the same point of a third body."""
    turns = [edge for edge in edges if isinstance(edge, PinEdge)]
    found = []
    for one, other in combinations(turns, 2):
        for body in {one.a, one.b} & {other.a, other.b}:
            (a, at_a, here), (b, at_b, there) = (_seen_from(turn, body) for turn in (one, other))
            if here == there:
                found.append(PinEdge(f"{one.name}.{other.name}", a, at_a, b, at_b))
    return found


def _seen_from(turn: PinEdge, body: str) -> tuple[str, Complex, Complex]:
    """Return the other body of a pin, and the positions of the pin on both bodies."""
    if turn.a == body:
        return turn.b, turn.at_b, turn.at_a
    return turn.a, turn.at_a, turn.at_b
