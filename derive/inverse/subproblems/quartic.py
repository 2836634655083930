"""Roots of a trigonometric polynomial of degree 2 (a quartic).

Statement: The equation is ``a0 + a1 c + b1 s + a2 cos(2 phi) + b2 sin(2 phi) = 0`` with c =
cos(phi) and s = sin(phi).

Derivation: the coordinate axes are rotated by half the direction angle of the vector (a2, b2). In
the rotated axes, the equation is the conic ``g (x^2 - y^2) + p x + q y + r = 0`` with ``g = |(a2,
b2)|``. The roots are the intersections of the conic with the unit circle. On the unit circle, x^2 +
y^2 - 1 is 0, so lambda times this expression may be added to the conic. Let ``r' = r/g``, ``P =
(p/2g)^2`` and ``Q = (q/2g)^2``. With lambda = g tau, the conic becomes a pair of lines if tau is a
root of the cubic ``(tau^2 - 1)(tau - r') + P (tau - 1) + Q (tau + 1) = 0``. If -1 <= tau <= 1, both
lines are real. The cubic has the value -2 P at tau = -1 and 2 Q at tau = 1. Because P and Q are not
negative, the cubic always has a root tau between -1 and 1. Each line gives two roots of the
quartic, which are complex if the line misses the unit circle.

If the cubic has several real roots tau, the root farthest from the other roots is used. With this
choice, two coincident roots of the quartic lie on the same line, so no accuracy is lost. A double
root tau of the cubic is never used, because its accuracy is only 1e-8. Newton's method computes tau
and converges monotonically, because the start value and the other roots are on opposite sides of
tau. If the root tau farthest from the other roots is outside [-1, 1], the conic does not intersect
the unit circle. In this case, a quadratic equation gives the other two roots tau of the cubic.

If tau > 0, x and y are exchanged, which changes the sign of tau. After the exchange, t = 1 + tau is
always in [0, 1]. Newton's method refines the root t of ``t^3 - (3 + r') t^2 + (2 + 2 r' + P + Q) t
- 2 P = 0``. The refined root t has full relative accuracy even if t is small. Let alpha^2 = g t and
beta^2 = g (2 - t). The two lines are ``alpha x + beta y + m = 0`` and ``alpha x - beta y + n = 0``.
Three equations determine the offsets m and n of the lines: ``alpha (m + n) = p``, ``beta (n - m) =
q`` and ``m n = r + g - g t``. If alpha^2 > |p|, m and n are computed from m + n and n - m,
otherwise from n - m and m n. With this choice of formulas, a relative error of t changes the roots
no more than an equal relative error of max(|p|, |q|, |r|). If p is only a rounding error, t is set
to exactly 0, because a fourfold root is accurate only for t = 0.

Degenerate: if g = 0, the conic is a single line, and the second line of the pair is far away. If g
= 0, g is replaced by 1e-20 to avoid a division by zero. If all coefficients are 0, the roots are
arbitrary.

Source: the pencil of two conics (Ferrari 1545, and Richter-Gebert, Perspectives on Projective
Geometry, 11.4). The choice of lambda and the formulas without cancellation are our own derivation.
"""

from dataclasses import dataclass

import sympy as sp
from sympy.logic.boolalg import Boolean

from ...model.tolerances import (
    DIRECTION_FLOOR,
    EVEN_CONIC,
    GREATEST_T,
    MEETING_ROOTS,
    MIN_CONIC,
    MIN_SLOPE,
    MIN_T,
    NEARLY_LINEAR,
    OUTERMOST_ROOT,
    REAL_LINES,
)
from ...terms.terms import Terms
from .turns import CosSin, composed, direction

ZERO, ONE, HALF = sp.Integer(0), sp.Integer(1), sp.Rational(1, 2)
STEPS = 5
"""Number of Newton steps for the root tau of the cubic."""
POLISHING_STEPS = 2


@dataclass(frozen=True)
class CirclePoint:
    """A root of a trigonometric polynomial.

    Attributes:
        turn: Cosine and sine of the angle at which the polynomial is zero.
        margin: Distance of the root from a double root, in the units of the polynomial: 0 for a
            double root, and negative for a complex root. A complex root belongs to a line that does
            not intersect the unit circle. For a complex root, ``turn`` is the point of the unit
            circle nearest to this line.
    """

    turn: CosSin
    margin: sp.Expr


@dataclass(frozen=True)
class Conic:
    """The conic ``g (x^2 - y^2) + p x + q y + r = 0``."""

    g: sp.Expr
    p: sp.Expr
    q: sp.Expr
    r: sp.Expr


@dataclass(frozen=True)
class Reference:
    """The reference direction and the sense of rotation that define the signs of the roots.

    The roots are angles on a circle. If a joint rotates this circle, the reference direction
    rotates with the circle.

    Attributes:
        along: Direction in the plane of the circle: roots in the half plane of this direction have
            the sign 1.
        orientation: Sense of rotation (1 or -1) of the angle phi.
    """

    along: tuple[sp.Expr, sp.Expr]
    orientation: sp.Expr


