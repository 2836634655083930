"""The coordinates that a caller fixes, by the names or indices of coordinates and joints."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from .contract import Coordinate, Reference
from .errors import InputTypeError, InputValueError
from .facts import RobotFacts
from .size import configurations

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Fixed = str | int | Iterable[str | int]
"""Coordinates or joints: a name or an index in q, or several."""


def fixed_coordinates(robot: RobotFacts, method: str, fixed: Fixed | None) -> BoolArray:
    """Return which coordinates keep their values if some coordinates or joints are fixed.

    Args:
        robot: The robot.
        method: The method that was called, for errors.
        fixed: Names or indices in q; a joint of the main chain stands for the coordinate that moves
            it.

    Returns:
        (n,) whether each coordinate is fixed.

    Raises:
        InputTypeError: If `fixed` holds anything but names and indices, such as values.
        InputValueError: If there is no such coordinate or joint, if several coordinates move a
            joint, or if no coordinate is left to move.
    """
    is_fixed = np.zeros(robot.n, np.bool_)
    if fixed is None:
        return is_fixed
    items: Iterable[object] = [fixed]
    if isinstance(fixed, Iterable) and not isinstance(fixed, str | Mapping):
        items = fixed
    for item in items:
        is_fixed[_coordinate(robot, f"{robot.name}.{method}", item)] = True
    if is_fixed.all():
        raise InputValueError(
            f"{robot.name}.{method}: every coordinate is fixed, so that nothing is left to move"
        )
    return is_fixed


def _coordinate(robot: RobotFacts, caller: str, item: object) -> int:
    """The index of the coordinate that a name or an index stands for."""
    if not isinstance(item, str):
        return _index(robot, caller, item)
    names = [coordinate.name for coordinate in robot.coordinates]
    if item in names:
        return names.index(item)
    joints = [joint.name for joint in robot.chain_joints]
    if item not in joints or robot.solution != "closed form":
        chain = ", ".join(joint for joint in joints if joint not in names)
        more = f"; joints of the chain: {chain}" if chain and item not in joints else ""
        why = "its loops are solved by iteration; " if item in joints else ""
        raise InputValueError(
            f"{caller}: expected a coordinate to fix, got {item!r}; {why}coordinates: "
            f"{', '.join(names)}{more}"
        )
    movers = np.flatnonzero(follows(robot)[joints.index(item)])
    if len(movers) != 1:
        several = ", ".join(names[k] for k in movers) or "no coordinate"
        raise InputValueError(
            f"{caller}: {item} follows {several}: fix coordinates instead, by their names"
        )
    return int(movers[0])


def _index(robot: RobotFacts, caller: str, item: object) -> int:
    try:
        index = operator.index("" if isinstance(item, bool | np.bool_) else item)  # type: ignore[arg-type]
    except TypeError:
        raise InputTypeError(
            f"{caller}: fixed takes names and indices of coordinates, without values; got {item!r}"
        ) from None
    if not -robot.n <= index < robot.n:
        raise InputValueError(
            f"{caller}: there is no coordinate {index}; {robot.n} coordinates, from 0"
        )
    return index % int(robot.n)


@functools.lru_cache(maxsize=64)
def follows(robot: RobotFacts) -> BoolArray:
    """(n_theta, n) whether each joint of the main chain moves with each coordinate.

    A robot without loops has its coordinates as joints. Where loops are solved in closed form, the
    derivative of a joint by a coordinate that does not move it is an exact 0.
    """
    if not robot.loops:
        return np.eye(robot.n, dtype=np.bool_)
    assert robot.reference is not None
    return following(robot.coordinates, robot.reference, robot.chain_D_q)


def following(
    coordinates: Sequence[Coordinate],
    reference: Reference,
    chain_D_q: Callable[[FloatArray], FloatArray],
) -> BoolArray:
    """As `follows`, for a robot with loops in closed form, from its derivative chain_D_q."""
    q = np.vstack([configurations(coordinates, reference), reference.q])
    return np.asarray((np.nan_to_num(chain_D_q(q)) != 0).any(0))
