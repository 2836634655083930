"""Closure equations of loops with variable geometry, and the wrench of each equation.

Each closure equation compares end b of a closure or strut with end a, in the axes of the body at
end a. Each closure equation has a corresponding wrench. Let V be the twist of the body at end b
relative to the body at end a. The rate of the residual of a closure equation is the reciprocal
product of its wrench and V, even if the loop is open.

The table ``ROWS`` lists the equations of each kind of closure. A strut has one equation for the
distance between its ends.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ...chain.poe import placement_matrix
from ...model.mechanism import Closure, Mechanism, Strut
from ...terms.terms import Terms
from ...terms.vectors import ORIGIN, Vector, combination, cross, dot, named, subtracted
from .coupling_equations import residual_of, unit_of
from .mechanism_geometry import MechanismGeometry
from .motions import ElementaryMotion, Reached, Wrench, gradient
from .planes import Axes, Loop, loops
from .rows import ROWS, Along, Kind


@dataclass(frozen=True)
class Row:
    """A closure equation of a loop, or the equation of a coupling.

    Attributes:
        residual: Expression that is zero if the loop is closed, or if the coupling equation holds.
        unit: Unit of the residual, m or 1.
        powers: Pairs (power, motion) for the elementary motions of both loop branches. The power is
            the derivative of the residual with respect to the value of the elementary motion.
        length: Strut length, which a strut equation subtracts from the distance between the strut
            ends. In all other equations, ``length`` is 0.
    """

    residual: sp.Expr
    unit: str
    powers: tuple[tuple[sp.Expr, ElementaryMotion], ...]
    length: sp.Expr = sp.S.Zero

    def gradient(self, terms: Terms, variables: Sequence[sp.Symbol]) -> tuple[sp.Expr, ...]:
        """Return the derivative of the residual with respect to each variable."""
        longer = sp.S.NegativeOne, ElementaryMotion(self.length, ORIGIN, None)
        return gradient(terms, [*self.powers, longer], variables)


def loop_rows(
    mechanism: Mechanism,
    terms: Terms,
    geometry: MechanismGeometry,
    bodies: Mapping[str, Reached],
) -> list[Row]:
    """Return the equations of all loops in the order of the closures and struts.

    Args:
        mechanism: The description.
        terms: Receives the terms.
        geometry: The symbolic geometry of the robot.
        bodies: Pose and variable motions of each body frame, keyed by body name.
    """
    ends = (_Ends(terms, geometry, bodies, loop) for loop in loops(mechanism))
    of_loops = [row for pair in ends for row in pair.rows()]
    return [*of_loops, *_coupling_rows(mechanism, terms, geometry)]


def _coupling_rows(
    mechanism: Mechanism, terms: Terms, geometry: MechanismGeometry
) -> Iterator[Row]:
    """Yield the linear equation of each coupling between joint values."""
    for coupling in mechanism.couplings:
        offset = geometry.offsets[coupling.joint]
        residual = terms.let(residual_of(coupling, geometry.values) + coupling.offset - offset)
        factors = [(coupling.joint, sp.S.One), *((name, -r) for name, r in coupling.ratios)]
        powers = tuple(
            (factor, ElementaryMotion(geometry.values[name], ORIGIN, None))
            for name, factor in factors
        )
        powers += ((sp.S.NegativeOne, ElementaryMotion(offset, ORIGIN, None)),)
        yield Row(residual, unit_of(mechanism, coupling), powers)


class _Ends:
    def __init__(
        self,
        terms: Terms,
        geometry: MechanismGeometry,
        bodies: Mapping[str, Reached],
        loop: Loop,
    ) -> None:
        self.terms, self.geometry, self.loop = terms, geometry, loop
        loop_joint = loop.loop_joint
        at_a, at_b = geometry.ends[loop_joint.name]
        self.body = bodies[loop_joint.a.body]
        self.a = self.body.moved(terms, at_a)
        self.b = bodies[loop_joint.b.body].moved(terms, at_b)
        self.difference = subtracted(terms, self.b.pose[1], self.a.pose[1])

    def rows(self) -> list[Row]:
        """Return the closure equations of the joint or strut that closes this loop."""
        loop_joint = self.loop.loop_joint
        if isinstance(loop_joint, Strut):
            return [self._distance(loop_joint)]
        linkage = self.geometry.planar.get(loop_joint.name)
        axes = None if linkage is None else linkage.axes[loop_joint.a.body]
        kind: Kind = (loop_joint.kind, "space" if axes is None else "plane")
        return [
            self._along(self._axis(loop_joint, axes, "a", row.axis))
            if isinstance(row, Along)
            else self._turn(
                self._axis(loop_joint, axes, "a", row.a), self._axis(loop_joint, axes, "b", row.b)
            )
            for row in ROWS[kind]
        ]

    def _distance(self, strut: Strut) -> Row:
        terms, difference = self.terms, self.difference
        distance = terms.let(sp.sqrt(dot(terms, difference, difference)))
        direction = named(terms, (part / distance for part in difference))
        length = self.geometry.lengths[strut.name]
        residual = terms.let(distance - terms.let(length))
        return self._row(residual, "m", Wrench(direction, self.b.pose[1]), length)

    def _axis(self, closure: Closure, plane: Axes | None, side: str, k: int) -> Vector:
        """Return the direction, in base axes, of an axis that is fixed to one end of a closure."""
        end = self.a if side == "a" else self.b
        if plane is None:
            return end.pose[0][k]
        # Both end frames have the same axes if the loop is closed.
        R = placement_matrix(closure.a.placement)[:3, :3]
        if closure.kind == "slider":
            guide = sp.Matrix([0, 0, 1])
            return self._of_end(end, guide if k == 0 else R.T * plane.n.cross(R[:, 2]))
        return self._turned(plane[k]) if side == "a" else self._of_end(end, R.T * plane[k])

    def _turned(self, vector: sp.Matrix) -> Vector:
        """Convert a direction from the frame of the body at end a to base axes."""
        return combination(self.terms, named(self.terms, list(vector)), self.body.pose[0])

    def _of_end(self, end: Reached, vector: sp.Matrix) -> Vector:
        """Convert a direction from end frame a or b of the closure to base axes."""
        return combination(self.terms, named(self.terms, list(vector)), end.pose[0])

    def _along(self, direction: Vector) -> Row:
        """Return the equation for the position difference along a direction of frame a."""
        residual = dot(self.terms, direction, self.difference)
        return self._row(residual, "m", Wrench(direction, self.b.pose[1]))

    def _turn(self, of_a: Vector, of_b: Vector) -> Row:
        """Return the equation for the cosine between a direction of frame a and one of frame b."""
        couple = cross(self.terms, of_b, of_a)
        return self._row(dot(self.terms, of_a, of_b), "1", Wrench(ORIGIN, self.b.pose[1], couple))

    def _row(
        self, residual: sp.Expr, unit: str, wrench: Wrench, length: sp.Expr = sp.S.Zero
    ) -> Row:
        to_a, to_b = self.a.motions, self.b.motions
        shared = 0
        while shared < min(len(to_a), len(to_b)) and to_a[shared] is to_b[shared]:
            shared += 1
        powers = [(-wrench.power(self.terms, motion), motion) for motion in to_a[shared:]]
        powers += [(wrench.power(self.terms, motion), motion) for motion in to_b[shared:]]
        return Row(residual, unit, tuple(powers), length)
