"""Factors polynomials in cosines and sines after a conversion to half-angle tangents.

A polynomial in half-angle tangents has a unique factorization. The factors are converted back to
cosines and sines of coordinate sums. A factor is expressed with sums of the angles of parallel axes
if the new expression is shorter.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy as sp
from sympy.simplify.fu import TR8, TR10i

from .screw_polynomials import Polynomial, ScrewRing

MAX_SUMMED = 12
"""Maximum number of terms of a polynomial that is converted to cosines and sines of angle sums."""
MAX_TERMS = 100
"""Maximum number of terms of a polynomial that is factored.

SymPy factors a polynomial with 100 terms in at most one second.
"""


@dataclass(frozen=True)
class Factored:
    """A polynomial as a product of factors.

    Attributes:
        constant: The factor that does not depend on coordinates.
        factors: The factors that contain cosines and sines of the coordinates, with their
            exponents.
    """

    constant: sp.Expr
    factors: tuple[tuple[sp.Expr, int], ...]


def factored(ring: ScrewRing, polynomial: Polynomial) -> Factored | None:
    """Return the factors of a polynomial in cosines and sines.

    Polynomials that are zero, too long or impossible to convert give None.
    """
    if polynomial == 0 or len(polynomial) > MAX_TERMS:
        return None
    parts = _Tangents(ring, polynomial).parts()
    if parts is None:
        return None
    constant, factors = sp.S.One, dict[sp.Expr, int]()
    for part, power in parts:
        if part.free_symbols & {*ring.q}:
            content, primitive = _without_content(part)
            if primitive.could_extract_minus_sign():
                content, primitive = -content, -primitive
            constant *= content**power
            factors[primitive] = factors.get(primitive, 0) + power
        else:
            constant *= part**power
    return Factored(constant, tuple(factors.items()))


def _without_content(part: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return (numeric factor, rest) of an expression."""
    content, primitive = part.primitive()
    root, rest = sp.factor_terms(primitive, radical=True).as_independent(
        *primitive.free_symbols, as_Add=False
    )
    return (content * root, sp.expand(rest)) if root != 1 else (content, primitive)


