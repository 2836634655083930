"""Subproblem 6: two equations that are linear in the cosines and sines of two angles.

Statement: The equation ``A1 x1 + A2 x2 = b`` with ``x_j = (sin, cos)(theta_j)`` is solved for both
angles. Geometrically, two ellipses intersect in up to four points. Another form of the equations is
``h_i.(R(k_i, theta1) p_i) + h'_i.(R(k'_i, theta2) p'_i) = d_i`` for i = 1, 2.

Derivation: the vectors (x1, x2) that solve both equations form a plane ``X + N z``. Here, X is the
point of the plane nearest to 0, and the matrix N has two orthonormal columns. Since ``|x1|^2 +
|x2|^2 = 2``, z lies on the circle ``z = rho (cos phi, sin phi)`` with ``rho^2 = 2 - |X|^2``. The
condition ``|x1|^2 - |x2|^2 = 0`` then is a trigonometric equation of degree 2 in phi, that is, a
quartic, which the module ``quartic`` solves. The derivation eliminates neither angle, so A1 and A2
may be singular. Only the combined matrix ``[A1 A2]`` must have rank 2. Two Householder reflections
give X and N. Newton steps, which are damped near singular Jacobians, then refine the two angles. A
Newton step is used only if it reduces the error of the equations.

Labels: the second branch sign is the sign of the Jacobian determinant. This sign changes only at
double solutions. The first branch sign distinguishes two solutions with equal second branch signs.
If A1, A2 and b change along a closed path, two solutions with equal second branch signs may change
places. If two solutions change places, their first branch signs jump somewhere on the closed path.

Boundary: at a double solution, the determinant of the Jacobian is 0.

Degenerate: if the rank of ``[A1 A2]`` is 1, the solutions form a curve. From this curve, a point
with ``a1.x1 / |a1| = a2.x2 / |a2|`` is selected, where (a1, a2) is the longer row of ``[A1 A2]``.
Every nonempty curve of solutions contains a point that satisfies this equation. If the rank of
``[A1 A2]`` is 0, both angles are arbitrary.

Source: Elias and Wen 2022, subproblem 6, where one angle is eliminated. The circle in the plane of
solutions is our own derivation.
"""

from dataclasses import dataclass

import sympy as sp
from sympy.logic.boolalg import Boolean

from ...model.tolerances import (
    DEPENDENT_ROWS,
    DIRECTION_FLOOR,
    ELLIPSES_DAMPING,
    FARTHEST_POINT,
    MEETING_ROOTS,
    NEARLY_REAL,
)
from ...terms.terms import Terms
from .equations import Pair, Rows
from .quartic import ONE, ZERO, Reference, circle_roots, select
from .turns import CosSin, direction

Signs = tuple[sp.Symbol, sp.Symbol]
STEPS = 2


@dataclass(frozen=True)
class TwoAngles:
    """Two angles that subproblem 6 solves for, with their margin.

    Attributes:
        first: Cosine and sine of theta1.
        second: Cosine and sine of theta2.
        margin: The margin is positive for a real solution, and 0 for a double solution. Without a
            real solution, the margin is negative and the angles are near the least-squares
            solution.
    """

    first: CosSin
    second: CosSin
    margin: sp.Expr


def sp6(terms: Terms, A1: Rows, A2: Rows, b: Pair, signs: Signs) -> TwoAngles:
    """Solve ``A1 (sin, cos)(theta1) + A2 (sin, cos)(theta2) = b``.

    Args:
        terms: Table of named terms.
        A1: Coefficients of sin and cos of theta1, one row per equation.
        A2: Coefficients of sin and cos of theta2.
        b: Right-hand sides.
        signs: Two symbols for branch signs (1 or -1), whose four combinations give all solutions.
    """
    found = algebraic(terms, A1, A2, b, signs)
    angles = found.first, found.second
    rows = tuple((*one, *two) for one, two in zip(A1, A2, strict=True))
    error = _error(terms, rows, b, angles)
    exists = found.margin >= -NEARLY_REAL
    for _ in range(STEPS):
        angles, error = _improved(terms, rows, b, angles, error, exists)
    return TwoAngles(*angles, found.margin)


