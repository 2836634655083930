"""Planar platforms on legs with three joints. Each leg has a single closure equation.

If the actuator of a leg with three joints is fixed, the leg acts as one body between two passive
joints. A leg gives one equation for the position p and the rotation R of the platform. In the
equation of a leg, A is a fixed point, and b is a platform point in platform axes. If both passive
joints of a leg are revolute, the leg is a rod of length L: |p + R b - A| = L. If the passive joint
at the base is prismatic, the platform point b moves on a fixed line: n . (p + R b - A) = 0. If the
passive joint at the platform is prismatic, A lies on a platform line: R n . (p + R b - A) = 0.

A leg with two passive prismatic joints determines only the platform angle, and is not supported.
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
from ..model.body_frames import pose_of
from ..model.phasors import Complex, PhasorSum, PlanarPose, conjugate, is_zero, minus, product
from ..model.planes import Edge, Linkage, PinEdge, SlideEdge, is_cylinder
from ..planar.arm import arm
from ..planar.clusters import Cluster, Clusters
from ..solve.solved_loops import SolvedLoops
from .rods import joint_frame, joint_values, tool_position
from .triad import LEGS, LegLine, Triad, leg_residuals

VIRTUAL = ["prismatic", "prismatic", "revolute"]
"""Types of the virtual main-chain joints. The joint values are the platform coordinates x, y and
phi."""
QUARTER: Complex = (sp.S.Zero, sp.S.One)


class ChainAxes(NamedTuple):
    """Axes x and y of a planar platform's main chain, in the frame of the linkage's root body.

    Attributes:
        origin: The origin of the coordinates x and y in the plane.
        x: The direction of the x axis.
        side: 1 if the y axis is to the left of x, otherwise -1.
        rotor: The orientation of the platform at phi = 0.
        pin: Point about which the angle phi rotates the platform, in platform axes.
    """

    origin: Complex
    x: Complex
    side: int
    rotor: Complex
    pin: Complex


class Leg(NamedTuple):
    """A leg of a planar platform.

    The leg is either a rod of given length or a constraint that keeps a point on a line.
    """

    A: Complex
    b: Complex
    length: sp.Expr | None
    line: LegLine | None


def legs_of(h: SolvedLoops) -> Triad | None:
    """Return the three legs of a planar platform, rods first, or None for other robots."""
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


def _virtual(h: SolvedLoops) -> list[Joint]:
    path = h.mechanism.path_to(h.mechanism.tool_body)
    return [joint for joint in path if joint.kind != "fixed"]


def _linkage(h: SolvedLoops) -> Linkage | None:
    """Return the linkage of a platform on a virtual chain x, y, phi, or None for other robots."""
    mechanism, moving = h.mechanism, _virtual(h)
    if [joint.kind for joint in moving] != VIRTUAL or h.loops.spatial or len(h.loops.planar) != 1:
        return None
    (linkage,) = h.loops.planar
    names = {joint.name for joint in moving}
    moves = any(joint.kind != "fixed" for joint in mechanism.path_to(linkage.root))
    actuated = {c.moves for c in mechanism.coordinates}
    is_virtual = names <= set(linkage.joints) and not names & actuated
    return linkage if is_virtual and not moves else None


def _joined(h: SolvedLoops, linkage: Linkage, known: Mapping[str, sp.Expr]) -> Clusters:
    """Return the groups of bodies that welds and joints with known values connect rigidly."""
    clusters = Clusters(h.terms, linkage, known, h.forward.reference)
    while clusters.join_known():
        pass
    return clusters


def _axes(h: SolvedLoops, linkage: Linkage) -> ChainAxes | None:
    """Return the axes of x and y, or None if x, y, phi are not the coordinates of the platform."""
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
    along, across = ((sp.diff(position[0], s), sp.diff(position[1], s)) for s in (x, y))
    side = 1 if turned == phi else -1
    away = minus(across, product((sp.Integer(0), sp.Integer(side)), along))
    if not all(map(is_zero, away)):
        return None
    origin = position[0].subs({x: 0, y: 0}), position[1].subs({x: 0, y: 0})
    return ChainAxes(origin, along, side, product(platform.rotor, conjugate(root.rotor)), pin.at_b)


def _seen(point: PhasorSum, body: PlanarPose) -> PhasorSum:
    """Convert a point of a rigid group to the frame of a body of the group."""
    return _along(point - body.origin, body)


def _along(vector: PhasorSum, body: PlanarPose) -> PhasorSum:
    """Convert a vector from the axes of a rigid group to the axes of a body of the group."""
    return vector.turned(-body.angle).times(conjugate(body.rotor))


def _legs(h: SolvedLoops, clusters: Clusters, axes: ChainAxes) -> list[Leg | None]:
    """Return the legs.

    For each part between base and platform that is not a leg, the list contains None.
    """
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
    def __init__(
        self, h: SolvedLoops, clusters: Clusters, axes: ChainAxes, base: Cluster, platform: Cluster
    ) -> None:
        self.terms, self.clusters, self.axes = h.terms, clusters, axes
        self.base, self.platform = base, platform
        self.root, self.body = clusters.linkage.root, _virtual(h)[2].link

    def leg(self, middle: Cluster, edges: Sequence[Edge]) -> Leg | None:
        """Return the leg with the rigid group `middle`, or None if the leg is not supported."""
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
        """Return a point and the normal of the line on which a pin slides."""
        guide = self.clusters.guide(slide, carrier, middle)
        mount = guide.mounted(sp.S.Zero)
        offset = self.clusters.pin(middle, pin).times(mount.rotor).turned(mount.angle)
        return mount.origin + offset, guide.along.times(QUARTER)

    def _length(self, middle: Cluster, one: PinEdge, other: PinEdge) -> sp.Expr:
        """Return the distance between the two pins of a leg.

        The returned distance is negative if the leg is a cylinder with negative length.
        """
        span = self.clusters.span(middle, one, other)
        if any(is_cylinder(edge) and edge.a in middle for edge in self.clusters.linkage.edges):
            (length, _) = span.turned(-span.common_angle()).coordinates(self.terms)
            return length
        return self.terms.let(sp.sqrt(arm(self.terms, span).square))

    def _apart(self, point: PhasorSum) -> Complex:
        """Return the coordinates x and y of a fixed point in the axes of the main chain."""
        seen = _seen(point, self.base[self.root])
        return self._coordinates(seen - PhasorSum.of(self.axes.origin))

    def _on(self, point: PhasorSum) -> Complex:
        """Return x and y of a platform point at phi = 0, relative to the rotation center."""
        seen = _seen(point, self.platform[self.body]) - PhasorSum.of(self.axes.pin)
        return self._coordinates(seen.times(self.axes.rotor))

    def _coordinates(self, vector: PhasorSum) -> Complex:
        x, y = vector.times(conjugate(self.axes.x)).coordinates(self.terms)
        return x, self.terms.let(self.axes.side * y)


# --- functions of planar platforms whose legs are not struts ---


def legs(h: SolvedLoops, triad: Triad) -> SymbolicFunction:
    """Build the function ``legs``, which returns the residual of the equation of each leg."""
    residuals = tuple(leg_residuals(h.terms, triad, h.theta))
    return h.function(
        "legs",
        "Distance of each platform joint from the circle or line of its leg, rods first.",
        "|p + R b_i - A_i(q)| - L_i, or n_i . (p + R b_i - A_i(q)) if the leg has a slider",
        ("theta", "q"),
        Result("residual", residuals, (LEGS,), "m", "distances"),
        role=Role("lengths"),
    )


def legs_D_chain(h: SolvedLoops, triad: Triad) -> SymbolicFunction:
    """Build the Jacobian of the leg residuals with respect to the main-chain joints."""
    columns = derivative_columns(h.terms, leg_residuals(h.terms, triad, h.theta), h.theta)
    return h.function(
        "legs_D_chain",
        "Derivative of the leg residuals with respect to the main-chain joints.",
        "legs_D_chain[:, k] = d legs / d theta_k",
        ("theta", "q"),
        Result("residual_D_theta", matrix_entries(columns), (LEGS, LEGS), "1, m", "derivative"),
        role=Role("lengths derivative"),
    )


def relation(h: SolvedLoops, triad: Triad) -> tuple[list[Vector], tuple[sp.Expr, ...]]:
    """Return the rows of J_x and the entries of J_q in the velocity relation J_x x' = J_q q'.

    Each row of J_x contains a force and the moment of the force about the tool, in base axes.
    """
    values = joint_values(h)
    frames = [pose_of(h.mechanism, h.terms, joint_frame(j), values) for j in _virtual(h)]
    along_x, along_y, axis = (
        named(h.terms, (joint.direction * entry for entry in axes[2]))
        for joint, (axes, _) in zip(_virtual(h), frames, strict=True)
    )
    # The derivative of a residual by phi is a moment about the phi axis, but a row of J_x needs the
    # moment about the tool.
    lever = cross_product(h.terms, axis, subtracted(h.terms, tool_position(h), frames[2][1]))
    residuals = leg_residuals(h.terms, triad, h.theta)
    rows = []
    by_chain = derivative_columns(h.terms, residuals, h.theta)
    for f_x, f_y, moment in zip(*by_chain, strict=True):
        force = named(h.terms, (f_x * e + f_y * u for e, u in zip(along_x, along_y, strict=True)))
        about = h.terms.let(moment - scalar(h.terms, force, lever))
        rows.append((*force, *(h.terms.let(about * entry) for entry in axis)))
    return rows, matrix_entries(derivative_columns(h.terms, residuals, h.q, factor=-1))
