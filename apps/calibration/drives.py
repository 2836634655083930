"""Transmissions and springs in a robot file: the relation of encoder readings to coordinates."""

from __future__ import annotations

import json
from string import Template

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

FloatArray = NDArray[np.float64]

_GAIN = "gain"


def transmissions_text(robot: Robot, p: FloatArray, turn: float) -> str:
    """Return the [[transmissions]] tables of inexact drives; "" if all drives are exact.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry.
        turn: One radian in the angle unit of the file.
    """
    laws: dict[str, dict[str, float]] = {}
    for item, value in zip(robot.geometry, p, strict=True):
        if item.part == "transmission" and value != item.value:
            field = item.name.removeprefix(f"{item.joint}_")
            number = value if field == _GAIN else value * turn
            laws.setdefault(item.joint, {})[field] = float(number)
    lines = []
    for joint, law in laws.items():
        lines += ["", "[[transmissions]]", f"coordinate = {json.dumps(joint)}"]
        lines += [f"{field} = {value!r}" for field, value in law.items()]
    return "\n".join([*lines, ""]) if lines else ""


def springs_text(robot: Robot, p: FloatArray) -> tuple[str, str]:
    """Return the gravity line and the spring tables; "" if all joints are rigid.

    Args:
        robot: The nominal arm, with parametric functions.
        p: The identified geometry.
    """
    compliances = {
        item.joint: float(value)
        for item, value in zip(robot.geometry, p, strict=True)
        if item.part == "compliance"
    }
    if not any(compliances.values()):
        return "", ""
    if not robot.manifest.robot_file:
        raise InputValueError(
            "joint compliances were identified, but a coordinate moves several joints or a screw "
            "joint; a robot file supports springs only for joints with a coordinate of their own"
        )
    text = Template(robot.manifest.robot_file).substitute(
        {joint: repr(value) for joint, value in compliances.items()}
    )
    gravity, springs = text.split("\n", 1)
    return f"{gravity}\n", springs