def select(terms: Terms, condition: Boolean, one: sp.Expr, other: sp.Expr) -> sp.Expr:
    """Return a term that equals ``one`` if the condition holds, otherwise ``other``."""
    if one == other:
        return terms.let(one)
    return terms.let(sp.Piecewise((one, condition), (other, True), evaluate=False))


def circle_roots(
    terms: Terms,
    a0: sp.Expr,
    first: tuple[sp.Expr, sp.Expr],
    second: tuple[sp.Expr, sp.Expr],
    signs: tuple[sp.Symbol, sp.Symbol],
    separation: sp.Expr = ZERO,
    reference: Reference | None = None,
) -> CirclePoint:
    """Return a root of ``a0 + first.(cos(phi), sin(phi)) + second.(cos(2 phi), sin(2 phi))``.

    Args:
        terms: Table of named terms.
        a0: Constant coefficient.
        first: Coefficients of cos(phi) and sin(phi).
        second: Coefficients of cos(2 phi) and sin(2 phi).
        signs: Two symbols (1 or -1), whose four combinations select all four roots. The second sign
            is opposite to the sign of the polynomial's derivative at the root. If the coefficients
            change continuously, the second sign of a root changes only where two roots coincide.
            For two roots with equal second signs, the first sign states on which side of the axis
            of the conic each root lies.
        separation: Angle by which coinciding roots are moved away from their common position.
        reference: Reference direction and sense of rotation that define the two signs. Pass a
            reference if the default reference direction changes discontinuously.
    """
    conic, axis = _turned(terms, a0, first, second)
    t, slope, swap = _resolvent(terms, conic)
    p = select(terms, swap, -conic.q, conic.p)
    even = sp.And(sp.Abs(p) <= EVEN_CONIC, slope >= -REAL_LINES)
    p, t = select(terms, even, ZERO, p), select(terms, even, ZERO, t)
    q = select(terms, swap, -conic.p, conic.q)
    r = select(terms, swap, -conic.r, conic.r)
    side, sense = signs[0], signs[1]
    if reference is not None:
        along = terms.let(axis.c * reference.along[0] + axis.s * reference.along[1])
        side = terms.let(side * select(terms, along >= 0, ONE, -ONE))
        sense = terms.let(sense * reference.orientation)
    x, y, margin = _on_lines(terms, Conic(conic.g, p, q, r), t, swap, (side, sense), separation)
    point = CosSin(select(terms, swap, y, x), select(terms, swap, x, y))
    return CirclePoint(composed(terms, axis, point), margin)


def _turned(
    terms: Terms, a0: sp.Expr, first: tuple[sp.Expr, sp.Expr], second: tuple[sp.Expr, sp.Expr]
) -> tuple[Conic, CosSin]:
    """Return the conic in its principal axes, and the rotation angle of these axes."""
    let = terms.let
    (a1, b1), (a2, b2) = first, second
    length = let(sp.sqrt(let(a2**2 + b2**2)))
    g = let(sp.Max(length, MIN_CONIC, evaluate=False))
    upper = a2 >= 0
    axis = direction(
        terms, select(terms, upper, let(g + a2), b2), select(terms, upper, b2, let(g - a2))
    )
    c, s = axis.c, axis.s
    return Conic(g, let(a1 * c + b1 * s), let(b1 * c - a1 * s), a0), axis


def _resolvent(terms: Terms, conic: Conic) -> tuple[sp.Expr, sp.Expr, Boolean]:
    """Return the root t, the slope of the cubic at t = 0, and whether x and y are exchanged."""
    let = terms.let
    inverse = let(1 / conic.g)
    r = let(conic.r * inverse)
    P, Q = (let(let(HALF * v * inverse) ** 2) for v in (conic.p, conic.q))
    tau = _outer_root(terms, r, P, Q)
    swap = tau > 0
    P, Q = select(terms, swap, Q, P), select(terms, swap, P, Q)
    r = select(terms, swap, -r, r)
    t = let(sp.Max(ZERO, let(1 - sp.Abs(tau)), evaluate=False))
    a, b, c = let(3 + r), let(let(2 + 2 * r) + let(P + Q)), let(2 * P)
    for _ in range(POLISHING_STEPS):
        value = let(let(let(let(t - a) * t) + b) * t - c)
        slope = let(let(let(3 * t - 2 * a) * t) + b)
        step = let(let(value * slope) / let(slope**2 + MIN_SLOPE**2))
        t = let(sp.Max(ZERO, sp.Min(let(t - step), GREATEST_T, evaluate=False), evaluate=False))
    return t, b, swap


