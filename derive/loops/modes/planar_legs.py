"""Planar platforms on legs of joints that turn or slide: the equation that each leg leaves.

With its actuator held, a leg of three joints is one body between two passive joints, which leaves
one equation in the platform's position p and rotation R. With a point A apart from the platform
and a point b of the platform,

    both joints turn                       |p + R b - A| = L      a rod of length L
    one slides apart from the platform     n . (p + R b - A) = 0  b moves on a line
    one slides on the platform             R n . (p + R b - A) = 0  a line of the platform goes
                                                                  through A

Two passive joints that slide hold the platform's angle alone; such legs are not covered.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import sympy as sp

from ...model.robot import Joint
from ...terms.role import Role
from ...terms.symbolic_function import Result, SymbolicFunction, matrix_entries
from ...terms.tangents import derivative_columns
from ...terms.vectors import Vector, named, subtracted
from ...terms.vectors import cross as cross_product
from ...terms.vectors import dot as scalar
from ..hybrid import Hybrid
from ..planar.arm import arm
from ..planar.clusters import Cluster, Clusters
from ..planar.phasors import (
    Complex,
    PhasorSum,
    PlanarPose,
    conjugate,
    is_zero,
    minus,
    product,
)
from ..planar.planes import Edge, Linkage, PinEdge, SlideEdge, is_cylinder
from ..rods import joint_frame, joint_values, tool_position
from ..spatial.body_frames import pose_of
from .triad import LEGS, LegLine, Triad, leg_residuals

VIRTUAL = ["prismatic", "prismatic", "revolute"]
"""The kinds of the main chain's joints: x, y and phi of the platform."""
QUARTER: Complex = (sp.S.Zero, sp.S.One)


class ChainAxes(NamedTuple):
    """The axes of the main chain's x and y, in those of the linkage's root.

    Attributes:
        origin: Where x and y are zero.
        x: The direction of x.
        side: 1, or -1 where y is to the right of x.
        rotor: The platform's axes where phi is zero.
        pin: The point of the platform about which phi turns, in its axes.
    """

    origin: Complex
    x: Complex
    side: int
    rotor: Complex
    pin: Complex


class Leg(NamedTuple):
    """The equation of a leg; a rod has a length, a line has a normal."""

    A: Complex
    b: Complex
    length: sp.Expr | None
    line: LegLine | None


def legs_of(h: Hybrid) -> Triad | None:
    """The equations of a planar platform on three legs, rods first; None for other robots."""
    linkage = _linkage(h)
    axes = None if linkage is None else _axes(h, linkage)
    if linkage is None or axes is None:
        return None
    known = {c.moves: c.ratio * s for c, s in zip(h.mechanism.coordinates, h.q, strict=True)}
    clusters = _joined(h, linkage, known)
    found = _legs(h, clusters, axes)
    if len(found) != LEGS or None in found:
        return None
    legs = sorted((leg for leg in found if leg), key=lambda leg: leg.length is None)
    return Triad(
        tuple(leg.A for leg in legs),
        tuple(leg.b for leg in legs),
        tuple(leg.length for leg in legs if leg.length is not None),
        tuple(leg.line for leg in legs if leg.line is not None),
    )


def _virtual(h: Hybrid) -> list[Joint]:
    """The joints of the main chain, with the bodies that they join."""
    way = h.mechanism.way(h.mechanism.tool_body)
    return [joint for joint in way if joint.kind != "fixed"]


def _linkage(h: Hybrid) -> Linkage | None:
    """The linkage of a platform that only a virtual chain x, y, phi carries from the base."""
    mechanism, moving = h.mechanism, _virtual(h)
    if [joint.kind for joint in moving] != VIRTUAL or h.loops.spatial or len(h.loops.planar) != 1:
        return None
    (linkage,) = h.loops.planar
    names = {joint.name for joint in moving}
    moves = any(joint.kind != "fixed" for joint in mechanism.way(linkage.root))
    actuated = {c.moves for c in mechanism.coordinates}
    is_virtual = names <= set(linkage.joints) and not names & actuated
    return linkage if is_virtual and not moves else None


def _joined(h: Hybrid, linkage: Linkage, known: Mapping[str, sp.Expr]) -> Clusters:
    """The bodies that known joints hold together."""
    clusters = Clusters(h.terms, linkage, known, h.forward.reference)
    while clusters.join_known():
        pass
    return clusters


