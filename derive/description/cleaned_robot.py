"""Rounds the numbers of a robot description to exact values and lists every change.

The rules are in ``noise``. Noise is removed from lengths; rounded
angles and rounded directions become exact. Two joints with equal numbers in the file have equal
exact numbers, so that parallel axes stay parallel. In a robot with loops, the points of a body are
also compared with each other (``arrangement``). If the base is
rotated, the frames on the base are also compared with each other (``turned_base``).
"""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import overload

from ..model.cleaning import Cleaning
from ..model.mechanism import Closure, Described, Frame, Mechanism, Strut
from ..model.placements import Translation, Vector
from ..model.robot import SerialRobot
from ..model.tolerances import NOISE
from .arrangement import Distances, arranged
from .exact_numbers import ExactNumbers
from .pose_error import pose_error, robot_size
from .turned_base import on_turned_base, turned_base


@overload
def cleaned(robot: SerialRobot) -> SerialRobot: ...
@overload
def cleaned(robot: Mechanism) -> Mechanism: ...
def cleaned(robot: Described) -> Described:
    """Return the robot with exact numbers and a list of the changed numbers.

    Args:
        robot: The robot with the numbers as written in its file.

    Returns:
        The robot with exact numbers. The field ``cleaning`` of the robot lists the changes. For a
        serial robot, ``cleaning`` and ``notes`` also state the tool displacement due to the changed
        numbers. A robot with loops also keeps a copy with the unchanged numbers of its file.
    """
    return _mechanism(robot) if isinstance(robot, Mechanism) else _serial(robot)


def _serial(robot: SerialRobot) -> SerialRobot:
    work = ExactNumbers(_noise(robot))
    parameters = tuple(work.parameter(parameter) for parameter in robot.parameters)
    base = work.placement("base", robot.base)
    joints = tuple(work.joint(joint) for joint in robot.joints)
    tool = work.placement("tool", robot.tool)
    if not work.numbers:
        return robot
    result = replace(robot, parameters=parameters, base=base, joints=joints, tool=tool)
    cleaning = Cleaning(tuple(work.numbers), *pose_error(robot, result))
    return replace(
        result, cleaning=cleaning, notes=(*robot.notes, cleaning.line, *cleaning.sentences)
    )


@overload
def cleaned_with_warning(robot: SerialRobot, file: str) -> SerialRobot: ...
@overload
def cleaned_with_warning(robot: Mechanism, file: str) -> Mechanism: ...
def cleaned_with_warning(robot: Described, file: str) -> Described:
    """Return the robot with exact numbers, and warn of a large tool displacement.

    Args:
        robot: The robot with the numbers as written in its file.
        file: The name of the file.
    """
    result = cleaned(robot)
    if result.cleaning.warning:
        warnings.warn(f"{file}: {result.cleaning.warning}", stacklevel=3)
    return result


def _noise(robot: Described) -> Fraction:
    return Fraction(NOISE * (robot_size(robot) or 1.0))


def _mechanism(mechanism: Mechanism) -> Mechanism:
    written, noise = mechanism, _noise(mechanism)
    work = ExactNumbers(noise)
    turned = turned_base(mechanism, float(noise))
    if turned is not None:
        mechanism = on_turned_base(mechanism, turned, work)
    points = {
        body: [work.without_noise(point) for point in of] for body, of in _points(mechanism).items()
    }
    base = points.pop(mechanism.base_frame)
    work.points = arranged([base], turned.length if turned else float(noise))
    work.points = arranged(points.values(), float(noise)) | work.points
    exact = [[work.points.get(p, p) for p in of] for of in (base, *points.values())]
    distances = Distances(exact, float(noise))
    parameters = tuple(work.parameter(parameter) for parameter in mechanism.parameters)
    placed = mechanism.base if turned else work.placement("base", mechanism.base)
    joints = tuple(work.joint(joint) for joint in mechanism.joints)
    closures = tuple(_closure(work, closure) for closure in mechanism.closures)
    struts = tuple(_strut(work, strut, distances) for strut in mechanism.struts)
    tool = work.placement("tool", mechanism.tool)
    if not work.numbers:
        return mechanism
    return replace(
        mechanism,
        parameters=parameters,
        base=placed,
        joints=joints,
        closures=closures,
        struts=struts,
        tool=tool,
        cleaning=Cleaning(tuple(work.numbers)),
        as_written=written,
    )


def _closure(work: ExactNumbers, closure: Closure) -> Closure:
    return replace(closure, a=_frame(work, closure, "a"), b=_frame(work, closure, "b"))


def _strut(work: ExactNumbers, strut: Strut, distances: Distances) -> Strut:
    a, b = _frame(work, strut, "a"), _frame(work, strut, "b")
    return replace(strut, a=a, b=b, length=work.length(strut.name, strut.length, distances))


def _frame(work: ExactNumbers, loop_joint: Closure | Strut, end: str) -> Frame:
    frame: Frame = getattr(loop_joint, end)
    return replace(frame, placement=work.placement(f"{loop_joint.name}.{end}", frame.placement))


def _points(mechanism: Mechanism) -> Mapping[str, list[Vector]]:
    """Return, for each body, the points at which joints, closures or struts are attached."""
    found: dict[str, list[Vector]] = {body: [] for body in mechanism.bodies}
    for body, placement in mechanism.placed:
        if placement and isinstance(placement[0], Translation):
            found[body].append(placement[0].vector)
    return found
