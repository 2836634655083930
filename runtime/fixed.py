"""The argument `fixed=`, which selects fixed joints and, for inverse kinematics, their values."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arrays import BoolArray, FloatArray, real_array
from .contract import Coordinate, Reference
from .errors import InputTypeError, InputValueError, ShapeError
from .facts import RobotFacts
from .size import configurations

Fixed = str | int | Iterable[str | int]
"""One or several coordinates or joints, as names or indices in q."""


def read_fixed(label: str, fixed: Any) -> dict[str | int, ArrayLike | None]:
    """Return the values of fixed joints by name or index; None means the value at `q_seed`.

    Raises an InputTypeError if `fixed` is neither a mapping nor names.
    """
    if fixed is None:
        return {}
    items: dict[Any, Any]
    if isinstance(fixed, Mapping):
        items = dict(fixed)
    elif isinstance(fixed, Iterable) and not isinstance(fixed, str):
        items = dict.fromkeys(fixed)
    else:
        items = {fixed: None}
    for n in items:
        if not isinstance(n, str | int | np.integer) or isinstance(n, bool):
            raise InputTypeError(
                f"{label}: fixed expects names and indices of coordinates, got {fixed!r}"
            )
    return {name if isinstance(name, str) else int(name): items[name] for name in items}


def fixed_coordinates(robot: RobotFacts, method: str, fixed: Fixed | None) -> BoolArray:
    """Return a mask (n,) of the fixed coordinates.

    If an item is a joint of the main chain, the coordinate that moves this joint is fixed.

    Raises:
        InputTypeError: `fixed` contains joint values, or an item is neither a name nor an index.
        InputValueError: A name is unknown, several coordinates move one joint, or all coordinates
            are fixed.
    """
    label = f"{robot.name}.{method}"
    is_fixed = np.zeros(robot.n, np.bool_)
    for item, value in read_fixed(label, fixed).items():
        if value is not None:
            raise InputTypeError(
                f"{label}: fixed expects names and indices of coordinates, without values; got "
                f"{fixed!r}"
            )
        is_fixed[_coordinate(robot, label, item)] = True
    if fixed is not None and is_fixed.all():
        raise InputValueError(f"{label}: all coordinates are fixed; at least one must be free")
    return is_fixed


def fixed_values(
    robot: RobotFacts, label: str, task: str, fixed: Any, q_seed: FloatArray
) -> dict[str, FloatArray]:
    """Return the values (N,) of fixed joints and redundancy parameters by name.

    Raises:
        InputTypeError: If `fixed` is neither a mapping nor names.
        InputValueError: If a name is unknown or occurs twice, or the task is not "pose".
        ShapeError: If values do not broadcast.
    """
    items = read_fixed(label, fixed)
    if items and task != "pose":
        raise InputValueError(f'{label}: fixed= requires task="pose", got task={task!r}')
    values: dict[str, FloatArray] = {}
    for item, given in items.items():
        name = _name(robot, label, item)
        if name in values:
            raise InputValueError(f"{label}: {item!r} is fixed twice")
        if given is None:
            values[name] = values_at(robot, name, q_seed)
            continue
        value = real_array(label, str(item), given)
        try:
            values[name] = np.ascontiguousarray(np.broadcast_to(value.reshape(-1), len(q_seed)))
        except ValueError:
            raise ShapeError(
                f"{label}: fixed values must broadcast with T and q_seed; got shape {value.shape} "
                f"for {name}"
            ) from None
    return values


def parameter_values(
    robot: RobotFacts, fixed: Mapping[str, FloatArray], q_seed: FloatArray
) -> tuple[FloatArray, ...]:
    """Return each redundancy parameter (N,): its fixed value, or its value at q_seed (N, n)."""
    return tuple(
        fixed[item.name] if item.name in fixed else values_at(robot, item.name, q_seed)
        for item in robot.redundancy
    )


def is_own(robot: RobotFacts, fixed: Mapping[str, FloatArray]) -> bool:
    """Test whether every fixed joint is a redundancy parameter, which is an input of `ik`."""
    return fixed.keys() <= {item.name for item in robot.redundancy}


def values_at(robot: RobotFacts, name: str, q_seed: FloatArray) -> FloatArray:
    """Return the values (N,) of a redundancy parameter, joint or coordinate at q_seed (N, n)."""
    names, joints = robot.coordinate_names, robot.joint_names
    is_parameter = any(item.name == name for item in robot.redundancy)
    swivel = robot._roles.get(("redundancy", "actuators", ""))
    if swivel is not None and name == swivel.__name__:
        return np.ascontiguousarray(swivel(q_seed))
    if robot.manifest.loops.chain and name in joints and (is_parameter or name not in names):
        return np.ascontiguousarray(robot.chain(q_seed)[:, joints.index(name)])
    return np.ascontiguousarray(q_seed[:, names.index(name)])


def _name(robot: RobotFacts, label: str, item: str | int) -> str:
    if isinstance(item, int):
        return robot.coordinate_names[_coordinate(robot, label, item)]
    parameters = [own.name for own in robot.redundancy]
    known = dict.fromkeys((*parameters, *robot.joint_names, *robot.coordinate_names))
    if item not in known:
        raise InputValueError(f"{label}: cannot fix {item!r}; expected one of {', '.join(known)}")
    return item


def _coordinate(robot: RobotFacts, caller: str, item: str | int) -> int:
    names, joints = robot.coordinate_names, robot.joint_names
    if isinstance(item, int):
        if not -robot.n <= item < robot.n:
            raise InputValueError(
                f"{caller}: no coordinate {item}; the {robot.n} coordinates are numbered from 0"
            )
        return item % int(robot.n)
    if item in names:
        return names.index(item)
    if item not in joints or robot.loop_solution == "newton":
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
            f"{caller}: joint {item} depends on {several}; fix coordinates by name instead"
        )
    return int(movers[0])


@functools.lru_cache(maxsize=64)
def follows(robot: RobotFacts) -> BoolArray:
    """Return a mask (n_theta, n) of the coordinates that move each main-chain joint."""
    if robot.reference is None:
        return np.asarray(np.array(robot.manifest.loops.coupling or np.eye(robot.n)) != 0)
    return following(robot.coordinates, robot.reference, robot.chain_D_q)


def following(
    coordinates: Sequence[Coordinate],
    reference: Reference,
    chain_D_q: Callable[[FloatArray], FloatArray],
) -> BoolArray:
    """Return a mask (n_theta, n) of the coordinates that move each joint, for closed-form loops."""
    # A joint that does not depend on a coordinate has a derivative of exactly 0.
    q = np.vstack([configurations(coordinates, reference), reference.q])
    return np.asarray((np.nan_to_num(chain_D_q(q)) != 0).any(0))