def _outer_root(terms: Terms, r: sp.Expr, P: sp.Expr, Q: sp.Expr) -> sp.Expr:
    """Return a root tau in [-1, 1] of the cubic, if possible the root farthest from the others."""
    let = terms.let
    middle = let(r / 3)
    total = let(P + Q)
    k = let(let(1 - total) + 3 * let(middle**2))
    rest = let(let(2 * middle**2 - let(total + 2)) * middle + let(P - Q))
    positive = rest >= 0
    size = let(sp.Abs(rest))
    y = _start(terms, k, size)
    for _ in range(STEPS):
        y2 = let(y**2)
        y = let(let(2 * let(y2 * y) + size) / let(let(3 * y2 - k) + DIRECTION_FLOOR))
    y = select(terms, positive, y, -y)
    outer = let(middle + y)
    center = let(middle - HALF * y)
    discriminant = let(4 * k - 3 * let(y**2))
    spread = let(HALF * sp.sqrt(sp.Max(ZERO, discriminant, evaluate=False)))
    inner = let(center - select(terms, center >= 0, spread, -spread))
    tau = select(terms, sp.And(sp.Abs(outer) > OUTERMOST_ROOT, discriminant >= 0), inner, outer)
    straight = let(let(P - Q) / let(total + DIRECTION_FLOOR))
    return select(terms, total > NEARLY_LINEAR, straight, tau)


def _start(terms: Terms, k: sp.Expr, size: sp.Expr) -> sp.Expr:
    """Return a start value for the positive root of ``y^3 - k y = size``.

    If k > 0, the start value is larger than this root.
    """
    let = terms.let
    # The power size^(5/16) approximates the cube root of size, and a Halley step reduces the error
    # to a few percent.
    fourth = let(sp.sqrt(let(sp.sqrt(size))))
    b = let(fourth * let(sp.sqrt(let(sp.sqrt(fourth)))))
    b3 = let(b**3)
    b = let(b * let(b3 + 2 * size) / let(let(2 * b3 + size) + DIRECTION_FLOOR))
    b2 = let(b**2)
    above = let(sp.sqrt(let(sp.Max(k, ZERO, evaluate=False) + b2)))
    return select(terms, k > 0, above, let(size / let(let(b2 - k) + DIRECTION_FLOOR)))


def _on_lines(
    terms: Terms,
    conic: Conic,
    t: sp.Expr,
    swap: Boolean,
    signs: tuple[sp.Expr, sp.Expr],
    separation: sp.Expr,
) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return the intersection (x, y) of the unit circle with one of the lines, and its margin."""
    let = terms.let
    g, p, q = conic.g, conic.p, conic.q
    alpha2 = let(g * t)
    alpha, beta = let(sp.sqrt(alpha2)), let(sp.sqrt(let(g * let(2 - t))))
    product = let(let(conic.r + g) - alpha2)
    difference = let(q / beta)
    square = let(difference**2 + 4 * product)
    by_product = let(sp.sqrt(sp.Max(ZERO, square, evaluate=False)))
    size = let(sp.Abs(p))
    total = select(
        terms,
        sp.And(alpha2 > size, t > MIN_T),
        let(size / let(alpha + DIRECTION_FLOOR)),
        by_product,
    )
    # The offset of the line farther from the origin has the sign of p.
    positive = p >= 0
    of_p = select(terms, positive, ONE, -ONE)
    of_q = select(terms, difference >= 0, ONE, -ONE)
    side = let(of_p * of_q)
    spread = let(sp.Abs(difference))
    far = let(HALF * let(total + spread))
    w = let(sp.sqrt(let(2 * g)))
    near = select(
        terms, far > w, let(product / let(far + DIRECTION_FLOOR)), let(HALF * let(total - spread))
    )
    # The two lines intersect outside the unit circle. Inside the circle, one line is entirely above
    # or entirely to the right of the other line. Therefore, one coordinate (y or x) of a root shows
    # on which of the two lines the root lies.
    above = let(size * let(2 - t)) >= let(sp.Abs(q) * t)
    by_y = select(terms, swap, select(terms, above, ONE, ZERO), select(terms, above, ZERO, ONE))
    label = select(terms, by_y > HALF, let(signs[0] * signs[1]), signs[0])
    label = select(terms, above, let(-label * of_q), let(label * of_p))
    is_near = label > 0
    offset, other = select(terms, is_near, near, far), select(terms, is_near, far, near)
    u = alpha
    v = let(label * side * beta)
    # At a root, the polynomial and the product of the two line expressions change sign in the same
    # direction.
    beyond = let(of_p * let(other + offset * let(1 - t)))
    sense = let(signs[1] * select(terms, beyond >= 0, ONE, -ONE))
    other = let(sp.Abs(other))
    size = let(sp.Abs(offset))
    short = let(w - size)
    xi2 = let(short * let(w + size))
    xi = let(
        sense * select(terms, xi2 > let(2 * MEETING_ROOTS * g), sp.sqrt(xi2), let(separation * w))
    )
    offset = select(terms, positive, offset, -offset)
    scale = let(1 / let(w * sp.Max(w, size, evaluate=False)))
    x = let(-let(offset * u + xi * v) * scale)
    y = let(let(xi * u - offset * v) * scale)
    return x, y, let(short * sp.Max(w, other, evaluate=False))
