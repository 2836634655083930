"""Values of redundancy parameters for `ik(T, fixed=...)`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

import chasles


def fixed_values(robot: chasles.Robot, values: Sequence[Any]) -> dict[str, Any]:
    """Return the values of the redundancy parameters, keyed by name."""
    return dict(zip((item.name for item in robot.redundancy), values, strict=True))


def fixed_at(robot: chasles.Robot, q: np.ndarray) -> dict[str, np.ndarray]:
    """Return the values of the redundancy parameters at configurations (..., n)."""
    joints = [joint.name for joint in robot.chain_joints]
    values = []
    for item in robot.redundancy:
        if item.name in robot.functions:
            values.append(robot.functions[item.name](q))
        elif robot.loops:
            values.append(robot.chain(q)[..., joints.index(item.name)])
        else:
            values.append(q[..., item.index])
    return fixed_values(robot, values)
