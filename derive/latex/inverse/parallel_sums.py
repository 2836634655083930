"""Combines rotations about parallel axes, so that c_{23} replaces c_2 c_3 - s_2 s_3."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import sympy as sp

from ...inverse.steps.work import Work
from ...inverse.structure.lines import Axis
from ...inverse.subproblems.turns import CosSin
from ...model.tolerances import EXACT_STRUCTURE

_BILINEAR = {(1, 0, 1, 0): "cc", (0, 1, 0, 1): "ss", (0, 1, 1, 0): "sc", (1, 0, 0, 1): "cs"}
"""Products of a cosine or sine of each of two angles, keyed by the powers of c_1, s_1, c_2 and s_2.
"""


@dataclass(frozen=True)
class ParallelPair:
    """Two adjacent joints with parallel axes.

    Attributes:
        names: Names of the two joints.
        one: The rotation by the first angle.
        other: The rotation by the second angle, or by the negative second angle if the axes are
            opposite.
        total: Cosine and sine symbols of the sum of the first and second angle.
    """

    names: tuple[str, str]
    one: CosSin
    other: CosSin
    total: CosSin


def parallel_pairs(work: Work, axes: Sequence[Axis]) -> Iterator[ParallelPair]:
    """Return the pairs of adjacent parallel axes in a solved chain."""
    turning = [axis for axis in axes if axis.joint in work.turns]
    for a, b in pairwise(turning):
        turns = work.turns[a.joint], work.turns[b.joint]
        product = float(a.direction @ b.direction)
        if abs(product) < 1 - EXACT_STRUCTURE or not all(map(_is_pair, turns)):
            continue
        c, s = sp.symbols(f"_c{a.joint}_{b.joint} _s{a.joint}_{b.joint}", real=True)
        other = turns[1].counted(1 if product > 0 else -1)
        yield ParallelPair((a.name, b.name), turns[0], other, CosSin(c, s))


def merged(
    definitions: Mapping[sp.Symbol, sp.Expr],
    terms: Iterable[sp.Symbol],
    pairs: Sequence[ParallelPair],
    is_known: Callable[[sp.Symbol], bool],
) -> dict[sp.Symbol, sp.Expr]:
    """Combine two rotations about parallel axes into one rotation.

    Terms that contain the rotation of only one joint of a parallel pair stay unchanged.

    Args:
        definitions: The definition of each named term.
        terms: The terms in definition order.
        pairs: The pairs of adjacent joints with parallel axes.
        is_known: Function that returns whether a term has a printed name. Terms with a printed name
            stay unchanged.
    """
    found: dict[sp.Symbol, sp.Expr] = {}
    for term in terms:
        if is_known(term):
            continue
        for pair in pairs:
            changed = _merged(definitions, term, pair, is_known)
            if changed is not None:
                found[term] = changed
    return found


def _merged(
    definitions: Mapping[sp.Symbol, sp.Expr],
    term: sp.Symbol,
    pair: ParallelPair,
    is_known: Callable[[sp.Symbol], bool],
) -> sp.Expr | None:
    definition = definitions[term]
    if not definition.is_Add or _symbols(pair.other).isdisjoint(definition.free_symbols):
        return None
    inner = {
        symbol: definitions[symbol]
        for symbol in definition.free_symbols
        if symbol in definitions and not is_known(symbol)
    }
    generators = [*_factors(pair.one), *_factors(pair.other)]
    polynomial = sp.expand(definition.xreplace(inner)).as_poly(*(g for _, g in generators))
    if polynomial is None or not set(polynomial.monoms()) <= _BILINEAR.keys():
        return None
    found = dict.fromkeys(_BILINEAR.values(), sp.Integer(0))
    for powers, coefficient in polynomial.terms():
        signs = (sign for (sign, _), power in zip(generators, powers, strict=True) if power)
        found[_BILINEAR[powers]] = coefficient * sp.prod(signs)
    if sp.expand(found["cc"] + found["ss"]) == 0 == sp.expand(found["sc"] - found["cs"]):
        return found["cc"] * pair.total.c + found["sc"] * pair.total.s
    return None


def _factors(turn: CosSin) -> list[tuple[sp.Expr, sp.Expr]]:
    return [value.as_coeff_Mul() for value in (turn.c, turn.s)]


def _symbols(turn: CosSin) -> set[sp.Expr]:
    return {symbol for _, symbol in _factors(turn)}


def _is_pair(turn: CosSin) -> bool:
    return all(symbol.is_Symbol for symbol in _symbols(turn))
