"""Finds all poses of a planar platform on three rods (triad) with a polynomial in its angle.

Rods of lengths L_i connect known points A_i to pins b_i of the platform. The platform pose is (x,
y, phi). The vector w is the first rod, from A_1 to its pin, and R is the rotation by phi. For i = 2
and 3, the vector of rod i is w + u_i with u_i = R (b_i - b_1) - (A_i - A_1). The rod lengths give
three quadratic equations in w and phi.

    |w|^2 = L_1^2,   |w + u_i|^2 = L_i^2.

Subtracting |w|^2 = L_1^2 from the other two rod equations gives two linear equations in w.

    w . u_i = k_i,   k_i = (L_i^2 - L_1^2 - |u_i|^2) / 2

The two linear equations have the solution w = J (k_3 u_2 - k_2 u_3) / (u_2 x u_3). The matrix J
rotates a vector by 90 degrees counterclockwise. Inserting the solution w into |w|^2 = L_1^2 gives a
polynomial equation for the platform angle phi.

    k_2^2 |u_3|^2 - 2 k_2 k_3 u_2 . u_3 + k_3^2 |u_2|^2 = L_1^2 (u_2 x u_3)^2

Every factor of the polynomial equation has degree 1 in cos(phi) and sin(phi). The products |u_i|^2,
u_2 . u_3 and u_2 x u_3 have degree 1 too, because rotations preserve scalar and cross products.
Each term has at most three factors of degree 1, so the polynomial has degree 3 in cos(phi) and
sin(phi). In exp(i phi), the polynomial has degree 6, so there are at most six assembly modes.

A leg with a prismatic joint gives a line instead of a circle: n_i . (w + u_i) = 0. The unit normal
n_i of the line is constant or rotates with the platform. For a leg with a prismatic joint, n_i
replaces u_i in the two linear equations and in the polynomial, and k_i becomes -n_i . u_i.
Prismatic joints do not increase the degree of the polynomial. If all three legs have a prismatic
joint, the equation for phi contains no rod lengths.

    k_2 (n_3 x n_1) + k_3 (n_1 x n_2) = 0

Source: Gosselin, Sefrioui and Richard 1992; Hunt 1983; Merlet, Direct kinematics of planar parallel
manipulators, 1996. The elimination in this module shows why the polynomial has degree 3 in cos(phi)
and sin(phi).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import sympy as sp

from ...terms.terms import Terms
from ..model.phasors import ZERO, Complex, conjugate, cross, dot, minus, product
from ..planar.loop_step import PLANE, Cross, Dot, half

Harmonics = tuple[Complex, ...]
"""Trigonometric polynomial c_0 + Re(c_1 exp(i phi) + c_2 exp(2 i phi) ...) with a real c_0."""
HALF = sp.Rational(1, 2)
LEGS = 3
_UNIT: Harmonics = ((sp.S.One, ZERO), (ZERO, ZERO))
Named = tuple[sp.Symbol, sp.Expr]


@dataclass(frozen=True)
class LegLine:
    """The line to which a leg constrains a point.

    Attributes:
        normal: The unit normal of the line.
        turns: Whether line and normal rotate with the platform.
    """

    normal: Complex
    turns: bool


@dataclass(frozen=True)
class Triad:
    """Three legs of a planar platform.

    The legs with rods precede the legs with lines.

    Attributes:
        A: Fixed points (x, y), meter. Each fixed point is a rod end, a point of a fixed line, or a
            point through which a line of the platform passes.
        b: One platform point (x, y) of each leg, in platform axes, meter.
        L: The rod lengths, meter.
        lines: The line of each leg that is not a rod.
    """

    A: tuple[Complex, ...]
    b: tuple[Complex, ...]
    L: tuple[sp.Expr, ...]
    lines: tuple[LegLine, ...] = ()


@dataclass(frozen=True)
class Elimination:
    """Equations that eliminate the platform position, as printed in the LaTeX article.

    Attributes:
        u: Symbols and values of the components of the vectors u_2 and u_3.
        norms: The norms of the vectors u_2 and u_3, as functions of the vector components.
        k: The right-hand sides of the two linear equations in w, as functions of the lengths.
        w: Symbols of the components of w, the vector of the first rod.
        position: Coordinates x and y of the platform as functions of the vector w.
        scale: Squared length. The polynomial in the platform angle is divided by the cube of
            ``scale``.
        linear: The left-hand sides of the two linear equations in w.
        solution: The vector w that solves the two linear equations.
        polynomial: Both sides of the polynomial equation for the platform angle phi.
    """

    u: tuple[tuple[Named, ...], ...]
    norms: tuple[Named, ...]
    k: tuple[Named, ...]
    w: Complex
    position: tuple[sp.Expr, ...]
    scale: sp.Expr
    linear: tuple[sp.Expr, ...]
    solution: sp.Expr
    polynomial: tuple[sp.Expr, sp.Expr]


def elimination(
    A: Sequence[Complex],
    b: Sequence[Complex],
    L: Sequence[sp.Expr],
    phi: sp.Expr,
    name: Callable[[str, str], sp.Symbol],
) -> Elimination:
    """Return the equations of three planar rods, in the symbols that ``name`` returns.

    Args:
        A: Three fixed points (x, y), meter.
        b: Three pins in platform axes, meter.
        L: Three rod lengths, meter.
        phi: The platform's angle.
        name: Function that returns the symbol of a letter (``w``, ``u``, ``|u|``, ``k``, ``l`` or
            ``J``) with an index.
    """
    turn = sp.cos(phi), sp.sin(phi)
    sides = [minus(other, b[0]) for other in b[1:]]
    u, norms, k = [], [], []
    for i, (side, at, length) in enumerate(zip(sides, A[1:], L[1:], strict=True), 2):
        parts = minus(product(side, turn), minus(at, A[0]))
        names = [name("u", f"{i}{axis}") for axis in PLANE]
        u.append(tuple(zip(names, map(sp.expand, parts), strict=True)))
        norms.append((name("|u|", f"{i}"), sp.sqrt(sp.Add(*(part**2 for part in names)))))
        constant = length**2 - L[0] ** 2 - norms[-1][0] ** 2
        k.append((name("k", f"{i}"), half(constant) if constant.is_Add else HALF * constant))
    w = name("w", "x"), name("w", "y")
    ends = zip(A[0], w, product(b[0], turn), strict=True)
    squares = [dot(side, side) for side in (*sides, minus(sides[1], sides[0]))]
    (n2, n3), (k2, k3) = ([symbol for symbol, _ in pairs] for pairs in (norms, k))
    u2, u3 = name("u", "2"), name("u", "3")
    area = Cross(u2, u3)
    return Elimination(
        u=tuple(u),
        norms=tuple(norms),
        k=tuple(k),
        w=w,
        position=tuple(sp.expand(a + rod - pin) for a, rod, pin in ends),
        scale=sp.expand(sp.Add(*squares, *(length**2 for length in L)) / LEGS),
        linear=(Dot(name("w", ""), u2), Dot(name("w", ""), u3)),
        solution=name("J", "") * (k3 * u2 - k2 * u3) / area,
        polynomial=(
            k2**2 * n3**2 - 2 * k2 * k3 * Dot(u2, u3) + k3**2 * n2**2,
            name("l", "1") ** 2 * area**2,
        ),
    )


def triad_polynomial(terms: Terms, triad: Triad) -> tuple[sp.Expr, ...]:
    """Return the trigonometric polynomial with the platform angles of all assembly modes as zeros.

    a_0 + sum_k (a_k cos(k phi) + b_k sin(k phi)) = 0, k = 1, 2, 3. Squared lengths are divided by a
    mean square length, so the polynomial coefficients are about 1. The mean square length includes
    the rods and the platform sides. If leg ends move on lines, the mean square length also includes
    the distances from A_1 to the base points A_i of these legs. The polynomial is zero at all
    angles if the three rods can stay parallel.

    Args:
        terms: Receives the terms.
        triad: The legs.

    Returns:
        The coefficients a_0, a_1, b_1, a_2, b_2, a_3, b_3 of the trigonometric polynomial, as named
        terms.
    """
    factors = _Factors(terms, triad)
    scale = terms.let(factors.length_squared ** sp.Rational(-factors.degree, 2))
    found = [
        (terms.let(scale * terms.let(re)), terms.let(scale * terms.let(im)))
        for re, im in _sum(*(factors.of_circle() if triad.L else factors.of_lines()))
    ]
    found += [(ZERO, ZERO)] * (LEGS + 1 - len(found))
    return (found[0][0], *(entry for re, im in found[1:] for entry in (re, terms.let(-im))))


def triad_position(terms: Terms, triad: Triad, c: sp.Expr, s: sp.Expr) -> Complex:
    """Return the position of the platform at an angle that is a zero of the assembly polynomial.

    If the centers of the three circles coincide, the position is NaN. Let u be the longer of u_2
    and u_3, and w . u = k its linear equation for the first rod w. The component of the first rod
    along u is k / |u|. The component of the first rod orthogonal to u follows from the rod length.
    Both components of the first rod are accurate even if u_2 and u_3 are parallel. The third circle
    determines the sign of the component orthogonal to u. If the centers of the three circles are
    collinear, both signs of the orthogonal component are solutions. If leg ends move on lines, u is
    the normal of the last line. If there are three lines, the two lines that are closest to
    perpendicular determine the position.

    Args:
        terms: Receives the terms.
        triad: The legs.
        c: Cosine of the platform angle.
        s: Sine of the platform angle.

    Returns:
        Coordinates x and y of the platform as named terms. At an angle that is not a zero of the
        polynomial, the position is near the intersections of the first two circles.
    """
    return _Factors(terms, triad).position(c, s, sp.S.One)


def triad_mirror(terms: Terms, triad: Triad, c: sp.Expr, s: sp.Expr) -> Complex:
    """Reflect the result of ``triad_position`` in the line through two circle centers.

    If the centers of the circles are collinear, the mirror image is a second solution.
    """
    return _Factors(terms, triad).position(c, s, sp.S.NegativeOne)


def leg_residuals(terms: Terms, triad: Triad, theta: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Return the residual (meter) of the circle or line equation of each leg at pose x, y, phi."""
    x, y, phi = theta
    turn = terms.cos_sin(phi)
    rods = len(triad.L)
    found = []
    for i, (A, b) in enumerate(zip(triad.A, triad.b, strict=True)):
        pin = product(b, turn)
        d = terms.let(x + pin[0] - A[0]), terms.let(y + pin[1] - A[1])
        if i < rods:
            found.append(terms.let(terms.let(sp.sqrt(terms.let(dot(d, d)))) - triad.L[i]))
            continue
        line = triad.lines[i - rods]
        found.append(terms.let(dot(product(line.normal, turn) if line.turns else line.normal, d)))
    return found