class _Tangents:
    """A polynomial in cosines and sines, written in half-angle tangents.

    Attributes:
        budget: Exponent of 1 + t^2 in the denominator for each coordinate, where t is the
            half-angle tangent of the coordinate.
        factors: Factors of the numerator, as polynomials in the half-angle tangents.
    """

    def __init__(self, ring: ScrewRing, polynomial: Polynomial) -> None:
        self.source, self.polynomial = ring, polynomial
        first, count = len(ring.constants), len(ring.q)
        cosines, sines = range(first, first + count), range(first + count, first + 2 * count)
        self.budget = [
            max(powers[c] + powers[s] for powers in polynomial)
            for c, s in zip(cosines, sines, strict=True)
        ]
        self.t = [sp.Dummy(f"t{k}") for k in range(count)]
        symbols = [*ring.constants, *ring.slides, *self.t]
        tangents = sp.ring(symbols, sp.QQ)[0]
        gens = dict(zip(symbols, tangents.gens, strict=True))
        numerator = tangents.zero
        for powers, factor in polynomial.items():
            term = tangents.ground_new(factor)
            for symbol, power in zip(ring.ring.symbols, powers, strict=True):
                if symbol in gens:
                    term *= gens[symbol] ** power
            for k, (c, s) in enumerate(zip(cosines, sines, strict=True)):
                t = gens[self.t[k]]
                term *= (1 - t**2) ** powers[c] * (2 * t) ** powers[s]
                term *= (1 + t**2) ** (self.budget[k] - powers[c] - powers[s])
            numerator += term
        content, found = numerator.factor_list()
        self.content = sp.Rational(int(content.numerator), int(content.denominator))
        self.factors = [f.as_expr() for f, power in found for _ in range(power)]

    def parts(self) -> list[tuple[sp.Expr, int]] | None:
        moving = [f for f in self.factors if f.free_symbols & {*self.t, *self.source.slides}]
        if len(moving) == 1 and len(self.polynomial) > 1:
            return self._whole()
        factors = self.factors
        for k, t in enumerate(self.t):
            factors = _paired(factors, t, self.budget[k])
        found: list[sp.Expr] = [self.content]
        left = list(self.budget)
        for factor in factors:
            degrees = [_half(_degree(factor, t)) for t in self.t]
            left = [a - b for a, b in zip(left, degrees, strict=True)]
            found.append(self._turned_back(factor, degrees))
        if any(power < 0 for power in left):
            return None
        for q, power in zip(self.source.q, left, strict=True):
            found += [(1 + sp.cos(q)) / 2] * power
        return [(part, found.count(part)) for part in dict.fromkeys(found)]

    def _whole(self) -> list[tuple[sp.Expr, int]]:
        source = self.source
        constants = [f for f in self.factors if not f.free_symbols & {*self.t, *source.slides}]
        left = self.polynomial
        for constant in constants:
            left = left.exquo(source.ring.from_expr(constant))
        shortest = _shortest(source, source.reduced(left))
        return [(shortest, 1), *((f.xreplace(source.meanings), 1) for f in constants)]

    def _turned_back(self, factor: sp.Expr, degrees: Sequence[int]) -> sp.Expr:
        source = self.source
        for t, q, half in zip(self.t, source.q, degrees, strict=True):
            if half == 0:
                continue
            c, s = sp.cos(q), sp.sin(q)
            terms = sp.Poly(factor, t).terms()
            factor = sp.Add(
                *(
                    coefficient
                    * ((1 - c) / 2) ** (power // 2)
                    * (s / 2) ** (power % 2)
                    * ((1 + c) / 2) ** (half - power // 2 - power % 2)
                    for (power,), coefficient in terms
                )
            )
            factor = sp.expand(factor)
        slides = dict(zip(source.slides, source.q, strict=True))
        factor = factor.xreplace(slides | source.meanings)
        summed = sp.expand(TR8(factor))
        return min((factor, summed), key=lambda form: len(sp.Add.make_args(form)))


def _shortest(ring: ScrewRing, polynomial: Polynomial) -> sp.Expr:
    forms = [ring.expression(polynomial, {})]
    if len(polynomial) <= MAX_SUMMED:
        forms += [sp.expand(TR8(forms[0])), *map(TR10i, (forms[0], ring.in_sines(polynomial)))]
    forms += (
        ring.expression(ring.reduced(form), {k: total})
        for k, total, form in _in_sums(ring, polynomial)
    )
    fewest = min(len(sp.Add.make_args(form)) for form in forms)
    short = [form for form in forms if len(sp.Add.make_args(form)) == fewest]
    return sp.expand(min(short, key=sp.count_ops) if len(short) > 1 else short[0])


def _in_sums(ring: ScrewRing, polynomial: Polynomial) -> Iterator[tuple[int, sp.Expr, Polynomial]]:
    """Yield polynomials with one angle replaced by a sum or difference of adjacent angles."""
    places = {symbol: k for k, symbol in enumerate(ring.ring.symbols)}
    gens = ring.ring.gens
    pairs = [(k, k + step) for k in range(len(ring.q)) for step in (-1, 1)]
    for k, other in pairs:
        if not 0 <= other < len(ring.q):
            continue
        at = [places[names[j]] for j in (k, other) for names in (ring.cosines, ring.sines)]
        if any(all(not powers[place] for powers in polynomial) for place in at):
            continue
        c, s, co, so = (gens[place] for place in at)
        for sign in (1, -1):
            parts = [(c, c * co + sign * s * so), (s, s * co - sign * c * so)]
            yield k, ring.q[k] + sign * ring.q[other], polynomial.compose(parts)


def _degree(factor: sp.Expr, t: sp.Symbol) -> int:
    return int(sp.degree(factor, t)) if t in factor.free_symbols else 0


def _half(degree: int) -> int:
    return -(-degree // 2)


def _paired(factors: list[sp.Expr], t: sp.Symbol, budget: int) -> list[sp.Expr]:
    """Multiply pairs of factors that have an odd degree in t = tan(q/2).

    Multiplication by cos(q/2)^2 converts a factor t = tan(q/2) to sin(q)/2.
    """
    odd = [f for f in factors if _degree(f, t) % 2 and f != t]
    alone = [f for f in factors if f == t]
    even = [f for f in factors if _degree(f, t) % 2 == 0]
    pairs = [sp.expand(a * b) for a, b in zip(odd[::2], odd[1::2], strict=False)]
    single = odd[len(odd) - len(odd) % 2 :]
    used = sum(_half(_degree(f, t)) for f in (*even, *pairs, *single, *alone))
    while used > budget and len(alone) > 1:
        pairs.append(t**2)
        alone = alone[2:]
        used -= 1
    if used > budget and alone and single:
        # The product of two factors with an odd degree in t = tan(q/2) has an even degree, so the
        # half angle drops out.
        return [*even, *pairs, sp.expand(single[0] * alone[0]), *alone[1:]]
    return [*even, *pairs, *single, *alone]
