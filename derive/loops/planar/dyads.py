"""Closed forms of the triangles that planar loops consist of.

Three rigid bodies, each held to the next by a pin or a slide, are rigid together. There are three
such triangles, whichever of the bodies stands still: three pins (two circles meet), two pins and a
slide (a circle meets a line), one pin and two slides (two lines meet). Dyads RRR, RRP, RPR, PRR and
PRP and the triangle of a cylinder are these three with another body at rest.

Source: Assur's groups of class II; Myszka, Machines and Mechanisms, ch. 4. The forms here have no
acos, and no difference of squares where the triangle is thin.
"""

from dataclasses import dataclass

import sympy as sp

from ...terms.tangents import LoopRate, Tangent
from ...terms.terms import Terms
from .phasors import ZERO, Complex, PhasorSum, conjugate, cross, dot, product

HALF = sp.Rational(1, 2)


@dataclass(frozen=True)
class Arm:
    """A vector that is fixed on a body but for known coordinates, with its common angle apart.

    Attributes:
        vector: Named components where the angle is zero.
        angle: The angle by which all of it turns on its body.
        square: Its length squared.
    """

    vector: Complex
    angle: sp.Expr
    square: sp.Expr


def arm(terms: Terms, total: PhasorSum) -> Arm:
    """A sum of turning vectors as one vector."""
    angle = total.common_angle()
    still = total.turned(-angle)
    x, y = still.coordinates(terms)
    if list(still.terms) in ([], [ZERO]):
        # Exact: the length of a strut squared is its square, not a root's.
        exact = still.terms.get(ZERO, (ZERO, ZERO))
        return Arm((x, y), angle, terms.let(sp.expand(dot(exact, exact))))
    return Arm((x, y), angle, terms.let(x * x + y * y))


@dataclass(frozen=True)
class TwoCircles:
    """Three pins: circles about the ends of D meet at the point C from its beginning.

    Attributes:
        C: From the beginning of D to the pin that both circles share, in D's axes.
        W: From the end of D to that pin, in D's axes.
        v: The same vector C on its own body.
        w: The same vector W on its own body.
        height: Twice the triangle's area, positive where C stands to the left of D.
        margin: sin^2 of the transmission angle; 0 at a dead point, below 0 out of reach.
    """

    C: Complex
    W: Complex
    D: Complex
    v: Arm
    w: Arm
    height: sp.Expr
    margin: sp.Expr


def two_circles(terms: Terms, v: Arm, w: Arm, D: Arm, sign: int) -> TwoCircles:
    """Where circles of radius |v| about the beginning of D and |w| about its end meet.

    With p = (d^2 + v^2 - w^2) / 2 and 4 h^2 = ((d + w)^2 - v^2)(v^2 - (d - w)^2):

        C = D (p + i h) / d^2,   W = C - D

    Args:
        terms: Names of all terms.
        v: The arm from the beginning of D.
        w: The arm from its end.
        D: The base.
        sign: 1 where C stands to the left of D, -1 to the right.
    """
    squares = v.square, w.square, D.square
    p = terms.let((D.square + v.square - w.square) * HALF)
    product_of_sums = terms.let(_heron(terms, *squares))
    h = terms.let(sign * HALF * sp.sqrt(product_of_sums))
    if terms.is_constant(D.vector[0]) and terms.is_constant(D.vector[1]):
        x, y = (terms.let(part / D.square) for part in D.vector)
        C = terms.let(x * p - y * h), terms.let(x * h + y * p)
    else:
        along, across = terms.let(p / D.square), terms.let(h / D.square)
        x, y = D.vector
        C = terms.let(x * along - y * across), terms.let(x * across + y * along)
    W = terms.let(C[0] - D.vector[0]), terms.let(C[1] - D.vector[1])
    margin = terms.let(product_of_sums / (4 * v.square * w.square))
    return TwoCircles(C, W, D.vector, v, w, h, margin)


def _heron(terms: Terms, *squares: sp.Expr) -> sp.Expr:
    """16 area^2 as a product in which the side that varies is alone: no digits cancel."""
    varying = sorted(squares, key=terms.is_constant)
    alone, a, b = varying
    side_a, side_b = (terms.let(sp.sqrt(square)) for square in (a, b))
    wide, narrow = terms.let((side_a + side_b) ** 2), terms.let((side_a - side_b) ** 2)
    return terms.let(wide - alone) * terms.let(alone - narrow)


def turn_of(terms: Terms, there: Complex, here: Arm) -> tuple[sp.Expr, sp.Expr]:
    """Cosine and sine of the turn that carries an arm to the same vector elsewhere."""
    re, im = product(there, conjugate(here.vector))
    return terms.let(_over(terms, re, here.square)), terms.let(_over(terms, im, here.square))