class _Factors:
    """The factors of the assembly polynomial of three planar legs.

    A vector R t - f with the platform rotation R is stored as the pair (t, f) of constant vectors.
    The vector t is given in platform axes, and f in base axes.
    """

    def __init__(self, terms: Terms, triad: Triad) -> None:
        self.terms = terms
        A, b, L = triad.A, triad.b, triad.L
        self.origin, self.pin, self.rods = A[0], b[0], len(L)
        others = max(0, self.rods - 1)
        self.sides = [self._named(minus(other, b[0])) for other in b[1:]]
        self.base_vectors = [self._named(minus(other, A[0])) for other in A[1:]]
        self.L1_squared = terms.let(L[0] ** 2) if L else ZERO
        self.rises = [terms.let(sp.expand(length**2 - L[0] ** 2)) for length in L[1:]]
        third = minus(self.sides[1], self.sides[0])
        squares = [dot(side, side) for side in (*self.sides, third)]
        squares += [length**2 for length in L]
        squares += [dot(v, v) for v in self.base_vectors[others:]]
        self.length_squared = terms.let(sp.Add(*squares) / LEGS)
        normals = [_as_pair(line) for line in triad.lines]
        self.first = None if L else normals[0]
        u = list(zip(self.sides, self.base_vectors, strict=True))
        self.w = [*u[:others], *(normals if L else normals[1:])]
        self.squares = [
            self._product(*pair, *pair) if self._is_rod(i) else _UNIT
            for i, pair in enumerate(self.w)
        ]
        self.half_constants = [
            self._linear(HALF * (self.rises[i] - square[0][0]), _scaled(square, -HALF)[1])
            if self._is_rod(i)
            else _scaled(self._product(*w, *pair), sp.S.NegativeOne)
            for i, (w, pair, square) in enumerate(zip(self.w, u, self.squares, strict=True))
        ]
        self.scalar = self._product(*self.w[0], *self.w[1])
        self.area = self._area(*self.w)

    @property
    def degree(self) -> int:
        """Return the degree of the assembly polynomial as a polynomial in the lengths."""
        return 2 * self.rods if self.rods else 1

    def of_circle(self) -> list[Harmonics]:
        """Return the summands of the assembly polynomial if the first leg is a rod."""
        terms, (k2, k3), (s2, s3) = self.terms, self.half_constants, self.squares
        k2k2, k2k3, k3k3 = (_times(terms, *pair) for pair in ((k2, k2), (k2, k3), (k3, k3)))
        return [
            _times(terms, k2k2, s3),
            _scaled(_times(terms, k2k3, self.scalar), sp.Integer(-2)),
            _times(terms, k3k3, s2),
            _scaled(_times(terms, self.area, self.area), -self.L1_squared),
        ]

    def of_lines(self) -> list[Harmonics]:
        """Return the summands of the assembly polynomial for legs that keep points on lines."""
        assert self.first is not None
        (k2, k3), (n2, n3) = self.half_constants, self.w
        return [
            _times(self.terms, k2, self._area(n3, self.first)),
            _times(self.terms, k3, self._area(self.first, n2)),
        ]

    def position(self, c: sp.Expr, s: sp.Expr, side: sp.Expr) -> Complex:
        terms = self.terms
        u = [self._at(pair, (c, s)) for pair in zip(self.sides, self.base_vectors, strict=True)]
        w = [
            self._at(pair, (c, s)) if not self._is_rod(i) else u[i] for i, pair in enumerate(self.w)
        ]
        n = [terms.let(dot(v, v)) if self._is_rod(i) else sp.S.One for i, v in enumerate(w)]
        k = [
            terms.let(HALF * (self.rises[i] - n[i]))
            if self._is_rod(i)
            else terms.let(-dot(w[i], u[i]))
            for i in range(2)
        ]
        wx, wy = self._crossing(c, s, w, k) if self.first else self._on_circle(w, n, k, side)
        px, py = self._named(product(self.pin, (c, s)))
        return (
            terms.let(self.origin[0] + wx - px),
            terms.let(self.origin[1] + wy - py),
        )

    def _on_circle(
        self, w: Sequence[Complex], n: Sequence[sp.Expr], k: Sequence[sp.Expr], side: sp.Expr
    ) -> Complex:
        """Return the vector of the first rod from its length and its component along a vector."""
        terms = self.terms
        longer = sp.Ge(n[0], n[1]) if len(self.rises) == len(w) else sp.false
        n1 = self._chosen(longer, *n)
        k1, k2 = self._chosen(longer, *k), self._chosen(longer, *k[::-1])
        x, y = (self._chosen(longer, w[0][axis], w[1][axis]) for axis in range(2))
        area = terms.let(cross(*w))
        along = terms.let(k1 / n1)
        linear = terms.let((k2 - along * terms.let(dot(*w))) * self._chosen(longer, area, -area))
        left = terms.let(sp.Max(ZERO, self.L1_squared / n1 - along**2))
        across = terms.let(sp.sqrt(left))
        across = terms.let(side * self._chosen(sp.Ge(linear, 0), across, -across))
        return terms.let(along * x - across * y), terms.let(along * y + across * x)

    def _crossing(
        self, c: sp.Expr, s: sp.Expr, w: Sequence[Complex], k: Sequence[sp.Expr]
    ) -> Complex:
        """Return the intersection of two of the three leg lines.

        Of the three pairs of lines, the function selects the pair whose normals have the largest
        cross product (in magnitude).
        """
        terms = self.terms
        assert self.first is not None
        n = [self._at(self.first, (c, s)), *w]
        known = [ZERO, *k]
        found, sizes = [], []
        for i, j in ((0, 1), (1, 2), (2, 0)):
            area = terms.let(cross(n[i], n[j]))
            x = terms.let((known[i] * n[j][1] - known[j] * n[i][1]) / area)
            y = terms.let((known[j] * n[i][0] - known[i] * n[j][0]) / area)
            found.append((x, y))
            sizes.append(terms.let(area**2))
        is_first = sp.And(sp.Ge(sizes[0], sizes[1]), sp.Ge(sizes[0], sizes[2]))
        later = [
            self._chosen(sp.Ge(sizes[1], sizes[2]), found[1][axis], found[2][axis])
            for axis in range(2)
        ]
        x, y = (self._chosen(is_first, *pair) for pair in zip(found[0], later, strict=True))
        return x, y

    def _is_rod(self, i: int) -> bool:
        """Whether leg ``i`` is a rod.

        Index 0 is the second leg, and index 1 is the third leg.
        """
        return i < len(self.rises)

    def _at(self, pair: tuple[Complex, Complex], turn: Complex) -> Complex:
        """Return the vector R t - f of a pair (t, f) for a platform rotation R."""
        return self._named(minus(self._named(product(pair[0], turn)), pair[1]))

    def _area(self, w: tuple[Complex, Complex], v: tuple[Complex, Complex]) -> Harmonics:
        # Let J be the rotation by 90 degrees. Then the cross product w x v is (J w) . v, and J
        # commutes with the platform rotation.
        return self._product(_quarter_turned(w[0]), _quarter_turned(w[1]), *v)

    def _chosen(self, condition: sp.Expr, one: sp.Expr, other: sp.Expr) -> sp.Expr:
        return self.terms.let(sp.Piecewise((one, condition), (other, True)))

    def _named(self, vector: Complex) -> Complex:
        return self.terms.let(vector[0]), self.terms.let(vector[1])

    def _linear(self, constant: sp.Expr, first: Complex) -> Harmonics:
        return (self.terms.let(constant), ZERO), self._named(first)

    def _product(self, b: Complex, a: Complex, d: Complex, e: Complex) -> Harmonics:
        """Return the scalar product of R b - a and R d - e.

        The scalar product is b . d + a . e - Re(exp(i phi) (b conj(e) + d conj(a))).
        """
        be, da = product(b, conjugate(e)), product(d, conjugate(a))
        return self._linear(dot(b, d) + dot(a, e), (-be[0] - da[0], -be[1] - da[1]))


