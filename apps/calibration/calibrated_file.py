"""Robot files of calibrated robots.

The file of a calibrated serial robot contains the screw axes of the joints and the home tool pose.
Screw axes describe every serial chain exactly. The file of a calibrated robot with loops is the
nominal robot file with the identified parameters. The compiler infers the nominal robot from the
calibrated values. The inverse kinematics of a calibrated robot first computes the solutions of the
nominal robot. Newton's method then refines these solutions for the calibrated robot.
"""

from __future__ import annotations

import json
import math
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import Coordinate

from .parameters import nominal as nominal_of
from .shown_numbers import roll_pitch_yaw

_PITCH = 1e-12
"""Tolerance for rounding errors of axis directions [1] and screw pitches [m/rad]."""
_METER = 15
"""Number of decimal places to which lengths [m] are rounded. After this rounding, a length that is
0 by design is exactly 0."""
_DEGREE = 13
"""Number of decimal places to which angles [deg] are rounded, equivalent to 2e-15 rad. After this
rounding, an angle that is 90 degrees by design is exactly 90 degrees."""
_SPRINGS = "\n[[springs]]"
"""TOML header of the first `[[springs]]` table in a robot file, with the preceding line break."""
FloatArray = NDArray[np.float64]


def robot_file(robot: Robot, p: FloatArray, name: str, source: str, nominal: str = "") -> str:
    """Return the text of the robot file of a calibrated robot.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry.
        name: Name of the calibrated robot.
        source: Source of the values, as written to the file.
        nominal: Name or file of the nominal robot. For a calibrated robot with loops, the inverse
            kinematics solves the nominal robot first and then refines each solution. If `nominal`
            is empty, the compiler derives the nominal robot by rounding lengths to a grid.

    The gain and the periodic error of a drive are written as a `[[transmissions]]` table. The robot
    file represents the compliance of a joint as a spring. The functions of the calibrated robot
    expect true joint coordinates, not encoder readings. `coordinates_from_readings` and
    `readings_from_coordinates` convert between true coordinates and encoder readings.

    Raises:
        InputValueError: A coordinate of a serial robot moves several joints or a screw joint.
    """
    laws = [g.part in ("transmission", "coupling", "compliance") for g in robot.geometry]
    straight = np.where(laws, nominal_of(robot), p)
    if robot.kind != "serial":
        text = mechanism_text(robot, straight, name, source, nominal)
        return text + transmissions_text(robot, p, math.degrees(1))
    head, joints = _chain_text(robot, straight, name, source)
    gravity, load = load_text(robot, p)
    couplings = couplings_text(robot, p) if robot.manifest.loops.coupling else ""
    return head + gravity + joints + couplings + load + transmissions_text(robot, p, 1.0)


def _chain_text(robot: Robot, p: FloatArray, name: str, source: str) -> tuple[str, str]:
    """Return the header of a serial robot file, and its tool and joint tables.

    The geometry `p` contains nominal transmissions, couplings and compliances.
    """
    joints, zero, L = robot.chain_joints, np.zeros(robot.n), np.eye(robot.n)
    if robot.manifest.loops.coupling:
        if len(joints) != robot.n:
            raise InputValueError(
                f"{robot.name}: a joint depends on other joints; write the identified parameters "
                "into the file of the nominal robot"
            )
        zero = robot.actuators(np.zeros(robot.n))
        L = robot.actuators_D_chain(np.zeros(robot.n))
    T, J = robot.fk_p(zero, p), robot.jacobian_p(zero, p) @ L
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
    for coordinate, column in zip(joints, J.T, strict=True):
        lines += ["", "[[joints]]", f"name = {json.dumps(coordinate.name)}"]
        lines += _screw(coordinate, column, T[:3, 3]) + _limits(coordinate)
    return "\n".join(head) + "\n", "\n".join(lines) + "\n"


def couplings_text(robot: Robot, p: FloatArray) -> str:
    """Return the `[couplings]` and `[motors]` tables of a robot file.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry, including the ratios of the joint couplings.
    """
    identified = {
        (item.joint, item.name): float(value)
        for item, value in zip(robot.geometry, p, strict=True)
        if item.part == "coupling"
    }
    names, offsets = robot.coordinate_names, robot.chain(np.zeros(robot.n))
    lines, motors = ["", "[couplings]"], ["", "[motors]"]
    rows = zip(robot.chain_joints, robot.manifest.loops.coupling, offsets, strict=True)
    for joint, row, offset in rows:
        parts = {
            name: identified.get((joint.name, f"{joint.name}_per_{name}"), ratio)
            for name, ratio in zip(names, row, strict=True)
            if ratio != 0
        }
        if parts != {joint.name: 1.0} or offset != 0:
            parts |= {"offset": float(offset)} if offset else {}
            lines.append(
                f"{joint.name} = {{ {', '.join(f'{k} = {v!r}' for k, v in parts.items())} }}"
            )
            motors += [_motor(c) for c in robot.coordinates if c.name in parts]
    alone = {joint.name for joint in robot.chain_joints} - {line.split()[0] for line in lines[2:]}
    kept = [line for line in dict.fromkeys(motors[2:]) if line.split()[0] not in alone]
    return "\n".join([*lines, *motors[:2], *kept]) + "\n"


