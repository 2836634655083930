"""Gains and waves of drives in a robot file: the transmissions of its coordinates."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_GAIN = "gain"


def transmissions_text(robot: Any, p: FloatArray, turn: float) -> str:
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
