"""Evaluates the tool position of a robot with loops numerically from its actuators."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...chain.body_shapes import Skeleton
from ...chain.rigid_bodies import Array
from ...model.mechanism import Mechanism
from ...terms.casadi_graph import lower, values_at
from ...terms.symbolic_function import SymbolicFunction
from ...terms.terms import Terms
from .reached import ToolPosition, ToolRegion, box, first_axis, is_vertical, way

_POSITION = [3, 7, 11]
"""Indices of the position in a row-major pose."""


def reached_by_loops(
    mechanism: Mechanism,
    terms: Terms,
    skeleton: Skeleton,
    functions: Sequence[SymbolicFunction],
) -> ToolRegion | None:
    """Returns the region that the tool of a robot with loops reaches within its actuator limits.

    Like :func:`~chasles.derive.latex.drawing.reached.reached`, without configurations at which a
    loop is open.

    Args:
        mechanism: The description.
        terms: The parameters of the mechanism, at default values.
        skeleton: Its bodies.
        functions: The functions of the robot, with ``fk`` and ``margin``.

    Returns:
        The region; also None if ``fk`` has no closed form.
    """
    named = {function.name: function for function in functions}
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
    if limits is None or "fk" not in named or named["fk"].calls:
        return None
    (position,) = lower([_position(named["fk"], named.get("margin"))], mechanism.name)

    def at(q: Array) -> Array:
        found = values_at(position, q)
        p, margins = found[:, :3], found[:, 3:]
        p[~(margins >= 0).all(1)] = np.nan
        return p

    upright = _upright(mechanism, skeleton)
    return ToolPosition(at, *limits, skeleton.size, upright).region()


def _position(fk: SymbolicFunction, margin: SymbolicFunction | None) -> SymbolicFunction:
    """Returns the tool position, followed by the loop margins."""
    entries = [fk.outputs[0].entries[k] for k in _POSITION]
    if margin is not None:
        entries += margin.outputs[0].entries
    result = replace(fk.outputs[0], entries=tuple(entries), shape=(len(entries),))
    return replace(fk, name="position", outputs=(result,))


def _upright(mechanism: Mechanism, skeleton: Skeleton) -> tuple[int, Array] | None:
    """Returns the actuator that rotates the main chain about a vertical axis, and an axis point."""
    joint, axis, foot = first_axis(way(skeleton))
    moved = [coordinate.moves for coordinate in mechanism.coordinates]
    if joint.kind != "revolute" or joint.name not in moved or not is_vertical(axis):
        return None
    return moved.index(joint.name), foot
