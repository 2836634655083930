"""Rods whose ends seem swapped: with their places exchanged, all loops close near the reference.

Loops with swapped ends stand open, or close in another posture: four of six rods of a delta turn
its platform a little.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from ...model.mechanism import Mechanism, Strut
from .bodies_in_numbers import BodiesInNumbers, Floats

NEAR = 0.2
"""Farthest motion from the reference, in parts of the mechanism's size or radian: values of passive
joints need only be near, and an exchange that is no remedy may close the loops elsewhere."""
CLEARLY = 0.02
"""Motion from the reference, as :data:`NEAR`, that values of two digits do not explain."""
PART = 0.1
"""Part of that motion that an exchange may leave: the reference then has the exchanged posture."""


def doubtful_ends(mechanism: Mechanism, closed: Mapping[str, float]) -> str:
    """The rods whose ends seem swapped though all loops close, in a sentence; else empty.

    Args:
        mechanism: A description whose loops close far from the reference.
        closed: The values of all members there (radian or metre).
    """
    motion = _change(BodiesInNumbers(mechanism), closed)
    names, left = _best(mechanism) if motion > CLEARLY else ((), math.inf)
    if left > PART * motion:
        return ""
    return (
        f"the loops close {motion:.2g} rad, or parts of the size, away from the reference, and "
        f"{_seeming(names)}"
    )


def swapped_ends(mechanism: Mechanism) -> str:
    """The rods whose ends seem swapped, in a sentence; empty where no exchange closes the loops.

    Each rod is tried alone, then the rods between the same two bodies together, then all. Of the
    exchanges that close all loops, that nearest to the reference is told.

    Args:
        mechanism: A description whose loops do not close at the reference.
    """
    names, motion = _best(mechanism)
    return _seeming(names) if motion <= NEAR else ""


def _best(mechanism: Mechanism) -> tuple[tuple[str, ...], float]:
    """The rods whose exchange closes all loops nearest to the reference, and how far from it."""
    normals = BodiesInNumbers(mechanism).normals
    found = {names: _motion(_exchanged(mechanism, names), normals) for names in _groups(mechanism)}
    for names in sorted(found, key=found.__getitem__):
        # An exchange may take the pins of a rod out of the plane of its loop.
        if found[names] < math.inf and _motion(_exchanged(mechanism, names)) < math.inf:
            return names, found[names]
    return (), math.inf


def _seeming(names: tuple[str, ...]) -> str:
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


def _motion(mechanism: Mechanism, normals: Mapping[str, Floats] | None = None) -> float:
    """How far the nearest closed posture is from the reference; infinite where none is found."""
    bodies = BodiesInNumbers(mechanism, normals)
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
