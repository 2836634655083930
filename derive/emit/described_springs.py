"""Writes the masses and springs in the robot file of a calibrated arm.

The masses and the gravity torques are computed for the nominal arm with all joints at zero. The
runtime replaces ``$<coordinate>`` by the compliance of each coordinate.
"""

import json
from collections.abc import Iterator, Mapping

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..chain.poe import placement_matrix
from ..model.mechanism import Described
from ..model.placements import Placement
from ..model.robot import Joint, Load, PointMass, SerialRobot

FloatArray = NDArray[np.float64]


def load_template(robot: Described) -> str:
    """Return the gravity vector, the mass tables and the spring tables of a robot file as text.

    If the arm has no masses, the returned text is empty. For an arm with coupled or helical joints,
    the returned text contains no spring tables. In the robot file of a calibrated arm, link k is
    mounted on the k-th moving joint. With all joints of a calibrated arm at zero, the frame of each
    link coincides with the base frame.

    Args:
        robot: The description.
    """
    if not isinstance(robot, SerialRobot) or robot.load is None:
        return ""
    has_springs = not robot.couplings and all(joint.kind != "helical" for joint in robot.joints)
    springs = _springs(robot) if has_springs else ()
    gravity = f"gravity = {_row([_number(g) for g in robot.load.gravity])}"
    return "\n".join([gravity, *_masses(robot, robot.load), *springs]) + "\n"


def _masses(robot: SerialRobot, load: Load) -> Iterator[str]:
    _, links = _at_zero(robot)
    for k, joint in enumerate(robot.moving, 1):
        for point in load.masses:
            if point.link in links[joint.name]:
                at = _position(robot, point, links[joint.name])
                yield from ("", "[[masses]]", f'link = "link{k}"')
                yield from (f"mass = {_value(robot, point.mass)!r}", f"at = {_row(at)}")


def _springs(robot: SerialRobot) -> Iterator[str]:
    places, links = _at_zero(robot)
    for joint, T in zip(robot.coordinates, places, strict=True):
        mass, center = _weight(robot, links[joint.name])
        yield from ("", "[[springs]]", f"coordinate = {json.dumps(joint.name)}")
        yield f"compliance = ${joint.name}"
        yield f"axis = {_row(joint.direction * T[:3, 2])}"
        if joint.kind == "revolute":
            yield f"point = {_row(T[:3, 3])}"
        if mass:
            yield from (f"mass = {mass!r}", f"center = {_row(center)}")


def _at_zero(robot: SerialRobot) -> tuple[list[FloatArray], dict[str, dict[str, FloatArray]]]:
    T = _matrix(robot, robot.base)
    places: list[FloatArray] = []
    links: dict[str, dict[str, FloatArray]] = {}
    carrier: Joint | None = None
    for name, joint in zip(robot.link_names, robot.joints, strict=True):
        T = T @ _matrix(robot, joint.before)
        if joint.kind != "fixed":
            carrier = joint
            places.append(T)
        T = T @ _matrix(robot, joint.after)
        if carrier is not None:
            links.setdefault(carrier.name, {})[name] = T
    return places, links


def _weight(robot: SerialRobot, links: dict[str, FloatArray]) -> tuple[float, FloatArray]:
    mass, moment = 0.0, np.zeros(3)
    for point in robot.load.masses if robot.load else ():
        if point.link in links:
            own = _value(robot, point.mass)
            mass += own
            moment += own * _position(robot, point, links)
    return mass, moment / mass if mass else moment


def _position(robot: SerialRobot, point: PointMass, links: Mapping[str, FloatArray]) -> FloatArray:
    """Return the position of a mass in the base frame, with all joints at zero."""
    T = links[point.link]
    return np.asarray(T[:3, :3] @ [_value(robot, x) for x in point.at] + T[:3, 3])


def _matrix(robot: SerialRobot, placement: Placement) -> FloatArray:
    values = {p.symbol: p.value for p in robot.parameters}
    return np.array(sp.N(placement_matrix(placement).xreplace(values), 17), dtype=float)


def _value(robot: SerialRobot, number: sp.Expr) -> float:
    return _number(number.xreplace({p.symbol: p.value for p in robot.parameters}))


def _number(number: sp.Expr) -> float:
    return float(sp.N(number, 17))


def _row(values: FloatArray | list[float]) -> str:
    return f"[{', '.join(repr(float(value) + 0.0) for value in values)}]"
