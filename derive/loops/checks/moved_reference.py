"""Finds reference values that are far from the configuration at which the loops close."""

import math

from ...model.tolerances import MOVED_REFERENCE
from ..closing import longest_length
from ..hybrid import Hybrid
from .gaps import shown


def moved_reference(h: Hybrid) -> str:
    """States which described joint value is farthest from its value at the closed reference.

    The described values of dependent joints only select the branch. A large difference usually
    means wrong actuated coordinates: the default for a cylinder without a stated value is the
    middle of its limits. The result is empty if all values agree closely, up to full turns.
    """
    at, size = h.at_reference, longest_length(h.mechanism, h.terms)
    described = {name: float(h.terms.value(x)) for name, x in h.mechanism.reference}
    lengths = {v.name for v in h.variables if v.unit == "m"}
    off = {
        name: abs(value - at[name]) / size
        if name in lengths
        else abs(math.remainder(value - at[name], math.tau))
        for name, value in described.items()
        if name in at
    }
    farthest = max(off, key=lambda name: off[name], default=None)
    if farthest is None or off[farthest] <= MOVED_REFERENCE:
        return ""
    is_length = farthest in lengths
    moved = [c.moves for c in h.mechanism.coordinates]
    actuated = ", ".join(f"{name} = {shown(at[name], name in lengths)}" for name in moved)
    return (
        f"reference: {farthest} is {shown(described[farthest], is_length)} in the file, and "
        f"{shown(at[farthest], is_length)} where the loops close at {actuated}"
    )
