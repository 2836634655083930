"""A calibrated robot as a robot file: the screws of its joints and the pose of its tool at zero.

Screw axes describe any chain, however its nominal description was written, and keep every digit.
The compiler finds the nominal structure behind them, from which the inverse starts.
"""

from __future__ import annotations

import json
import math

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import Coordinate

from .calibrated_mechanism import mechanism_text
from .drives import springs_text, transmissions_text
from .parameters import nominal as nominal_of
from .shown_numbers import roll_pitch_yaw

FloatArray = NDArray[np.float64]


def robot_file(robot: Robot, p: FloatArray, name: str, source: str, nominal: str = "") -> str:
    """The text of a robot file.

    Args:
        robot: The nominal robot, with parametric functions.
        p: Its identified geometry.
        name: Name of the calibrated robot.
        source: Origin of the numbers, for the file.
        nominal: Name or file of the nominal robot, from which the inverse of a robot with loops is
            led; without it lengths on a grid are tried.

    Gains and waves of drives become transmissions, and joint compliances become springs. The
    functions of the calibrated robot take true coordinates; its `coordinates_from_readings` and
    `readings_from_coordinates` convert.

    Raises:
        InputValueError: A coordinate moves several joints.
    """
    laws = [g.part in ("transmission", "compliance") for g in robot.geometry]
    straight = np.where(laws, nominal_of(robot), p)
    if robot.kind != "serial":
        text = mechanism_text(robot, straight, name, source, nominal, roll_pitch_yaw)
        return text + transmissions_text(robot, p, math.degrees(1))
    head, joints = _chain_text(robot, straight, name, source)
    gravity, springs = springs_text(robot, p)
    return head + gravity + joints + springs + transmissions_text(robot, p, 1.0)


def _chain_text(robot: Robot, p: FloatArray, name: str, source: str) -> tuple[str, str]:
    """The robot file of a serial robot whose drives run true: its head and its tables."""
    zero = np.zeros(robot.n)
    T, J = robot.fk_p(zero, p), robot.jacobian_p(zero, p)
    head = [
        f"name = {json.dumps(name)}",
        f"title = {json.dumps(f'{robot.title}, calibrated')}",
        f"source = {json.dumps(source)}",
        'convention = "poe"',
        'units = { length = "m", angle = "rad" }',
    ]
    lines = [
        "",
        "[tool]",
        f"xyz = {_row(T[:3, 3])}",
        f"rpy = {_row(roll_pitch_yaw(T[:3, :3]))}",
    ]
    for coordinate, column in zip(robot.coordinates, J.T, strict=True):
        lines += ["", "[[joints]]", f"name = {json.dumps(coordinate.name)}"]
        lines += _screw(coordinate, column, T[:3, 3]) + _limits(coordinate)
    return "\n".join(head) + "\n", "\n".join(lines) + "\n"


def _screw(coordinate: Coordinate, column: FloatArray, tool: FloatArray) -> list[str]:
    """Axis and point of a joint from its column of the mixed Jacobian."""
    v, omega = column[:3], column[3:]
    if coordinate.kind == "prismatic":
        return ['type = "prismatic"', f"axis = {_row(v)}"]
    if abs(omega @ v) > _PITCH * np.linalg.norm(omega) or not math.isclose(
        np.linalg.norm(omega), 1, abs_tol=_PITCH
    ):
        raise InputValueError(
            f"coordinate {coordinate.name!r} moves several joints, or one with a pitch; write the "
            "identified numbers into the robot's own file"
        )
    # v = omega x (tool - point), with the point that is nearest to the tool's origin.
    return [f"axis = {_row(omega)}", f"point = {_row(tool + np.cross(omega, v))}"]


_PITCH = 1e-12
"""Largest advance of a turning joint along its axis that is rounding [m], and likewise of the
length of its axis."""


def _limits(coordinate: Coordinate) -> list[str]:
    if coordinate.lower is None or coordinate.upper is None:
        return []
    return [f"limits = {_row(np.array([coordinate.lower, coordinate.upper]))}"]


def _row(values: FloatArray) -> str:
    return f"[{', '.join(repr(float(value)) for value in values)}]"
