"""A planar platform on three rods: all its poses, by one polynomial in its angle (a triad).

Rods of lengths L_i join known points A_i to pins b_i of the platform, whose pose is (x, y, phi).
With the vector w of the first rod, from A_1 to its pin, and R the rotation by phi,

    u_i = R (b_i - b_1) - (A_i - A_1)                        from the first rod to the others
    |w|^2 = L_1^2,   |w + u_i|^2 = L_i^2,   i = 2, 3

The first subtracted from the others leaves two equations linear in w,

    w . u_i = k_i,   k_i = (L_i^2 - L_1^2 - |u_i|^2) / 2

whose solution w = J (k_3 u_2 - k_2 u_3) / (u_2 x u_3), J the quarter turn, put into the first
gives

    k_2^2 |u_3|^2 - 2 k_2 k_3 u_2 . u_3 + k_3^2 |u_2|^2 = L_1^2 (u_2 x u_3)^2

Every factor, |u_i|^2 and u_2 . u_3 too, is of degree 1 in cos(phi), sin(phi), for R leaves lengths
and scalar products as they are: the degree is 3, though k_3 u_2 - k_2 u_3 is of degree 2. With
exp(i phi) as the unknown it is a polynomial of degree 6: at most six assembly modes.

Source:
    Gosselin, Sefrioui and Richard 1992; Hunt 1983. The elimination is written out here so that the
    degree shows.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import sympy as sp

from ..terms.terms import Terms
from .planar.loop_step import PLANE, Cross, Dot, half
from .planar.phasors import ZERO, Complex, conjugate, cross, dot, minus, product

Harmonics = tuple[Complex, ...]
"""A real trigonometric polynomial: c_0 + Re(c_1 exp(i phi) + c_2 exp(2 i phi) ...), c_0 real."""
HALF = sp.Rational(1, 2)
LEGS = 3
Named = tuple[sp.Symbol, sp.Expr]


@dataclass(frozen=True)
class Triad:
    """Three rods that hold a platform in a plane.

    Attributes:
        A: The rods' known ends (x, y), metre.
        b: Their ends on the platform, in the platform's axes, metre.
        L: Their lengths, metre.
    """

    A: tuple[Complex, ...]
    b: tuple[Complex, ...]
    L: tuple[sp.Expr, ...]


@dataclass(frozen=True)
class Elimination:
    """The elimination of the platform's position as equations to read.

    Attributes:
        u: Components of u_2 and u_3, each with its name.
        norms: Their lengths, in the components of u.
        k: The right sides of the linear pair, in the lengths.
        w: Symbols of the first rod's components.
        position: x and y of the platform in w.
        scale: The squared length by whose third power the polynomial is divided.
        linear: The left sides of the linear pair, between vectors.
        solution: The first rod w that solves the linear pair.
        polynomial: Both sides of the remaining equation in phi.
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
    """The equations of the triad in given symbols.

    Args:
        A: Three known points (x, y), metre.
        b: Three pins in the platform's axes, metre.
        L: Three lengths of rods, metre.
        phi: The platform's angle.
        name: Gives the symbol of ``w``, ``u``, ``|u|``, ``k``, ``l`` or ``J`` by an index: the
            rod's number, or an axis, or both.
    """
    turn = sp.cos(phi), sp.sin(phi)
    sides = [minus(other, b[0]) for other in b[1:]]
    u, norms, k = [], [], []
    for i, (side, at, length) in enumerate(zip(sides, A[1:], L[1:], strict=True), 2):
        parts = minus(product(side, turn), minus(at, A[0]))
        names = [name("u", f"{i}{axis}") for axis in PLANE]
        u.append(tuple(zip(names, map(sp.expand, parts), strict=True)))
        norms.append((name("|u|", f"{i}"), sp.sqrt(sp.Add(*(part**2 for part in names)))))
        gap = length**2 - L[0] ** 2 - norms[-1][0] ** 2
        k.append((name("k", f"{i}"), half(gap) if gap.is_Add else HALF * gap))
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


def triad_polynomial(
    terms: Terms, A: Sequence[Complex], b: Sequence[Complex], L: Sequence[sp.Expr]
) -> tuple[sp.Expr, ...]:
    """The trigonometric polynomial whose zeros are the platform's angles in all assembly modes.

    a_0 + sum_k (a_k cos(k phi) + b_k sin(k phi)) = 0, k = 1, 2, 3. Squares of lengths are measured
    in the mean square of the rods and that of the platform's sides together, so that coefficients
    are of order 1. It vanishes altogether where the three rods can stay parallel.

    Args:
        terms: Names of all terms.
        A: Three known points (x, y), metre.
        b: Three pins in the platform's axes, metre; constants.
        L: Three lengths of rods, metre.

    Returns:
        a_0, a_1, b_1, a_2, b_2, a_3, b_3, named.
    """
    triad = _Triad(terms, A, b, L)
    (k2, k3), (s2, s3) = triad.half_gaps, triad.squares
    k2k2, k2k3, k3k3 = (_times(terms, *pair) for pair in ((k2, k2), (k2, k3), (k3, k3)))
    parts = [
        _times(terms, k2k2, s3),
        _scaled(_times(terms, k2k3, triad.scalar), sp.Integer(-2)),
        _times(terms, k3k3, s2),
        _scaled(_times(terms, triad.area, triad.area), -triad.L1_squared),
    ]
    scale = terms.let(triad.length_squared ** (-LEGS))
    found = [
        (terms.let(scale * terms.let(re)), terms.let(scale * terms.let(im)))
        for re, im in _sum(*parts)
    ]
    return (found[0][0], *(entry for re, im in found[1:] for entry in (re, terms.let(-im))))


