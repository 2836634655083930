"""Subproblem 5: three rotations that close a loop of vectors.

Statement: The equation ``p0 + R(k1, theta1) p1 = R(k2, theta2) (p2 + R(k3, theta3) p3)`` is solved
for the three angles.

Derivation: let v be the left side and ``R(k2, theta2) w`` the right side of the equation. The
rotation about k2 changes neither the length of w nor its component along k2. Therefore, ``|v|^2 =
|w|^2`` and ``k2.v = k2.w``.

These two scalar equations are linear in the cosines and sines of theta1 and theta3. Subproblem 6
solves the two scalar equations, with up to four solutions. The angle theta2 is the rotation about
k2 from w to v.

At a shoulder singularity, v and w are almost parallel to k2. If v and w are almost parallel to k2,
their squared lengths determine the components v' and w' normal to k2 only to 1e-8. If the squared
lengths do not distinguish two solutions, two start values on opposite sides of the double solution
are used. A second-order step in v' and w' moves each start value to the nearer root and restores
the accuracy. If first derivatives vanish, the second-order step is not accurate enough, so damped
Newton steps on ``v - R(k2, theta2) w = 0`` refine all three angles. A step is used only if the step
reduces the closure error of the vector loop.

Boundary: at a double solution, the determinant of the Jacobian is 0.

Degenerate: if v and w are parallel to k2, theta2 is arbitrary and set to 0. For dependent scalar
equations, see "Degenerate" in subproblem 6.

Source: Elias and Wen 2022, subproblem 5.
"""

from dataclasses import dataclass

import sympy as sp
from sympy.logic.boolalg import Boolean

from ...model.tolerances import (
    DIRECTION_FLOOR,
    LOOP_DAMPING,
    NEARLY_REAL,
    SOLUTION_SEPARATION,
)
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, cross, dot, named, subtracted
from .equations import Pair, Rows
from .quartic import ONE, ZERO, select
from .second_order import Expansion, step_on_parabola
from .sp6 import Signs, advanced, algebraic, chosen
from .turns import CosSin, direction, perpendicular, rotated

STEPS = 2


@dataclass(frozen=True)
class ThreeAngles:
    """Three angles that subproblem 5 solves for, with their margin.

    Attributes:
        first: Cosine and sine of theta1.
        second: Cosine and sine of theta2.
        third: Cosine and sine of theta3.
        margin: The margin of the solution, as in subproblem 6.
    """

    first: CosSin
    second: CosSin
    third: CosSin
    margin: sp.Expr


def sp5(
    terms: Terms,
    p0: Vector,
    k1: Vector,
    p1: Vector,
    k2: Vector,
    p2: Vector,
    k3: Vector,
    p3: Vector,
    signs: Signs,
) -> ThreeAngles:
    """Solve ``p0 + R(k1, theta1) p1 = R(k2, theta2) (p2 + R(k3, theta3) p3)``.

    Args:
        terms: Table of named terms.
        p0: Constant vector on the left side of the equation.
        k1: Unit vector of the first axis.
        p1: The vector that rotates about the first axis.
        k2: Unit vector of the second axis.
        p2: The vector that rotates about the second axis but not about the third.
        k3: Unit vector of the third axis.
        p3: The vector that rotates first about the third axis and then about the second axis.
        signs: Two symbols (1 or -1), whose four combinations select all four solutions.
    """
    let = terms.let
    loop = _Loop(_Arm.of(terms, p0, k1, p1), k2, _Arm.of(terms, p2, k3, p3))
    size2 = let(sum((dot(terms, p, p) for p in (p0, p1, p2, p3)), DIRECTION_FLOOR))
    inverse = let(1 / let(sp.sqrt(size2)))
    found = algebraic(terms, *loop.equations(terms, inverse), signs, SOLUTION_SEPARATION)
    exists = found.margin >= -NEARLY_REAL
    state = loop.closed(terms, found.first, found.second)
    for _ in range(STEPS):
        state = loop.on_parabola(terms, state, exists, inverse)
    for _ in range(STEPS):
        state = loop.improved(terms, state, exists)
    return ThreeAngles(*state.turns, found.margin)


