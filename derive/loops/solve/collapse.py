"""Replaces a chain segment by a translation if the rotations of its joints cancel.

If closed loops keep the angle sum of consecutive parallel joints constant, the bodies after these
joints only translate. The translation is a sum of planar vectors. The loop equations then eliminate
angles from this sum of planar vectors. The remaining sum often has only a few vectors. For example,
a pantograph arm moves its wrist along a line and a circle.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import sympy as sp

from ...chain.groups import Group, SlidingJoint, Station
from ...terms.terms import Terms
from ...terms.vectors import ONE, ZERO, added, rotated_z
from ..model.phasors import PhasorSum

X, Y = (ONE, ZERO, ZERO), (ZERO, ONE, ZERO)


def collapsed(
    terms: Terms,
    groups: Sequence[Group],
    relations: Sequence[PhasorSum],
    count: int,
) -> tuple[tuple[Group, ...], tuple[sp.Expr, ...]]:
    """Return the chain without the joints whose rotations cancel.

    Args:
        terms: Names of all terms.
        groups: The chain.
        relations: Sums of rotated planar vectors that are zero if the loops close.
        count: Number of moving joints in the chain.

    Returns:
        A pair: the chain without those joints whose rotations cancel, and the expressions of the
        variable translations (meter). In the returned chain, sliding joints with the indices
        ``count``, ``count + 1`` and so on represent these translations.
    """
    translations: list[sp.Expr] = []
    found = []
    for group in groups:
        before, after = None, group
        while after is not before:
            before, after = after, _collapsed(terms, after, relations, count, translations)
        found.append(after)
    return tuple(found), tuple(translations)


def _collapsed(
    terms: Terms,
    group: Group,
    relations: Sequence[PhasorSum],
    count: int,
    translations: list[sp.Expr],
) -> Group:
    """Replace at most one segment of a chain by a translation."""
    stations = group.stations
    for first in range(1, len(stations)):
        for last in range(len(stations) - 1, first, -1):
            turn = sp.expand(stations[last].angle - stations[first - 1].angle)
            inner = stations[first:last]
            if not terms.is_constant(turn) or any(s.pitch != 0 or s.slides for s in inner):
                continue
            moved = _sum(terms, inner).reduced(relations, partial(_solved_angles, terms))
            if any(map(terms.is_solved, moved.terms)):
                continue
            still = moved.turned(-stations[first - 1].angle).coordinates(terms)
            x, y = map(terms.let, still)
            slides = []
            for value, axis in ((x, X), (y, Y)):
                if not terms.is_constant(value):
                    slides.append(SlidingJoint(count + len(translations), axis))
                    translations.append(value)
            height = sum((station.reach[2] for station in inner), ZERO)
            merged = _merged(terms, stations[first - 1], stations[last], turn, (x, y, height))
            merged = replace(merged, slides=(*slides, *merged.slides))
            return replace(group, stations=(*stations[: first - 1], merged, *stations[last + 1 :]))
    return group


def _sum(terms: Terms, stations: Sequence[Station]) -> PhasorSum:
    """Return the planar sum of link offsets, each rotated by the angle of its link."""
    total = PhasorSum()
    for station in stations:
        angle, constant = _parted(station.angle)
        x, y, _ = (terms.spelled(component) for component in station.reach)
        c, s = (
            terms.spelled(terms.let(sp.cos(constant))),
            terms.spelled(terms.let(sp.sin(constant))),
        )
        total = total + PhasorSum.of((c * x - s * y, s * x + c * y), angle)
    return total


def _solved_angles(terms: Terms, total: PhasorSum) -> int:
    return sum(map(terms.is_solved, total.terms))


def _parted(angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Split an angle into a variable and a constant part."""
    constant, moving = sp.expand(angle).as_independent(*angle.free_symbols, as_Add=True)
    return moving, constant


def _merged(
    terms: Terms, before: Station, after: Station, turn: sp.Expr, moved: tuple[sp.Expr, ...]
) -> Station:
    """Merge the parts of a chain before and after a segment whose rotations cancel."""
    c, s = terms.cos_sin(turn)
    translation = terms.let(moved[0]), terms.let(moved[1]), terms.let(moved[2])
    reach = added(terms, before.reach, translation)
    turned = after.mapped(lambda v: rotated_z(terms, v, c, s))
    frames = (replace(f, origin=added(terms, reach, f.origin)) for f in turned.frames)
    return replace(
        before,
        reach=added(terms, reach, turned.reach),
        slides=(*before.slides, *turned.slides),
        frames=(*before.frames, *frames),
    )
