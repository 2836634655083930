"""The parameters between two consecutive axes in the robot's own file."""

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
    """Returns a joint axis's displacements (d, k), one column per parameter between both axes.

    The parameters are the previous joint's fields that act after its motion or commute with it, the
    previous joint's coordinate offset, and the fields of this joint that act before the joint's
    motion. The position of a previous prismatic joint is arbitrary.

    Args:
        robot: The robot.
        pair: The joint and the previous joint.
    """
    numbers: _Numbers = {parameter.symbol: parameter.value for parameter in robot.parameters}
    offset = sp.Symbol("_offset", real=True)
    product: Placement = ()
    named = {offset: sp.S.Zero}
    if pair.before is not None:
        before, after = _in_symbols(pair.before, named)
        turn = () if pair.before.kind == "prismatic" else rotation("z", offset)
        along = _moving_along(before)
        # The axis is expressed in the joint's frame, which is after these motions.
        nominal = tuple(_at(motion, named) for motion in along)
        product = inverse(nominal) + along + turn + after
    product += _between(robot, pair) + _in_symbols(pair.joint, named)[0]
    product = tuple(_at(motion, numbers) for motion in product)
    symbols = [symbol for symbol in symbols_in(product) if symbol in named]
    values = [float(named[symbol].xreplace(numbers)) for symbol in symbols]
    return pair.by_numbers(product, symbols, values)


def _between(robot: SerialRobot, pair: Neighbours) -> Placement:
    """Returns the fixed joints between the joint and its moving predecessor."""
    joints = list(robot.joints)
    last = joints.index(pair.joint)
    first = joints.index(pair.before) + 1 if pair.before else 0
    return tuple(motion for j in joints[first:last] for motion in (*j.before, *j.after))


def _in_symbols(joint: Joint, named: _Numbers) -> Placements:
    """Returns the placements of a joint with symbols for its values, and records the symbols."""
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
    """Returns the last motions before a joint's own motion that commute with it."""
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
