"""The position of the tool of a robot with loops as a function of its actuators, in numbers."""

from collections.abc import Sequence

import numpy as np

from ...chain.body_shapes import Skeleton
from ...chain.rigid_bodies import Array
from ...model.mechanism import Mechanism
from ...terms.casadi_graph import lower
from ...terms.symbolic_function import SymbolicFunction
from ...terms.terms import Terms
from .reached import ToolPosition, ToolRegion, box, first_axis, is_vertical, way

_POSITION = [3, 7, 11]
"""The entries of the position in a pose, row by row."""


def reached_by_loops(
    mechanism: Mechanism,
    terms: Terms,
    skeleton: Skeleton,
    functions: Sequence[SymbolicFunction],
) -> ToolRegion | None:
    """The region that the tool of a robot with loops reaches within the limits of its actuators.

    As of :func:`~chasles.derive.latex.drawing.reached.reached`; postures in which a loop does not
    close do not count.

    Args:
        mechanism: The description.
        terms: Its parameters at their defaults.
        skeleton: Its bodies.
        functions: Its functions, of which ``fk`` and ``margin`` are used.

    Returns:
        The region; None also where there is no closed form ``fk``.
    """
    own = [function for function in functions if function.name in ("fk", "margin")]
    ends = [
        [None if x is None else float(terms.value(x)) for x in c.limits]
        for c in mechanism.coordinates
    ]
    limits = box(
        [
            (c.unit == "m", low, high)
            for c, (low, high) in zip(mechanism.coordinates, ends, strict=True)
        ]
    )
    if limits is None or all(function.name != "fk" for function in own):
        return None
    made = dict(zip((f.name for f in own), lower(own, mechanism.name), strict=True))

    def at(q: Array) -> Array:
        p = np.array(made["fk"](q.T))[_POSITION].T
        if "margin" in made:
            margins = np.array(made["margin"](q.T))
            p[~(margins >= 0).all(0)] = np.nan
        return p

    upright = _upright(mechanism, skeleton)
    return ToolPosition(at, *limits, skeleton.size, upright).region()


def _upright(mechanism: Mechanism, skeleton: Skeleton) -> tuple[int, Array] | None:
    """The actuator that turns the main chain about a vertical axis, and a point of the axis."""
    joint, axis, foot = first_axis(way(skeleton))
    moved = [coordinate.moves for coordinate in mechanism.coordinates]
    if joint.kind != "revolute" or joint.name not in moved or not is_vertical(axis):
        return None
    return moved.index(joint.name), foot