def _as_pair(line: LegLine) -> tuple[Complex, Complex]:
    """Return (normal, 0) if the line rotates with the platform, otherwise (0, -normal)."""
    x, y = line.normal
    return ((x, y), (ZERO, ZERO)) if line.turns else ((ZERO, ZERO), (-x, -y))


def _quarter_turned(vector: Complex) -> Complex:
    return -vector[1], vector[0]


def _scaled(f: Harmonics, factor: sp.Expr) -> Harmonics:
    return tuple((factor * re, factor * im) for re, im in f)


def _times(terms: Terms, f: Harmonics, g: Harmonics) -> Harmonics:
    """Return the product of two trigonometric polynomials.

    For each pair of harmonics a and b, Re(a) Re(b) = Re(a b + a conj(b)) / 2.
    """
    sums = [[ZERO, ZERO] for _ in range(len(f) + len(g) - 1)]
    for j, a in enumerate(f):
        for k, b in enumerate(g):
            pairs = [(j + k, product(a, b))]
            if j and k:
                lower = product(a, conjugate(b)) if j >= k else product(b, conjugate(a))
                pairs.append((abs(j - k), lower))
            for order, (re, im) in pairs:
                weight = HALF if len(pairs) > 1 else sp.S.One
                sums[order][0] += weight * re
                # Only the real part of the constant term affects the polynomial.
                sums[order][1] += weight * im if order else ZERO
    return tuple((terms.let(re), terms.let(im)) for re, im in sums)


def _sum(*all_: Harmonics) -> Harmonics:
    orders = range(max(map(len, all_)))
    return tuple(
        (
            sp.Add(*(f[k][0] for f in all_ if k < len(f))),
            sp.Add(*(f[k][1] for f in all_ if k < len(f))),
        )
        for k in orders
    )