def _motor(coordinate: Coordinate) -> str:
    fields = [f'type = "{coordinate.kind}"', *_limits(coordinate)]
    return f"{coordinate.name} = {{ {', '.join(fields)} }}"


def _screw(coordinate: Coordinate, column: FloatArray, tool: FloatArray) -> list[str]:
    """Return the robot file fields of a joint axis from its mixed Jacobian column."""
    v, omega = column[:3], column[3:]
    if coordinate.kind == "prismatic":
        return ['type = "prismatic"', f"axis = {_row(v)}"]
    if abs(omega @ v) > _PITCH * np.linalg.norm(omega) or not math.isclose(
        np.linalg.norm(omega), 1, abs_tol=_PITCH
    ):
        raise InputValueError(
            f"{coordinate.name!r}: the coordinate moves several joints or a screw joint; write the "
            "identified parameters into the file of the nominal robot"
        )
    # A rotation about the joint axis gives the tool the twist (v, omega) with v = omega x (tool -
    # point). In this equation, `point` is the axis point nearest to the tool origin.
    return [f"axis = {_row(omega)}", f"point = {_row(tool + np.cross(omega, v))}"]


def _limits(coordinate: Coordinate) -> list[str]:
    if coordinate.lower is None or coordinate.upper is None:
        return []
    return [f"limits = {_row(np.array([coordinate.lower, coordinate.upper]))}"]


def _row(values: NDArray[np.floating[Any]]) -> str:
    return f"[{', '.join(repr(float(value) + 0.0) for value in values)}]"


def mechanism_text(robot: Robot, p: FloatArray, name: str, source: str, nominal: str) -> str:
    """Return the text of the robot file of a calibrated robot with loops.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry.
        name: Name of the calibrated robot.
        source: Source of the values, as written to the file.
        nominal: Name or file of the nominal robot, or "" to omit the line `nominal` of the robot
            file.
    """
    texts = {
        "name": json.dumps(name),
        "title": json.dumps(f"{robot.title}, calibrated"),
        "source": json.dumps(source),
        "closure": json.dumps("least squares" if _has_turned(robot, p) else "exact"),
    }
    for k, T in enumerate(robot.functions["parts_p"](p)):
        texts[f"xyz_{k}"] = _row(np.round(T[:3, 3], _METER))
        texts[f"rpy_{k}"] = _row(np.round(np.degrees(roll_pitch_yaw(T[:3, :3])), _DEGREE))
        texts[f"x_{k}"] = repr(float(T[0, 3]))
    text = Template(robot.manifest.robot_file).substitute(texts)
    return f"nominal = {json.dumps(nominal)}\n{text}" if nominal else text


def _has_turned(robot: Robot, p: FloatArray) -> bool:
    """Return whether the parameters `p` change any joint axis direction of the nominal robot."""
    return any(
        item.unit == "rad" and item.part in ("axis", "joint") and value != item.value
        for item, value in zip(robot.geometry, p, strict=True)
    )


def transmissions_text(robot: Robot, p: FloatArray, turn: float) -> str:
    """Return a `[[transmissions]]` table per drive with identified errors, or "" without errors.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry.
        turn: One radian, expressed in the angle unit of the robot file.
    """
    laws: dict[str, dict[str, float]] = {}
    for item, value in zip(robot.geometry, p, strict=True):
        if item.part == "transmission" and value != item.value:
            field = item.name.removeprefix(f"{item.joint}_")
            number = value if field == "gain" else value * turn
            laws.setdefault(item.joint, {})[field] = float(number)
    lines = []
    for joint, law in laws.items():
        lines += ["", "[[transmissions]]", f"coordinate = {json.dumps(joint)}"]
        lines += [f"{field} = {value!r}" for field, value in law.items()]
    return "\n".join([*lines, ""]) if lines else ""


def load_text(robot: Robot, p: FloatArray) -> tuple[str, str]:
    """Return two texts of a robot file: the gravity vector, and the masses with joint springs.

    For a robot without masses, the function returns two empty strings. If all joints are rigid, the
    text with the masses contains no springs.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry.
    """
    compliances = {
        item.joint: repr(float(value))
        for item, value in zip(robot.geometry, p, strict=True)
        if item.part == "compliance"
    }
    gravity, line, tables = robot.manifest.robot_file.partition("\n")
    masses, *springs = tables.partition(_SPRINGS)
    if not any(map(float, compliances.values())):
        return gravity + line, masses
    if not springs[0]:
        raise InputValueError(
            "joint compliances were identified, but a coordinate moves several joints or a screw "
            "joint; a robot file supports springs only for joints with a coordinate of their own"
        )
    return gravity + line, masses + Template("".join(springs)).substitute(compliances)
