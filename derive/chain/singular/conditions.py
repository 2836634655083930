"""Finds the singularity conditions of an arm as common zeros of factors of its Jacobian minors.

All Jacobian minors are 0 if a shared factor is 0, or if one factor of each minor is 0. A
singularity condition is a minimal set of factors whose common zeros make all Jacobian minors 0.
"""

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np
import sympy as sp

from ...model.tolerances import FACTORS_VANISH
from .factors import Factored

Condition = tuple[sp.Expr, ...]
"""A singularity condition: factors of Jacobian minors that are all 0 at the same configuration."""
MAX_TOGETHER = 3
"""Maximum number of factors in a singularity condition. More than three factors rarely have a
common zero."""
STARTS = 12
STEPS = 60
MIN_ZEROS = 6
"""A factor is dropped from a condition only if the search finds at least this number of common
zeros of the other factors."""
IMPLIED = 1e-4
"""Maximum absolute value of a factor that counts as 0. The tolerance is large, because a search
that stops at 1 + cos q = e leaves sin q at about sqrt(2 e)."""
SEED = 40


def conditions(
    minors: Sequence[Factored], q: Sequence[sp.Symbol], values: dict[sp.Symbol, sp.Expr]
) -> tuple[Condition, ...]:
    """Return the sets of factors that make all minors 0 in some reachable configuration.

    Args:
        minors: The maximal minors of a Jacobian, without minors that are 0 in every configuration.
        q: The coordinates.
        values: The values of all symbols other than coordinates.
    """
    products = [tuple(factor for factor, _ in minor.factors) for minor in minors]
    found: list[Condition] = []
    every = {part for condition in set(_vanishing(products, ())) for part in _reduced(condition)}
    for condition in sorted(every, key=lambda c: (len(c), str(c))):
        if any({*condition} >= set(other) for other in found):
            continue
        if _exists([factor.xreplace(values) for factor in condition], q):
            needed = _independent(condition, q, values)
            found = [other for other in found if not {*other} >= {*needed}]
            found.append(needed)
    return tuple(sorted(found, key=lambda c: (len(c), str(c))))


def _reduced(condition: Condition) -> Iterator[Condition]:
    for zero in condition:
        for factor in condition:
            if factor == zero:
                continue
            left = _where_zero(zero, (factor,))
            if left == (factor,):
                continue
            others = tuple(other for other in condition if other != factor)
            for part in (None,) if left is None else left:
                parts = others if part is None else (*others, part)
                yield from _reduced(tuple(sorted({*parts}, key=str)))
            return
    yield condition


def _independent(
    condition: Condition, q: Sequence[sp.Symbol], values: dict[sp.Symbol, sp.Expr]
) -> Condition:
    """Drop each factor that is 0 at all common zeros of the other factors.

    The longest factor is tested first.
    """
    kept = [*condition]
    for factor in sorted(condition, key=lambda f: (sp.count_ops(f), str(f)), reverse=True):
        others = [other for other in kept if other != factor]
        if not others:
            break
        function = sp.lambdify([list(q)], factor.xreplace(values), "numpy")
        zeros = roots([other.xreplace(values) for other in others], q, STARTS)
        sizes = [abs(float(function(x))) for x in zeros]
        if len(sizes) >= MIN_ZEROS and max(sizes) <= IMPLIED:
            kept = others
    return tuple(kept)


def _vanishing(products: Sequence[Condition], chosen: Condition) -> Iterator[Condition]:
    """Yield sets of factors whose zeros make every product zero."""
    if not products:
        yield tuple(sorted(chosen, key=str))
        return
    if len(chosen) == MAX_TOGETHER:
        return
    for factor in min(products, key=len):
        left = (_where_zero(factor, product) for product in products)
        yield from _vanishing(
            [product for product in left if product is not None], (*chosen, factor)
        )


def _where_zero(factor: sp.Expr, product: Condition) -> Condition | None:
    if factor in product:
        return None
    if not isinstance(factor, sp.cos | sp.sin):
        return product
    angle = factor.args[0]
    other = sp.sin(angle) if isinstance(factor, sp.cos) else sp.cos(angle)
    zero = [part.xreplace({factor: sp.S.Zero}) for part in product]
    if any(part == 0 for part in zero):
        return None
    parts = chain.from_iterable(_parts(part) for part in zero)
    # Sine and cosine of an angle are never 0 at the same time, so the factor `other` is omitted.
    return tuple(dict.fromkeys(part for part in parts if part != other))


def _parts(expression: sp.Expr) -> list[sp.Expr]:
    factors = sp.factor_terms(sp.expand(expression)).as_ordered_factors()
    bases = [f.base if f.is_Pow and f.exp.is_Integer else f for f in factors]
    return [base for base in bases if base.has(sp.cos, sp.sin) or base.is_Add]


def _exists(factors: Sequence[sp.Expr], q: Sequence[sp.Symbol]) -> bool:
    """Whether factors have a common zero.

    Newton's method with minimum-norm steps searches for a configuration at which all factors are 0.
    """
    return next(roots(factors, q, STARTS), None) is not None


def roots(
    factors: Sequence[sp.Expr], q: Sequence[sp.Symbol], starts: int
) -> Iterator[np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Yield configurations at which all factors are 0.

    The factors contain no symbols except q. The search starts at random configurations.
    """
    function = sp.lambdify([list(q)], list(factors), "numpy")
    slopes = sp.lambdify([list(q)], sp.Matrix(factors).jacobian(list(q)), "numpy")
    for start in np.random.default_rng(SEED).uniform(-3, 3, (starts, len(q))):
        x = start
        for _ in range(STEPS):
            value = np.asarray(function(x), float)
            if np.abs(value).max() <= FACTORS_VANISH:
                yield x
                break
            step = np.linalg.lstsq(np.asarray(slopes(x), float), value, rcond=None)[0]
            x = x - step / max(1.0, float(np.linalg.norm(step)))