def _axes(h: Hybrid, linkage: Linkage) -> ChainAxes | None:
    """The axes of x and y; None where x, y and phi are not those of a plane's axes."""
    moving = _virtual(h)
    x, y, phi = h.theta
    clusters = _joined(h, linkage, {j.name: s for j, s in zip(moving, h.theta, strict=True)})
    cluster = clusters.cluster(linkage.root)
    (pin,) = (e for e in linkage.edges if isinstance(e, PinEdge) and e.name == moving[2].name)
    root, platform = cluster[linkage.root], cluster[moving[2].link]
    at = _seen(platform.point(pin.at_b), root)
    turned = sp.expand(platform.angle - root.angle)
    if set(at.terms) - {sp.S.Zero} or turned not in (phi, -phi):
        return None
    position = at.terms.get(sp.S.Zero, (sp.S.Zero, sp.S.Zero))
    along, beside = ((sp.diff(position[0], s), sp.diff(position[1], s)) for s in (x, y))
    side = 1 if turned == phi else -1
    away = minus(beside, product((sp.Integer(0), sp.Integer(side)), along))
    if not all(map(is_zero, away)):
        return None
    origin = position[0].subs({x: 0, y: 0}), position[1].subs({x: 0, y: 0})
    return ChainAxes(origin, along, side, product(platform.rotor, conjugate(root.rotor)), pin.at_b)


def _seen(point: PhasorSum, body: PlanarPose) -> PhasorSum:
    """A point in the axes of a body of the same cluster."""
    return _along(point - body.origin, body)


def _along(vector: PhasorSum, body: PlanarPose) -> PhasorSum:
    """A vector in the axes of a body of the same cluster."""
    return vector.turned(-body.angle).times(conjugate(body.rotor))


def _legs(h: Hybrid, clusters: Clusters, axes: ChainAxes) -> list[Leg | None]:
    """The legs; None for what is between base and platform and leaves no equation."""
    moving = _virtual(h)
    base = clusters.cluster(clusters.linkage.root)
    platform = clusters.cluster(moving[2].link)
    virtual = {joint.link for joint in moving[:2]}
    edges = [edge for edge in clusters.between() if edge in clusters.linkage.edges]
    between = [
        cluster
        for cluster in clusters.all
        if cluster is not base and cluster is not platform and not virtual & cluster.keys()
    ]
    if len(edges) != len(VIRTUAL) + 2 * len(between):
        return [None]
    reader = _Reader(h, clusters, axes, base, platform)
    return [reader.leg(cluster, edges) for cluster in between]


