"""A calibrated robot with loops as a robot file: the nominal file with the identified parameters.

The compiler closes the loops by Newton's method. The compiler infers the nominal structure from
the values; the inverse refines the nominal solutions.
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
"""Decimal places of a length in meters; a length that is 0 by design stays exactly 0."""
_DEGREE = 13
"""Decimal places of an angle in degrees (2e-15 rad); right angles stay exact."""


def mechanism_text(
    robot: Robot, p: FloatArray, name: str, source: str, nominal: str, rpy: Any
) -> str:
    """Return the text of the robot file of a calibrated robot with loops.

    Args:
        robot: The nominal robot, with parametric functions.
        p: The identified geometry.
        name: Name of the calibrated robot.
        source: Origin of the values, for the file.
        nominal: Name or file of the nominal robot; "" to omit it.
        rpy: Function that returns roll, pitch and yaw (3,) of a rotation matrix [rad].
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
    """Return whether any axis direction differs from nominal, so that loops are not planar."""
    return any(
        item.unit == "rad" and item.part in ("axis", "joint") and value != item.value
        for item, value in zip(robot.geometry, p, strict=True)
    )


def _row(values: FloatArray) -> str:
    return f"[{', '.join(repr(float(value) + 0.0) for value in values)}]"
