"""Equations of loops with variable geometry: residuals, and their wrenches.

An equation compares end b of a closure or strut with end a, in the axes of a. The derivative of the
equation along a motion of the body at end b is the power of a wrench. The derivative along a motion
of the body at end a is the negative power of the same wrench, even if the loop is open.

| closer            | equations                                                     |
|-------------------|---------------------------------------------------------------|
| strut             | distance of the ends minus the length                         |
| planar: pin, ball | both coordinates of the points' difference in the plane       |
| planar: slider    | offset across the guide, sine of the rotation                 |
| planar: weld      | both coordinates of the difference, sine of the rotation      |
| others            | as :func:`chasles.derive.loops.model.constraints.constraints`       |
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ...chain.poe import placement_matrix
from ...model.mechanism import Closure, Mechanism, Strut
from ...terms.terms import Terms
from ...terms.vectors import ORIGIN, Vector, combination, cross, dot, named, subtracted
from .mechanism_geometry import MechanismGeometry
from .motions import ElementaryMotion, Reached, Wrench, gradient
from .planes import Axes, Loop, loops


@dataclass(frozen=True)
class Row:
    """An equation of a loop.

    Attributes:
        residual: The residual, zero if the loop is closed.
        unit: m or 1.
        powers: The power of the equation's wrench for each motion of both branches, negated on
            branch a.
        length: A strut length that the residual contains with a minus sign; usually 0.
    """

    residual: sp.Expr
    unit: str
    powers: tuple[tuple[sp.Expr, ElementaryMotion], ...]
    length: sp.Expr = sp.S.Zero

    def gradient(self, terms: Terms, variables: Sequence[sp.Symbol]) -> tuple[sp.Expr, ...]:
        """Returns the derivative of the residual with respect to each variable."""
        longer = sp.S.NegativeOne, ElementaryMotion(self.length, ORIGIN, None)
        return gradient(terms, [*self.powers, longer], variables)


def loop_rows(
    mechanism: Mechanism,
    terms: Terms,
    geometry: MechanismGeometry,
    bodies: Mapping[str, Reached],
) -> list[Row]:
    """Returns the equations of all loops, in the order of the closures and struts.

    Args:
        mechanism: The description.
        terms: Table that receives the named terms.
        geometry: The geometry of the robot as variables.
        bodies: The frames of all bodies.
    """
    ends = (_Ends(terms, geometry, bodies, loop) for loop in loops(mechanism))
    return [row for pair in ends for row in pair.rows()]


class _Ends:
    """The two ends of one closure or strut."""

    def __init__(
        self,
        terms: Terms,
        geometry: MechanismGeometry,
        bodies: Mapping[str, Reached],
        loop: Loop,
    ) -> None:
        self.terms, self.geometry, self.loop = terms, geometry, loop
        closer = loop.closer
        at_a, at_b = geometry.ends[closer.name]
        self.body = bodies[closer.a.body]
        self.a = self.body.moved(terms, at_a)
        self.b = bodies[closer.b.body].moved(terms, at_b)
        self.difference = subtracted(terms, self.b.pose[1], self.a.pose[1])

    def rows(self) -> list[Row]:
        """Returns the equations of the closure or strut."""
        closer = self.loop.closer
        if isinstance(closer, Strut):
            return [self._distance(closer)]
        linkage = self.geometry.planar.get(closer.name)
        if linkage is None:
            return self._in_space(closer)
        return self._in_plane(closer, linkage.axes[closer.a.body])

    def _distance(self, strut: Strut) -> Row:
        terms, difference = self.terms, self.difference
        distance = terms.let(sp.sqrt(dot(terms, difference, difference)))
        direction = named(terms, (part / distance for part in difference))
        length = self.geometry.lengths[strut.name]
        residual = terms.let(distance - terms.let(length))
        return self._row(residual, "m", Wrench(direction, self.b.pose[1]), length)

    def _in_plane(self, closure: Closure, axes: Axes) -> list[Row]:
        x, y = self._turned(axes.x), self._turned(axes.y)
        if closure.kind in ("pin", "ball"):
            return [self._along(x), self._along(y)]
        # Both end frames have the same axes if the loop is closed.
        R = placement_matrix(closure.a.placement)[:3, :3]
        if closure.kind == "slider":
            across = R.T * axes.n.cross(R[:, 2])
            own = self._of_end(self.a, across)
            guide = self._of_end(self.b, sp.Matrix([0, 0, 1]))
            return [self._along(own), self._turn(own, guide)]
        other = self._of_end(self.b, R.T * axes.y)
        return [self._along(x), self._along(y), self._turn(x, other)]

    def _in_space(self, closure: Closure) -> list[Row]:
        (x_a, y_a, z_a), (x_b, y_b, z_b) = self.a.pose[0], self.b.pose[0]
        met = [self._along(axis) for axis in (x_a, y_a, z_a)]
        turns = [self._turn(y_a, z_b), self._turn(z_a, x_b), self._turn(x_a, y_b)]
        return {
            "ball": met,
            "pin": [*met, self._turn(x_a, z_b), self._turn(y_a, z_b)],
            "slider": [*met[:2], *turns],
            "weld": [*met, *turns],
        }[closure.kind]

    def _turned(self, vector: sp.Matrix) -> Vector:
        """Returns a constant direction of the body at end a, in base axes."""
        return combination(self.terms, named(self.terms, list(vector)), self.body.pose[0])

    def _of_end(self, end: Reached, vector: sp.Matrix) -> Vector:
        """Returns a constant direction of an end's frame, in base axes."""
        return combination(self.terms, named(self.terms, list(vector)), end.pose[0])

    def _along(self, direction: Vector) -> Row:
        """Returns the equation for the position difference along a direction fixed to a."""
        residual = dot(self.terms, direction, self.difference)
        return self._row(residual, "m", Wrench(direction, self.b.pose[1]))

    def _turn(self, of_a: Vector, of_b: Vector) -> Row:
        """Returns the equation for the cosine between directions of frames a and b."""
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