def algebraic(
    terms: Terms, A1: Rows, A2: Rows, b: Pair, signs: Signs, separation: sp.Expr = ZERO
) -> TwoAngles:
    """Solve ``sp6`` with the quartic alone, without Newton steps.

    If two solutions coincide, each solution is moved away from the common point by the angle
    ``separation``.
    """
    let = terms.let
    X, N, orientation = _plane(
        terms, tuple((*one, *two) for one, two in zip(A1, A2, strict=True)), b
    )
    rho2 = let(2 - _dot(terms, X, X))
    rho = select(terms, rho2 > MEETING_ROOTS, sp.sqrt(rho2), separation)
    n, m = N
    X_X, X_n, X_m = (_difference(terms, X, column) for column in (X, n, m))
    n_n, n_m, m_m = _difference(terms, n, n), _difference(terms, n, m), _difference(terms, m, m)
    half = let(let(rho**2) / 2)
    # The direction `normal` defines the branch signs of the roots. The roots and `normal` rotate
    # together with the input vectors.
    normal = -A1[0][1], A1[0][0], ZERO, ZERO
    along = tuple(_dot(terms, normal, column) for column in N)
    root = circle_roots(
        terms,
        let(X_X + half * let(n_n + m_m)),
        (let(2 * rho * X_n), let(2 * rho * X_m)),
        (let(half * let(n_n - m_m)), let(2 * half * n_m)),
        signs,
        separation,
        Reference((along[0], along[1]), orientation),
    )
    z = let(rho * root.turn.c), let(rho * root.turn.s)
    s1, c1, s2, c2 = (let(x + z[0] * u + z[1] * v) for x, u, v in zip(X, n, m, strict=True))
    margin = let(sp.Min(rho2, root.margin, evaluate=False))
    return TwoAngles(direction(terms, c1, s1), direction(terms, c2, s2), margin)


Row = tuple[sp.Expr, ...]


def _plane(terms: Terms, rows: tuple[Row, ...], b: Pair) -> tuple[Row, tuple[Row, Row], sp.Expr]:
    """Return the point nearest to 0, a basis and the orientation of ``rows.(x1, x2) = b``.

    The orientation of the plane is the sign of the determinant of the two rows and the two basis
    vectors.
    """
    let = terms.let
    squares = tuple(_dot(terms, row, row) for row in rows)
    swap = squares[1] > squares[0]
    long, short = (
        tuple(select(terms, swap, one, other) for one, other in zip(rows[i], rows[j], strict=True))
        for i, j in ((1, 0), (0, 1))
    )
    b_long, b_short = select(terms, swap, b[1], b[0]), select(terms, swap, b[0], b[1])
    long = (let(long[0] + DIRECTION_FLOOR), *long[1:])
    first = _Reflection.of(terms, long)
    y = _clipped(terms, let(b_long / first.image))
    head, *left = first.applied(terms, short)
    rest = let(b_short - head * y)
    # If the two rows of [A1 A2] are dependent, the equation ``a1.x1 / |a1| = a2.x2 / |a2|``
    # replaces the row with the smaller norm.
    own = terms.let(sum((x * x for x in left), ZERO))
    dependent = own <= let(DEPENDENT_ROWS**2 * _dot(terms, long, long))
    a1, a2 = (direction(terms, *long[k : k + 2]) for k in (0, 2))
    head, *other = first.applied(terms, (a1.c, a1.s, -a2.c, -a2.s))
    tail = tuple(select(terms, dependent, one, two) for one, two in zip(other, left, strict=True))
    rest = select(terms, dependent, let(-head * y), rest)
    second = _Reflection.of(terms, tail)
    z = _clipped(terms, let(rest / second.image))
    X = first.applied(terms, (y, *second.applied(terms, (z, ZERO, ZERO))))
    n, m = (
        first.applied(terms, (ZERO, *second.applied(terms, axis)))
        for axis in ((ZERO, ONE, ZERO), (ZERO, ZERO, ONE))
    )
    sense = select(terms, swap, -ONE, ONE)
    for image in (first.image, second.image):
        sense = terms.let(sense * select(terms, image >= 0, ONE, -ONE))
    return X, (n, m), sense