class _Reader:
    """Reads the equation of each leg."""

    def __init__(
        self, h: Hybrid, clusters: Clusters, axes: ChainAxes, base: Cluster, platform: Cluster
    ) -> None:
        self.terms, self.clusters, self.axes = h.terms, clusters, axes
        self.base, self.platform = base, platform
        self.root, self.body = clusters.linkage.root, _virtual(h)[2].link

    def leg(self, middle: Cluster, edges: Sequence[Edge]) -> Leg | None:
        """The equation of the leg of one body between two joints."""
        clusters, base, platform = self.clusters, self.base, self.platform
        near = [edge for edge in edges if clusters.holds(edge, base, middle)]
        far = [edge for edge in edges if clusters.holds(edge, platform, middle)]
        match near, far:
            case [PinEdge() as one], [PinEdge() as other]:
                length = self._length(middle, one, other)
                at, on = clusters.pin(base, one), clusters.pin(platform, other)
                return Leg(self._apart(at), self._on(on), length, None)
            case [SlideEdge() as slide], [PinEdge() as pin]:
                at, normal = self._line(slide, base, middle, pin)
                direction = self._coordinates(_along(normal, base[self.root]))
                on = clusters.pin(platform, pin)
                return Leg(self._apart(at), self._on(on), None, LegLine(direction, turns=False))
            case [PinEdge() as pin], [SlideEdge() as slide]:
                on, normal = self._line(slide, platform, middle, pin)
                seen = _along(normal, platform[self.body]).times(self.axes.rotor)
                at = clusters.pin(base, pin)
                line = LegLine(self._coordinates(seen), turns=True)
                return Leg(self._apart(at), self._on(on), None, line)
        return None

    def _line(
        self, slide: SlideEdge, carrier: Cluster, middle: Cluster, pin: PinEdge
    ) -> tuple[PhasorSum, PhasorSum]:
        """A point of the line on which a slide carries a pin, and its normal."""
        guide = self.clusters.guide(slide, carrier, middle)
        mount = guide.mounted(sp.S.Zero)
        offset = self.clusters.pin(middle, pin).times(mount.rotor).turned(mount.angle)
        return mount.origin + offset, guide.along.times(QUARTER)

    def _length(self, middle: Cluster, one: PinEdge, other: PinEdge) -> sp.Expr:
        """The distance of two pins; that of a cylinder is negative where its length is."""
        span = self.clusters.span(middle, one, other)
        if any(is_cylinder(edge) and edge.a in middle for edge in self.clusters.linkage.edges):
            (length, _) = span.turned(-span.common_angle()).coordinates(self.terms)
            return length
        return self.terms.let(sp.sqrt(arm(self.terms, span).square))

    def _apart(self, point: PhasorSum) -> Complex:
        """A point apart from the platform along x and y."""
        seen = _seen(point, self.base[self.root])
        return self._coordinates(seen - PhasorSum.of(self.axes.origin))

    def _on(self, point: PhasorSum) -> Complex:
        """A point of the platform along x and y where phi is zero, from where phi turns."""
        seen = _seen(point, self.platform[self.body]) - PhasorSum.of(self.axes.pin)
        return self._coordinates(seen.times(self.axes.rotor))

    def _coordinates(self, vector: PhasorSum) -> Complex:
        x, y = vector.times(conjugate(self.axes.x)).coordinates(self.terms)
        return x, self.terms.let(self.axes.side * y)


# --- the functions of legs that are not rods alone ---


def legs(h: Hybrid, triad: Triad) -> SymbolicFunction:
    """By how much the platform misses the equation of each leg."""
    residuals = tuple(leg_residuals(h.terms, triad, h.theta))
    return h.function(
        "legs",
        "Distance of the platform from the circle or line of each leg, rods first.",
        "|p + R b_i - A_i(q)| - L_i, or n_i . (p + R b_i - A_i(q)) where a joint of the leg slides",
        ("theta", "q"),
        Result("residual", residuals, (LEGS,), "m", "distances"),
        role=Role("lengths"),
    )


def legs_D_chain(h: Hybrid, triad: Triad) -> SymbolicFunction:
    """The derivative of the legs' residuals by the main chain."""
    columns = derivative_columns(h.terms, leg_residuals(h.terms, triad, h.theta), h.theta)
    return h.function(
        "legs_D_chain",
        "Derivative of the legs' residuals by the main chain's joints.",
        "legs_D_chain[:, k] = d legs / d theta_k",
        ("theta", "q"),
        Result("residual_D_theta", matrix_entries(columns), (LEGS, LEGS), "1, m", "derivative"),
        role=Role("lengths derivative"),
    )


def relation(h: Hybrid, triad: Triad) -> tuple[list[Vector], tuple[sp.Expr, ...]]:
    """The rows of J_x, force before moment about the tool, in base axes; the entries of J_q."""
    values = joint_values(h)
    frames = [pose_of(h.mechanism, h.terms, joint_frame(j), values) for j in _virtual(h)]
    along_x, along_y, axis = (
        named(h.terms, (joint.direction * entry for entry in axes[2]))
        for joint, (axes, _) in zip(_virtual(h), frames, strict=True)
    )
    # The moment about the axis of phi is shifted to the tool.
    lever = cross_product(h.terms, axis, subtracted(h.terms, tool_position(h), frames[2][1]))
    residuals = leg_residuals(h.terms, triad, h.theta)
    rows = []
    by_chain = derivative_columns(h.terms, residuals, h.theta)
    for f_x, f_y, moment in zip(*by_chain, strict=True):
        force = named(h.terms, (f_x * e + f_y * u for e, u in zip(along_x, along_y, strict=True)))
        about = h.terms.let(moment - scalar(h.terms, force, lever))
        rows.append((*force, *(h.terms.let(about * entry) for entry in axis)))
    return rows, matrix_entries(derivative_columns(h.terms, residuals, h.q, factor=-1))
