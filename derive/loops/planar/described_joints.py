"""Joint values of a linkage at the reference.

Values that the description omits are included.

The values of the tree joints determine the poses of the bodies. The body poses determine the values
that the description omits: the joint values in closures, and the swing angles of struts.
"""

import cmath
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..model.phasors import REAL, ZERO, Complex
from ..model.planes import Edge, PinEdge, SlideEdge, WeldEdge
from .reference import AtReference


class _Pose(NamedTuple):
    first: str
    angle: float
    origin: complex


def described_joints(
    edges: Sequence[Edge], reference: AtReference, given: Mapping[str, float]
) -> dict[str, float]:
    """Return the values of all joints whose two bodies have known poses (radian or meter).

    Args:
        edges: The joints of a linkage: tree joints first, then closures and struts.
        reference: The reference configuration.
        given: Known values of joints, swing angles and cylinders by name.
    """
    bodies = _Bodies(edges, reference, given)
    for edge in edges:
        bodies.place(edge)
    found = {edge.name: bodies.value(edge) for edge in edges}
    return {name: value for name, value in found.items() if value is not None}


class _Bodies:
    """The body poses that are already known."""

    def __init__(
        self, edges: Sequence[Edge], reference: AtReference, given: Mapping[str, float]
    ) -> None:
        self._far = {edge.a: edge for edge in edges if edge.name.endswith(".end")}
        self._reference, self._given = reference, given
        self._poses: dict[str, _Pose] = {}

    def place(self, edge: Edge) -> None:
        """Compute the pose of the second body of a joint.

        If the joint value is unknown, the second body starts a new group of bodies.
        """
        a = self._poses.setdefault(edge.a, _Pose(edge.a, 0.0, 0j))
        if edge.b in self._poses:
            return
        value = 0.0 if isinstance(edge, WeldEdge) else self._given.get(edge.name)
        if value is None:
            value = self._toward_far_end(edge)
        if value is None:
            self._poses[edge.b] = _Pose(edge.b, 0.0, 0j)
            return
        angle, at_a = a.angle + self._phase(edge.rotor), self._number(edge.at_a)
        if isinstance(edge, PinEdge):
            angle += edge.sense * value
        elif isinstance(edge, SlideEdge):
            at_a += value * self._number(edge.direction)
        at_b = (ZERO, ZERO) if isinstance(edge, WeldEdge) else edge.at_b
        origin = self._at(a, at_a) - cmath.exp(1j * angle) * self._number(at_b)
        self._poses[edge.b] = _Pose(a.first, angle, origin)

    def value(self, edge: Edge) -> float | None:
        """Return the value of a joint, or None for a weld or for bodies in different groups."""
        a, b = self._poses[edge.a], self._poses[edge.b]
        if a.first != b.first or isinstance(edge, WeldEdge):
            return None
        if isinstance(edge, PinEdge):
            return edge.sense * (b.angle - a.angle - self._phase(edge.rotor))
        between = self._at(b, self._number(edge.at_b)) - self._at(a, self._number(edge.at_a))
        along = cmath.exp(1j * a.angle) * self._number(edge.direction)
        return (along.conjugate() * between).real

    def _toward_far_end(self, edge: Edge) -> float | None:
        """Return the joint angle or travel at which a strut points to its other end, or None."""
        a = self._poses[edge.a]
        far = self._far.get(edge.b) or self._far.get(f"{edge.b}.piston")
        end = self._poses.get(far.b) if far else None
        if far is None or end is None or end.first != a.first or isinstance(edge, WeldEdge):
            return None
        between = self._at(end, self._far_point(far)) - self._at(a, self._number(edge.at_a))
        if isinstance(edge, PinEdge):
            return edge.sense * (cmath.phase(between) - a.angle - self._phase(edge.rotor))
        along = cmath.exp(1j * a.angle) * self._number(edge.direction)
        return (along.conjugate() * between).real

    def _far_point(self, far: Edge) -> complex:
        return self._number(far.at_b) if isinstance(far, PinEdge) else 0j

    def _at(self, body: _Pose, point: complex) -> complex:
        return body.origin + cmath.exp(1j * body.angle) * point

    def _number(self, value: Complex) -> complex:
        return self._reference.number(value)

    def _phase(self, rotor: Complex) -> float:
        return 0.0 if rotor == REAL else cmath.phase(self._number(rotor))
