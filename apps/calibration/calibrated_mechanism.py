"""A calibrated robot with loops as a robot file: the nominal one with other numbers.

The compiler closes loops off their design by Newton's iteration, and leads the inverse from the
nominal structure that it finds behind the numbers.
"""

from __future__ import annotations

import json
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import Robot

FloatArray = NDArray[np.float64]

_METRE = 15
"""Decimals of a metre that are written: what is 0 in the design stays 0."""
_DEGREE = 13
"""Decimals of a degree that are written: 2e-15 rad, so that right angles stay right."""


def mechanism_text(
    robot: Robot, p: FloatArray, name: str, source: str, nominal: str, rpy: Any
) -> str:
    """The text of a robot file of a robot with loops.

    Args:
        robot: The nominal robot, with parametric functions.
        p: Its identified geometry.
        name: Name of the calibrated robot.
        source: Origin of the numbers, for the file.
        nominal: Name or file of the nominal robot; "" where the file shall name none.
        rpy: Roll, pitch and yaw (3,) of a rotation matrix [rad].
    """
    texts = {
        "name": json.dumps(name),
        "title": json.dumps(f"{robot.title}, calibrated"),
        "source": json.dumps(source),
        "closure": json.dumps("least squares" if _has_turned(robot, p) else "exact"),
    }
    for k, T in enumerate(robot.functions["parts_p"](p)):
        texts[f"xyz_{k}"] = _row(np.round(T[:3, 3], _METRE))
        texts[f"rpy_{k}"] = _row(np.round(np.degrees(rpy(T[:3, :3])), _DEGREE))
        texts[f"x_{k}"] = repr(float(T[0, 3]))
    text = Template(robot.manifest.robot_file).substitute(texts)
    return f"nominal = {json.dumps(nominal)}\n{text}" if nominal else text


def _has_turned(robot: Robot, p: FloatArray) -> bool:
    """Whether axes are turned: pins then hold rods out of their plane."""
    return any(
        item.unit == "rad" and item.part in ("axis", "joint") and value != item.value
        for item, value in zip(robot.geometry, p, strict=True)
    )


def _row(values: FloatArray) -> str:
    return f"[{', '.join(repr(float(value) + 0.0) for value in values)}]"