@dataclass(frozen=True)
class _Arm:
    """The sum ``fixed + cos across + sin turned`` of a constant vector and a rotated vector."""

    fixed: Vector
    across: Vector
    turned: Vector

    @classmethod
    def of(cls, terms: Terms, offset: Vector, k: Vector, p: Vector) -> "_Arm":
        across = perpendicular(terms, k, p)
        along = subtracted(terms, p, across)
        return cls(added(terms, offset, along), across, cross(terms, k, p))

    def at(self, terms: Terms, turn: CosSin) -> Vector:
        return combination(terms, (ONE, turn.c, turn.s), (self.fixed, self.across, self.turned))

    def rate(self, terms: Terms, turn: CosSin) -> Vector:
        return combination(terms, (turn.c, -turn.s), (self.turned, self.across))


@dataclass(frozen=True)
class _State:
    turns: tuple[CosSin, CosSin, CosSin]
    image: Vector
    residual: Vector


@dataclass(frozen=True)
class _Loop:
    v: _Arm
    k2: Vector
    w: _Arm

    def equations(self, terms: Terms, inverse: sp.Expr) -> tuple[Rows, Rows, Pair]:
        """Return the two scaled equations ``|v|^2 = |w|^2`` and ``k2.v = k2.w``."""
        let = terms.let
        v, w = self.v, self.w
        inverse2 = let(inverse**2 / 2)

        def coefficients(scale: sp.Expr, c: Vector, arm: _Arm) -> Pair:
            return let(scale * dot(terms, c, arm.turned)), let(scale * dot(terms, c, arm.across))

        squares = [dot(terms, x, x) for x in (w.fixed, w.across, v.fixed, v.across)]
        along = dot(terms, self.k2, subtracted(terms, w.fixed, v.fixed))
        return (
            (
                coefficients(2 * inverse2, v.fixed, v),
                coefficients(inverse, self.k2, v),
            ),
            (
                coefficients(-2 * inverse2, w.fixed, w),
                coefficients(-inverse, self.k2, w),
            ),
            (
                let(inverse2 * let(squares[0] + squares[1] - squares[2] - squares[3])),
                let(inverse * along),
            ),
        )

    def closed(self, terms: Terms, first: CosSin, third: CosSin) -> _State:
        v, w = (
            perpendicular(terms, self.k2, arm.at(terms, turn))
            for arm, turn in ((self.v, first), (self.w, third))
        )
        x, y = dot(terms, w, v), dot(terms, cross(terms, self.k2, w), v)
        return self.state(terms, (first, direction(terms, x, y), third))

    def state(self, terms: Terms, turns: tuple[CosSin, CosSin, CosSin]) -> _State:
        first, second, third = turns
        image = rotated(terms, self.k2, second, self.w.at(terms, third))
        return _State(turns, image, subtracted(terms, self.v.at(terms, first), image))

    def on_parabola(self, terms: Terms, state: _State, exists: Boolean, inverse: sp.Expr) -> _State:
        """Move theta1 and theta3 to the nearer common root of two equations, and update theta2.

        Both equations are expanded to second order in theta1 and theta3.

        The new angles are kept only if they reduce the closure error of the vector loop. Let v' and
        w' be the components of v and w normal to k2. The equations are ``k2.(v - w) = 0`` and
        ``(|v'|^2 - |w'|^2) / (2 L) = 0``. Both equations are as accurate as v' and w'.
        """
        let = terms.let
        first, _, third = state.turns
        v, w = self.v.at(terms, first), self.w.at(terms, third)
        v_across, w_across = (perpendicular(terms, self.k2, x) for x in (v, w))
        half = let(inverse / 2)
        along = dot(terms, self.k2, subtracted(terms, v, w))
        across = dot(terms, v_across, v_across) - dot(terms, w_across, w_across)
        of_v = self._expansion(terms, v_across, self.v, first, inverse)
        of_w = self._expansion(terms, w_across, self.w, third, inverse)
        equations = [
            Expansion(value, a[0], -b[0], a[1], -b[1])
            for value, a, b in zip((along, let(half * across)), of_v, of_w, strict=True)
        ]
        step1, step3 = step_on_parabola(terms, (equations[0], equations[1]))
        there = self.closed(terms, advanced(terms, first, step1), advanced(terms, third, step3))
        return _smaller(terms, exists, there, state)

    def _expansion(
        self, terms: Terms, across: Vector, arm: _Arm, turn: CosSin, inverse: sp.Expr
    ) -> tuple[tuple[sp.Expr, sp.Expr], tuple[sp.Expr, sp.Expr]]:
        """Return the first and second derivatives of ``k2.v`` and ``|v'|^2 / (2 L)``."""
        rate = arm.rate(terms, turn)
        arrow = subtracted(terms, arm.at(terms, turn), arm.fixed)
        rate_across = perpendicular(terms, self.k2, rate)
        curvature = dot(terms, rate_across, rate_across) - dot(terms, across, arrow)
        return (
            (dot(terms, self.k2, rate), -dot(terms, self.k2, arrow)),
            (terms.let(inverse * dot(terms, across, rate)), terms.let(inverse * curvature)),
        )

    def improved(self, terms: Terms, state: _State, exists: Boolean) -> _State:
        """Apply a damped Newton step to all three angles if the step reduces the closure error.

        The step ``-(J^T J + mu)^-1 J^T e`` is written with the adjugate, because computing J^T J
        would cost accuracy. With ``M = J^T J``, the step is ``-(det J adj(J) e + mu (tr M + mu - M)
        J^T e) / (det^2 + mu |adj J|^2 + mu^2 tr M + mu^3)``.
        """
        let = terms.let
        first, second, third = state.turns
        columns = (
            self.v.rate(terms, first),
            cross(terms, state.image, self.k2),
            _reversed(rotated(terms, self.k2, second, self.w.rate(terms, third))),
        )
        a, b, c = columns
        rows = cross(terms, b, c), cross(terms, c, a), cross(terms, a, b)
        det = dot(terms, a, rows[0])
        trace = let(sum((dot(terms, column, column) for column in columns), ZERO))
        minors = let(sum((dot(terms, row, row) for row in rows), ZERO))
        mu = let(LOOP_DAMPING * trace)
        bottom = let(det**2 + mu * let(minors + mu * let(trace + mu)))
        inverse = let(1 / let(bottom + DIRECTION_FLOOR))
        gradient = named(terms, (dot(terms, column, state.residual) for column in columns))
        image = combination(terms, gradient, columns)
        steps = []
        for column, row, g in zip(columns, rows, gradient, strict=True):
            damped = let(let(trace + mu) * g - dot(terms, column, image))
            steps.append(let(-let(det * dot(terms, row, state.residual) + mu * damped) * inverse))
        there = self.state(
            terms,
            (
                advanced(terms, first, steps[0]),
                advanced(terms, second, steps[1]),
                advanced(terms, third, steps[2]),
            ),
        )
        return _smaller(terms, exists, there, state)


def _smaller(terms: Terms, exists: Boolean, new: _State, old: _State) -> _State:
    better = sp.And(
        exists, dot(terms, new.residual, new.residual) < dot(terms, old.residual, old.residual)
    )
    first, second, third = (
        chosen(terms, better, a, b) for a, b in zip(new.turns, old.turns, strict=True)
    )
    return _State(
        (first, second, third),
        _select(terms, better, new.image, old.image),
        _select(terms, better, new.residual, old.residual),
    )


def _select(terms: Terms, condition: Boolean, one: Vector, other: Vector) -> Vector:
    x, y, z = (select(terms, condition, a, b) for a, b in zip(one, other, strict=True))
    return x, y, z


def _reversed(v: Vector) -> Vector:
    return -v[0], -v[1], -v[2]
