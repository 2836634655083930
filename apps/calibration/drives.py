"""Drives and springs in a robot file: the laws between coordinates as shown and true ones."""

from __future__ import annotations

import json
from string import Template

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

FloatArray = NDArray[np.float64]

_GAIN = "gain"


def transmissions_text(robot: Robot, p: FloatArray, turn: float) -> str:
    """The tables of drives that do not run true; "" where all do.

    Args:
        robot: The nominal robot, with parametric functions.
        p: Its identified geometry.
        turn: Radian, in the file's unit of angles.
    """
    laws: dict[str, dict[str, float]] = {}
    for item, value in zip(robot.geometry, p, strict=True):
        if item.part == "transmission" and value != item.value:
            field = item.name.removeprefix(f"{item.of}_")
            laws.setdefault(item.of, {})[field] = float(value if field == _GAIN else value * turn)
    lines = []
    for of, law in laws.items():
        lines += ["", "[[transmissions]]", f"of = {json.dumps(of)}"]
        lines += [f"{field} = {value!r}" for field, value in law.items()]
    return "\n".join([*lines, ""]) if lines else ""


def springs_text(robot: Robot, p: FloatArray) -> tuple[str, str]:
    """The line of gravity, and the tables of the springs; "" where all joints are rigid.

    Args:
        robot: The nominal arm, with parametric functions.
        p: Its identified geometry.
    """
    compliances = {
        item.of: float(value)
        for item, value in zip(robot.geometry, p, strict=True)
        if item.part == "compliance"
    }
    if not any(compliances.values()):
        return "", ""
    if not robot.manifest.robot_file:
        raise InputValueError(
            "springs were identified, and a coordinate moves several joints, or one with a pitch; "
            "a robot file has springs of joints that move alone"
        )
    text = Template(robot.manifest.robot_file).substitute(
        {of: repr(value) for of, value in compliances.items()}
    )
    gravity, springs = text.split("\n", 1)
    return f"{gravity}\n", springs
