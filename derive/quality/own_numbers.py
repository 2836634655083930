"""The robot's own numbers between two axes, as its file gives them."""

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..description.conventions.axis_maps import symbols_in
from ..description.conventions.neighbours import Neighbours
from ..model.convention import Placements
from ..model.placements import Placement, Rotation, Translation, inverse, rotation
from ..model.robot import Joint, SerialRobot

_Numbers = dict[sp.Symbol, sp.Expr]


def own_displacements(robot: SerialRobot, pair: Neighbours) -> NDArray[np.float64]:
    """(d, k) displacement of a joint's axis by the robot's numbers that act between both axes.

    These are the fields of the joint before that act behind its motion or commute with it, the
    offset of its coordinate, and the fields of the joint that act before its motion. The place of a
    sliding joint before is free.

    Args:
        robot: The robot.
        pair: The joint and the one before.
    """
    numbers: _Numbers = {parameter.symbol: parameter.value for parameter in robot.parameters}
    offset = sp.Symbol("_offset", real=True)
    product: Placement = ()
    named = {offset: sp.S.Zero}
    if pair.before is not None:
        before, after = _in_symbols(pair.before, named)
        turn = () if pair.before.kind == "prismatic" else rotation("z", offset)
        along = _moving_along(before)
        # The axis is seen from the joint's frame, which is behind these motions.
        nominal = tuple(_at(motion, named) for motion in along)
        product = inverse(nominal) + along + turn + after
    product += _between(robot, pair) + _in_symbols(pair.joint, named)[0]
    product = tuple(_at(motion, numbers) for motion in product)
    symbols = [symbol for symbol in symbols_in(product) if symbol in named]
    values = [float(named[symbol].xreplace(numbers)) for symbol in symbols]
    return pair.by_numbers(product, symbols, values)


def _between(robot: SerialRobot, pair: Neighbours) -> Placement:
    """The fixed joints between the joint and the moving one before."""
    joints = list(robot.joints)
    last = joints.index(pair.joint)
    first = joints.index(pair.before) + 1 if pair.before else 0
    return tuple(motion for j in joints[first:last] for motion in (*j.before, *j.after))


def _in_symbols(joint: Joint, named: _Numbers) -> Placements:
    """The placements of a joint with a symbol for each of its numbers, which are added to named."""
    if joint.convention is None:
        return joint.before, joint.after
    given = dict(joint.given)
    fields = {}
    for field in joint.convention.fields:
        if field.kind == "direction":
            fields[field.name] = tuple(given[name] for name in field.components)
            continue
        symbols = [sp.Symbol(f"_{joint.name}_{name}", real=True) for name in field.components]
        named |= dict(zip(symbols, (given[name] for name in field.components), strict=True))
        fields[field.name] = tuple(symbols) if field.is_vector else symbols[0]
    return joint.convention(joint.kind, **fields)


def _moving_along(before: Placement) -> Placement:
    """The last motions before a joint's own that commute with it: along and about its axis."""
    count = len(before)
    while count and _is_along_z(before[count - 1]):
        count -= 1
    return before[count:]


def _is_along_z(motion: Rotation | Translation) -> bool:
    if isinstance(motion, Rotation):
        return motion.axis == "z"
    return bool(motion.vector[0] == 0 and motion.vector[1] == 0)


def _at(motion: Rotation | Translation, numbers: _Numbers) -> Rotation | Translation:
    if isinstance(motion, Rotation):
        return Rotation(motion.axis, motion.angle.xreplace(numbers))
    return Translation(tuple(part.xreplace(numbers) for part in motion.vector))
