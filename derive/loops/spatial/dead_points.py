"""Selects the leg that solves a joint, if several legs determine the same joint.

In a chain with more joints than freedoms, several rods may determine the same joint. A rod that is
almost in line with its crank at the reference can pass its dead point in use, and the joint then
changes the branch. A rod perpendicular to its crank determines the joint at all configurations near
the reference.
"""

import math
from collections.abc import Sequence

from ...model.mechanism import Strut
from ...model.tolerances import CLEAR_LEG, NEARLY_DEAD
from .struts import Legs


def is_clearest(legs: Legs, strut: Strut, struts: Sequence[Strut]) -> bool:
    """Whether a leg is far from its dead point, or farther than legs that solve the same joint.

    Args:
        legs: The partially solved mechanism.
        strut: The leg.
        struts: All unsolved legs.

    Returns:
        The result is also true if the leg does not determine a single joint, or if no other leg
        determines this joint.
    """
    moving = legs.moving(strut)
    rivals = [
        other
        for other in struts
        if other is not strut
        and len(moving) == 1
        and legs.moving(other) == moving
        and legs.length(other) is not None
    ]
    if not rivals:
        return True
    own = _margin(legs, strut)
    return own >= CLEAR_LEG or not any(_margin(legs, rival) > own + NEARLY_DEAD for rival in rivals)


def _margin(legs: Legs, strut: Strut) -> float:
    """Returns the margin of the leg's step at the reference, or -1 if the leg does not close."""
    turning = legs.reach((strut,), sliding=False)
    reach = turning or legs.reach((strut,), sliding=True)
    if reach is None:
        return -1.0
    of = legs.reference.of
    (x, y, z), (X, Y, Z) = (tuple(map(of, point)) for point in (reach.tip, reach.target))
    square = of(reach.square)
    if turning is None:
        margin = 1 - ((X - x) ** 2 + (Y - y) ** 2) / square
    else:
        v, d, flat = math.hypot(x, y), math.hypot(X, Y), square - (Z - z) ** 2
        across = 4 * v**2 * flat - (v**2 + flat - d**2) ** 2
        margin = across / (4 * v**2 * square) if v > 0 else -1.0
    return -1.0 if math.isnan(margin) else margin