def _over(terms: Terms, numerator: sp.Expr, square: sp.Expr) -> sp.Expr:
    return terms.let(sp.expand(numerator)) / square


def rate_of_first(triangle: TwoCircles, c: sp.Expr, s: sp.Expr) -> LoopRate:
    """The rate of v's turn: h phi' = D' . W - (e^(i phi) v') . W + w' . w."""

    def rate(tangent: Tangent) -> sp.Expr:
        D, v, w = (_rates(tangent, vector) for vector in _moving(triangle))
        turned = product((c, s), v)
        top = dot(D, triangle.W) - dot(turned, triangle.W) + dot(w, triangle.w.vector)
        return tangent.terms.let(tangent.terms.let(top) / triangle.height)

    return rate


def rate_of_second(triangle: TwoCircles, c: sp.Expr, s: sp.Expr) -> LoopRate:
    """The rate of w's turn: h psi' = D' . C - v' . v + (e^(i psi) w') . C."""

    def rate(tangent: Tangent) -> sp.Expr:
        D, v, w = (_rates(tangent, vector) for vector in _moving(triangle))
        turned = product((c, s), w)
        top = dot(D, triangle.C) - dot(v, triangle.v.vector) + dot(turned, triangle.C)
        return tangent.terms.let(tangent.terms.let(top) / triangle.height)

    return rate


def _moving(triangle: TwoCircles) -> tuple[Complex, Complex, Complex]:
    return triangle.D, triangle.v.vector, triangle.w.vector


def _rates(tangent: Tangent, vector: Complex) -> Complex:
    return tangent.of(vector[0]), tangent.of(vector[1])


@dataclass(frozen=True)
class CircleAndLine:
    """Two pins and a slide: a point on a line is at a given distance from another point.

    Attributes:
        offset: From the one pin to the other where the travel is zero, in the line's axes.
        direction: Unit vector of the line.
        r: The same vector on the third body.
        travel: Along the line.
        vector: From the one pin to the other.
        margin: cos^2 of the angle between line and vector; 0 at a dead point, below 0 out of reach.
    """

    offset: Complex
    direction: Complex
    r: Arm
    travel: sp.Expr
    vector: Complex
    margin: sp.Expr


def circle_and_line(
    terms: Terms, offset: Complex, direction: Complex, r: Arm, sign: int
) -> CircleAndLine:
    """The travel t for which ``|offset + t direction| = |r|``.

    With n = direction x offset and m = direction . offset: t = -m + sign sqrt((|r| - n)(|r| + n)).

    Args:
        terms: Names of all terms.
        offset: From the one pin to the other where the travel is zero.
        direction: Unit vector of the slide.
        r: From the one pin to the other on the third body.
        sign: 1 for the greater travel, -1 for the smaller.
    """
    n = terms.let(sp.expand(cross(direction, offset)))
    m = terms.let(sp.expand(dot(direction, offset)))
    radius = terms.let(sp.sqrt(r.square))
    inside = r.square if n == 0 else terms.let(terms.let(radius - n) * terms.let(radius + n))
    along = terms.let(sign * sp.sqrt(inside))
    x = terms.let(direction[0] * along - direction[1] * n)
    y = terms.let(direction[1] * along + direction[0] * n)
    margin = sp.Integer(1) if n == 0 else terms.let(inside / r.square)
    return CircleAndLine(offset, direction, r, terms.let(along - m), (x, y), margin)


def rate_of_third(line: CircleAndLine) -> LoopRate:
    """The rate of the third body's turn: |r|^2 phi' = u x u' - r x r', u = offset + t direction."""

    def rate(tangent: Tangent) -> sp.Expr:
        let = tangent.terms.let
        along = tangent.of(line.travel)
        offset, r = _rates(tangent, line.offset), _rates(tangent, line.r.vector)
        u = let(offset[0] + along * line.direction[0]), let(offset[1] + along * line.direction[1])
        top = cross(line.vector, u) - cross(line.r.vector, r)
        return let(let(top) / line.r.square)

    return rate


def two_lines(terms: Terms, offset: Complex, e: Complex, f: Complex) -> tuple[sp.Expr, sp.Expr]:
    """The travels t and u for which ``t e + u f = offset``."""
    area = terms.let(sp.expand(cross(e, f)))
    t = terms.let(sp.expand(cross(offset, f))) / area
    u = terms.let(sp.expand(cross(e, offset))) / area
    return terms.let(t), terms.let(u)


def rate_of_direction(there: Complex, here: Arm) -> LoopRate:
    """The rate of the turn from one vector to another: a x a' / a^2 - b x b' / b^2."""

    def rate(tangent: Tangent) -> sp.Expr:
        let = tangent.terms.let
        a, b = _rates(tangent, there), _rates(tangent, here.vector)
        first = let(cross(there, a)) / let(dot(there, there))
        return let(first - let(cross(here.vector, b)) / here.square)

    return rate
