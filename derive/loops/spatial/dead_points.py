"""Which leg leads, where several determine the same joint.

A chain with more joints than freedoms gives a joint by each of several rods. One that is stretched
out near the reference passes its dead point in use, and the joint is on its other side from there;
a rod that stands across its crank gives the joint everywhere around the reference.
"""

import math
from collections.abc import Sequence

from ...model.mechanism import Strut
from ...model.tolerances import CLEAR_LEG, NEARLY_DEAD
from .struts import Legs


def is_clearest(legs: Legs, strut: Strut, struts: Sequence[Strut]) -> bool:
    """Whether a leg is far from its dead point, or farther than those that give the same joint.

    Args:
        legs: The mechanism, as far as it is solved.
        strut: The leg.
        struts: All legs that are left.

    Returns:
        True also for a leg that determines no single joint, or one that no other leg determines.
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
    """The margin of the step that this leg leads, at the reference; -1 where it does not close."""
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