def triad_position(
    terms: Terms,
    A: Sequence[Complex],
    b: Sequence[Complex],
    L: Sequence[sp.Expr],
    c: sp.Expr,
    s: sp.Expr,
) -> Complex:
    """The platform's position at an angle that is a zero of the polynomial.

    The first rod's component along the longer u of u_2 and u_3 is k / |u|; the component across u
    follows from the rod's length. Both are well determined where u_2 and u_3 are parallel and the
    linear pair is singular. The third circle selects the side. Where the three centres lie on one
    line both sides are solutions; this function gives the first and :func:`triad_mirror` the
    second. Where the centres coincide there is no position (NaN).

    Args:
        terms: Names of all terms.
        A: Three known points (x, y), metre.
        b: Three pins in the platform's axes, metre; constants.
        L: Three lengths of rods, metre.
        c: Cosine of the platform's angle.
        s: Its sine.

    Returns:
        x and y, named. At an angle that is no zero, a position near the first two circles.
    """
    return _Triad(terms, A, b, L).position(c, s, sp.S.One)


def triad_mirror(
    terms: Terms,
    A: Sequence[Complex],
    b: Sequence[Complex],
    L: Sequence[sp.Expr],
    c: sp.Expr,
    s: sp.Expr,
) -> Complex:
    """The mirror image of :func:`triad_position` in the line of two centres.

    It is a second solution where the centres lie on one line, and a start for the iteration near a
    double zero.
    """
    return _Triad(terms, A, b, L).position(c, s, sp.S.NegativeOne)


class _Triad:
    """The factors of the polynomial."""

    def __init__(
        self, terms: Terms, A: Sequence[Complex], b: Sequence[Complex], L: Sequence[sp.Expr]
    ) -> None:
        self.terms = terms
        self.origin, self.pin = A[0], b[0]
        self.sides = [self._named(minus(other, b[0])) for other in b[1:]]
        self.gaps = [self._named(minus(other, A[0])) for other in A[1:]]
        self.L1_squared = terms.let(L[0] ** 2)
        self.rises = [terms.let(sp.expand(length**2 - L[0] ** 2)) for length in L[1:]]
        third = minus(self.sides[1], self.sides[0])
        squares = [dot(side, side) for side in (*self.sides, third)]
        self.length_squared = terms.let(sp.Add(*squares, *(length**2 for length in L)) / LEGS)
        self.squares = [
            self._product(side, gap, side, gap)
            for side, gap in zip(self.sides, self.gaps, strict=True)
        ]
        self.half_gaps = [
            self._linear(HALF * (rise - u[0][0]), _scaled(u, -HALF)[1])
            for rise, u in zip(self.rises, self.squares, strict=True)
        ]
        (b2, b3), (a2, a3) = self.sides, self.gaps
        self.scalar = self._product(b2, a2, b3, a3)
        # u_2 x u_3 = (J u_2) . u_3, and J and R may be exchanged.
        self.area = self._product(_quarter_turned(b2), _quarter_turned(a2), b3, a3)

    def position(self, c: sp.Expr, s: sp.Expr, side: sp.Expr) -> Complex:
        terms = self.terms
        turned = [self._named(product(b, (c, s))) for b in self.sides]
        u = [self._named(minus(t, a)) for t, a in zip(turned, self.gaps, strict=True)]
        n = [terms.let(dot(v, v)) for v in u]
        k = [terms.let(HALF * (rise - square)) for rise, square in zip(self.rises, n, strict=True)]
        longer = sp.Ge(n[0], n[1])
        n1 = self._chosen(longer, *n)
        k1, k2 = self._chosen(longer, *k), self._chosen(longer, *k[::-1])
        x, y = (self._chosen(longer, u[0][axis], u[1][axis]) for axis in range(2))
        area = terms.let(cross(*u))
        along = terms.let(k1 / n1)
        linear = terms.let((k2 - along * terms.let(dot(*u))) * self._chosen(longer, area, -area))
        left = terms.let(sp.Max(ZERO, self.L1_squared / n1 - along**2))
        across = terms.let(sp.sqrt(left))
        across = terms.let(side * self._chosen(sp.Ge(linear, 0), across, -across))
        wx, wy = terms.let(along * x - across * y), terms.let(along * y + across * x)
        px, py = self._named(product(self.pin, (c, s)))
        return (
            terms.let(self.origin[0] + wx - px),
            terms.let(self.origin[1] + wy - py),
        )

    def _chosen(self, condition: sp.Expr, one: sp.Expr, other: sp.Expr) -> sp.Expr:
        return self.terms.let(sp.Piecewise((one, condition), (other, True)))

    def _named(self, vector: Complex) -> Complex:
        return self.terms.let(vector[0]), self.terms.let(vector[1])

    def _linear(self, constant: sp.Expr, first: Complex) -> Harmonics:
        return (self.terms.let(constant), ZERO), self._named(first)

    def _product(self, b: Complex, a: Complex, d: Complex, e: Complex) -> Harmonics:
        """(R b - a) . (R d - e) = b . d + a . e - Re(exp(i phi) (b conj(e) + d conj(a)))."""
        be, da = product(b, conjugate(e)), product(d, conjugate(a))
        return self._linear(dot(b, d) + dot(a, e), (-be[0] - da[0], -be[1] - da[1]))


def _quarter_turned(vector: Complex) -> Complex:
    return -vector[1], vector[0]


def _scaled(f: Harmonics, factor: sp.Expr) -> Harmonics:
    return tuple((factor * re, factor * im) for re, im in f)


def _times(terms: Terms, f: Harmonics, g: Harmonics) -> Harmonics:
    """Re(a) Re(b) = Re(a b + a conj(b)) / 2, harmonic by harmonic, named."""
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
                # Only the real part of the constant term counts.
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