def _clipped(terms: Terms, value: sp.Expr) -> sp.Expr:
    return terms.let(
        sp.Max(-FARTHEST_POINT, sp.Min(value, FARTHEST_POINT, evaluate=False), evaluate=False)
    )


@dataclass(frozen=True)
class _Reflection:
    v: Row
    inverse: sp.Expr
    image: sp.Expr

    @classmethod
    def of(cls, terms: Terms, vector: Row) -> "_Reflection":
        let = terms.let
        norm = let(sp.sqrt(_dot(terms, vector, vector)))
        image = select(terms, vector[0] >= 0, -norm, norm)
        kappa = let(norm * let(norm + sp.Abs(vector[0])))
        return cls((let(vector[0] - image), *vector[1:]), let(1 / kappa), image)

    def applied(self, terms: Terms, vector: Row) -> Row:
        weight = terms.let(_dot(terms, self.v, vector) * self.inverse)
        return tuple(terms.let(x - weight * u) for x, u in zip(vector, self.v, strict=True))


def _improved(
    terms: Terms,
    rows: tuple[Row, ...],
    b: Pair,
    angles: tuple[CosSin, CosSin],
    error: Row,
    exists: Boolean,
) -> tuple[tuple[CosSin, CosSin], Row]:
    """Apply a damped Newton step to both angles if the step reduces the error.

    The step ``-(J^T J + mu)^-1 J^T e`` is computed from the adjugate of J, because the product J^T
    J would lose accuracy. The computed step is ``-(det J adj(J) e + mu J^T e) / (det^2 + mu |J|^2 +
    mu^2)``.
    """
    let = terms.let
    one, two = angles
    e1, e2 = error
    (j11, j12), (j21, j22) = (
        (let(row[0] * one.c - row[1] * one.s), let(row[2] * two.c - row[3] * two.s)) for row in rows
    )
    det = let(j11 * j22 - j12 * j21)
    square = let(j11**2 + j12**2 + j21**2 + j22**2)
    mu = let(ELLIPSES_DAMPING * square)
    inverse = let(1 / let(let(det**2 + mu * let(square + mu)) + DIRECTION_FLOOR))
    top1 = let(det * let(j22 * e1 - j12 * e2) + mu * let(j11 * e1 + j21 * e2))
    top2 = let(det * let(j11 * e2 - j21 * e1) + mu * let(j12 * e1 + j22 * e2))
    there = advanced(terms, one, let(-top1 * inverse)), advanced(terms, two, let(-top2 * inverse))
    left = _error(terms, rows, b, there)
    smaller = _dot(terms, left, left) < _dot(terms, error, error)
    better = sp.And(exists, smaller)
    one, two = (chosen(terms, better, new, old) for new, old in zip(there, angles, strict=True))
    kept = tuple(select(terms, better, new, old) for new, old in zip(left, error, strict=True))
    return (one, two), kept


def advanced(terms: Terms, turn: CosSin, step: sp.Expr) -> CosSin:
    """Return the rotation ``turn``, advanced by the angle whose tangent is ``step``."""
    let = terms.let
    return direction(terms, let(turn.c - step * turn.s), let(turn.s + step * turn.c))


def chosen(terms: Terms, condition: Boolean, one: CosSin, other: CosSin) -> CosSin:
    """Return ``one`` if the condition holds, otherwise ``other``."""
    return CosSin(
        select(terms, condition, one.c, other.c), select(terms, condition, one.s, other.s)
    )


def _error(terms: Terms, rows: tuple[Row, ...], b: Pair, angles: tuple[CosSin, CosSin]) -> Row:
    one, two = angles
    x = (one.s, one.c, two.s, two.c)
    return tuple(terms.let(_dot(terms, row, x) - y) for row, y in zip(rows, b, strict=True))


def _dot(terms: Terms, a: Row, b: Row) -> sp.Expr:
    return terms.let(sum((u * v for u, v in zip(a, b, strict=True)), ZERO))


def _difference(terms: Terms, a: Row, b: Row) -> sp.Expr:
    """Return ``a1.b1 - a2.b2`` for vectors a = (a1, a2) and b = (b1, b2)."""
    return terms.let(a[0] * b[0] + a[1] * b[1] - a[2] * b[2] - a[3] * b[3])
