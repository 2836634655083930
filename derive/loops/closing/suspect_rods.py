"""Names a rod whose length is much too large or too small for the mechanism.

Usually, such a rod length is given in the wrong unit. The rod need not be in the loop that does not
close, because the bodies at its ends may also belong to other loops.
"""

from collections.abc import Sequence
from statistics import median

import sympy as sp

from ...model.mechanism import Strut
from ..model.numeric_mechanism import NumericMechanism, length_of
from .shown_values import shown

FAR_OFF = 100.0
"""A rod length is suspect if its ratio to the median of all other lengths, or the inverse ratio,
reaches this value."""
MIN_OTHERS = 3
"""Minimum number of other lengths with which the length of a suspect rod is compared."""
SLIPS = (1000.0, 1 / 1000)
"""Ratios of units that are often confused, such as mm and m."""


def suspect_rod(bodies: NumericMechanism, loops: Sequence[str]) -> str:
    """Name a rod whose length has a suspect unit.

    If the loops close with the rod length read in another unit, the text also states the corrected
    length. The text is empty if all rod lengths are plausible.

    Args:
        bodies: Numerical model of a mechanism with an open loop.
        loops: Names of the loops that must close with the corrected length.
    """
    for strut in bodies.mechanism.struts:
        name = _constant(bodies, strut)
        if strut.is_cylinder or not name:
            continue
        lengths = {k: x for k, x in bodies.constants.items() if x > 0 and bodies.is_length(k)}
        own = lengths.pop(name, 0.0)
        if len(lengths) < MIN_OTHERS or not own:
            continue
        middle = median(lengths.values())
        if max(own / middle, middle / own) < FAR_OFF:
            continue
        low, high = (shown(of(lengths.values()), True) for of in (min, max))
        text = f"The length of {strut.name!r}, {shown(own, True)}, is suspect: "
        text += f"all other lengths are between {low} and {high}"
        slips = (own * ratio for ratio in SLIPS)
        closing = next((x for x in slips if _closes(bodies, name, x, loops)), None)
        if closing is None:
            return text
        return f"{text}, and the loops close with {shown(closing, True)}; check its unit"
    return ""


def _closes(bodies: NumericMechanism, name: str, value: float, loops: Sequence[str]) -> bool:
    """Whether the loops close near the reference if a constant has another value."""
    before = bodies.constants
    bodies.constants = {**before, name: value}
    found = bodies.nearest(bodies.values, bodies.unknown, loops)
    closed = bodies.all_closed(found, loops)
    bodies.constants = before
    return closed


def _constant(bodies: NumericMechanism, strut: Strut) -> str:
    """Return the name of the constant that gives the rod length, or "" if there is none."""
    if length_of(strut) in bodies.constants:
        return length_of(strut)
    return strut.length.name if isinstance(strut.length, sp.Symbol) else ""
