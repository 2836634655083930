"""Rods whose ends seem swapped: with their places exchanged, all loops close near the reference."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from ...model.mechanism import Mechanism, Strut
from .bodies_in_numbers import BodiesInNumbers

NEAR = 0.2
"""Farthest motion from the reference, in parts of the mechanism's size or radian: values of passive
joints need only be near, and an exchange that is no remedy may close the loops elsewhere."""


def swapped_ends(mechanism: Mechanism) -> str:
    """The rods whose ends seem swapped, in a sentence; empty where no exchange closes the loops.

    Each rod is tried alone, then the rods between the same two bodies together, then all. Of the
    exchanges that close all loops, that nearest to the reference is told.

    Args:
        mechanism: A description whose loops do not close at the reference.
    """
    found = {names: _motion(_exchanged(mechanism, names)) for names in _groups(mechanism)}
    names = min(found, key=found.__getitem__, default=())
    if not names or found[names] > NEAR:
        return ""
    which = f"rod {names[0]!r}" if len(names) == 1 else f"rods {', '.join(map(repr, names))}"
    return (
        f"the ends of {which} seem swapped: with the places of a and b exchanged between their "
        "bodies, all loops close near the reference"
    )


def _groups(mechanism: Mechanism) -> Iterator[tuple[str, ...]]:
    """Names of rods that are tried together."""
    pairs: dict[frozenset[str], list[str]] = {}
    for strut in mechanism.struts:
        yield (strut.name,)
        pairs.setdefault(frozenset((strut.a.body, strut.b.body)), []).append(strut.name)
    yield from (tuple(names) for names in pairs.values() if len(names) > 1)
    if len(pairs) > 1:
        yield tuple(strut.name for strut in mechanism.struts)


def _exchanged(mechanism: Mechanism, names: tuple[str, ...]) -> Mechanism:
    return replace(
        mechanism,
        struts=tuple(
            _turned(strut) if strut.name in names else strut for strut in mechanism.struts
        ),
    )


def _turned(strut: Strut) -> Strut:
    """A strut with the places of its ends exchanged between their bodies."""
    a, b = strut.a, strut.b
    return replace(
        strut,
        a=replace(a, placement=b.placement),
        b=replace(b, placement=a.placement),
    )


def _motion(mechanism: Mechanism) -> float:
    """How far the nearest closed posture is from the reference; infinite where none is found."""
    bodies = BodiesInNumbers(mechanism)
    names = [closer.name for closer in mechanism.closers]
    closed = bodies.nearest(bodies.values, bodies.unknown, names)
    return _change(bodies, closed) if bodies.all_closed(closed, names) else math.inf


def _change(bodies: BodiesInNumbers, closed: Mapping[str, float]) -> float:
    return max(
        (
            abs(closed[name] - bodies.values[name]) / (bodies.size if bodies.is_length(name) else 1)
            for name in bodies.unknown
        ),
        default=0.0,
    )
