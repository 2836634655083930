"""A calibrated robot as a robot file: the screw axes of its joints and its home tool pose.

Screw axes describe every chain, whatever convention the nominal file uses, without rounding.
The compiler infers the nominal structure from the screw axes; the inverse starts from the solutions
of this structure.
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
    """Return the text of the robot file of a calibrated robot.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry.
        name: Name of the calibrated robot.
        source: Origin of the values, for the file.
        nominal: Name or file of the nominal robot. The inverse of a robot with loops refines its
            solutions; without it, the compiler rounds lengths to a grid.

    Gains and periodic errors of drives become transmissions; joint compliances become springs. The
    functions of the calibrated robot expect true coordinates. `coordinates_from_readings` and
    `readings_from_coordinates` convert between true coordinates and encoder readings.

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
    """Return the head and the tables of the file of a serial robot with exact drives."""
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
    """Return the axis and point of a joint from its column of the mixed Jacobian."""
    v, omega = column[:3], column[3:]
    if coordinate.kind == "prismatic":
        return ['type = "prismatic"', f"axis = {_row(v)}"]
    if abs(omega @ v) > _PITCH * np.linalg.norm(omega) or not math.isclose(
        np.linalg.norm(omega), 1, abs_tol=_PITCH
    ):
        raise InputValueError(
            f"coordinate {coordinate.name!r} moves several joints or a screw joint; write the "
            "identified parameters into the file of the nominal robot"
        )
    # v = omega x (tool - point); point is the point of the axis nearest to the tool origin.
    return [f"axis = {_row(omega)}", f"point = {_row(tool + np.cross(omega, v))}"]


_PITCH = 1e-12
"""Tolerance for rounding errors in the pitch of a revolute joint [m/rad] and in |axis| = 1."""


def _limits(coordinate: Coordinate) -> list[str]:
    if coordinate.lower is None or coordinate.upper is None:
        return []
    return [f"limits = {_row(np.array([coordinate.lower, coordinate.upper]))}"]


def _row(values: FloatArray) -> str:
    return f"[{', '.join(repr(float(value)) for value in values)}]"
