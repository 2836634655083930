"""Detects rods with swapped ends.

If the ends a and b of a rod are swapped in a file, the rod's loops do not close, or close far from
the reference. If the module swaps the ends of such a rod back, all loops close near the reference.
For example, swapped ends of four rods rotate the platform of a delta robot slightly.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from ...model.mechanism import Mechanism, Strut
from ..model.numeric_mechanism import Floats, NumericMechanism

NEAR = 0.2
"""Largest accepted distance (radian, or relative to the size) of the closed configuration from the
reference after a swap of rod ends.

If the ends of a correct rod are exchanged, the loops may close at a distant configuration.
"""
CLEARLY = 0.02
"""Rods are tested for swapped ends if the closed configuration is farther from the reference than
this distance (radian, or relative to the size). A smaller distance between the closed configuration
and the reference may be due to rounded reference values."""
PART = 0.1
"""A swap of rod ends is reported only if it reduces the distance of the closed configuration from
the reference to at most this fraction."""


def doubtful_ends(mechanism: Mechanism, closed: Mapping[str, float]) -> str:
    """State which rods seem to have swapped ends although all loops close.

    The text is empty if no rod seems to have swapped ends.

    Args:
        mechanism: A description whose loops close, perhaps far from the reference.
        closed: The values of all joints and cylinders at the closed configuration (radian or
            meter).
    """
    motion = _change(NumericMechanism(mechanism), closed)
    names, left = _best(mechanism) if motion > CLEARLY else ((), math.inf)
    if left > PART * motion:
        return ""
    return (
        f"the loops close {motion:.2g} (rad, or relative to the size) away from the reference, and "
        f"{_seeming(names)}"
    )


def swapped_ends(mechanism: Mechanism) -> str:
    """State which rods seem to have swapped ends, or return "" if no swap closes the loops.

    The function swaps the ends of single rods, then of all rods between two bodies, and then of all
    rods. The text reports the swap whose closed configuration is nearest to the reference
    configuration.

    Args:
        mechanism: A description whose loops do not close at the reference.
    """
    names, motion = _best(mechanism)
    return _seeming(names) if motion <= NEAR else ""


def _best(mechanism: Mechanism) -> tuple[tuple[str, ...], float]:
    """Return the names of the rods to swap, and the remaining distance from the reference."""
    planes = NumericMechanism(mechanism).planes
    found = {names: _motion(_exchanged(mechanism, names), planes) for names in _groups(mechanism)}
    for names in sorted(found, key=found.__getitem__):
        # An exchange of the rod ends may move the pins of the rod out of the plane of the loop.
        if found[names] < math.inf and _motion(_exchanged(mechanism, names)) < math.inf:
            return names, found[names]
    return (), math.inf


def _seeming(names: tuple[str, ...]) -> str:
    which = f"rod {names[0]!r}" if len(names) == 1 else f"rods {', '.join(map(repr, names))}"
    return (
        f"the ends of {which} seem swapped: if a and b are exchanged between their "
        "bodies, all loops close near the reference"
    )


def _groups(mechanism: Mechanism) -> Iterator[tuple[str, ...]]:
    """Yield groups of rods whose ends are exchanged together."""
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
    """Return a strut with exchanged ends."""
    a, b = strut.a, strut.b
    return replace(
        strut,
        a=replace(a, placement=b.placement),
        b=replace(b, placement=a.placement),
    )


def _motion(mechanism: Mechanism, planes: Mapping[str, Floats] | None = None) -> float:
    """Return the distance from the reference to a closed configuration, or inf if none is found."""
    bodies = NumericMechanism(mechanism, planes)
    names = [loop_joint.name for loop_joint in mechanism.loop_joints]
    closed = bodies.nearest(bodies.values, bodies.unknown, names)
    return _change(bodies, closed) if bodies.all_closed(closed, names) else math.inf


def _change(bodies: NumericMechanism, closed: Mapping[str, float]) -> float:
    return max(
        (
            abs(closed[name] - bodies.values[name]) / (bodies.size if bodies.is_length(name) else 1)
            for name in bodies.unknown
        ),
        default=0.0,
    )
