"""Selects the functions that call no iterative solver.

Output languages other than C contain only functions without an iterative solver.
"""

import math
from collections.abc import Sequence

from ..derivation import Derivation
from ..model.coupling import Limits
from ..model.robot import SerialRobot
from ..terms.symbolic_function import SymbolicFunction

_START = 0.4
"""Coordinate value in examples of serial robots, if the limits allow it (radian, meter)."""


def printed_functions(derivation: Derivation) -> list[SymbolicFunction]:
    """Return the public functions that call no iterative solver."""
    return [f for f in derivation.functions if not (f.calls or f.role.is_intermediate)]


def missing_functions(derivation: Derivation, where: str = "C") -> str:
    """Return a sentence about the functions that only C contains, or an empty text.

    Args:
        derivation: The derivation of the robot.
        where: Name of the language or version that contains the functions, for the returned
            sentence.
    """
    solved = [*(f for f in derivation.functions if f.calls), *derivation.written]
    names = ", ".join(f.name for f in solved if not f.role.is_intermediate)
    return f"Only in {where}, because of an iterative solver: {names}." if names else ""


def coordinate_lines(derivation: Derivation) -> list[str]:
    """Return a line with index, name, kind and unit for each coordinate."""
    moved = enumerate(derivation.robot.coordinates)
    return [f"  q[{k}]  {joint.name} ({joint.kind}, {joint.unit})" for k, joint in moved]


def example_inverse(
    derivation: Derivation, printed: Sequence[SymbolicFunction]
) -> SymbolicFunction | None:
    """Return the first inverse kinematics function of a pose and fixed joints, or None."""
    robot = derivation.robot
    has_joints = isinstance(robot, SerialRobot) and not robot.couplings
    for function in printed:
        role, joints = function.role, len(function.inputs) - 1
        is_known = not joints or (has_joints and joints == len(role.fixed))
        if role.is_inverse and role.domain == "pose" and is_known:
            return function
    return None


def example_start(derivation: Derivation, distance: float = 0.0) -> list[float]:
    """Return example coordinates at which loops are closed and a serial arm is bent.

    Args:
        derivation: The derivation of the robot.
        distance: Smallest distance of a coordinate from its limits (radian, meter).
    """
    if derivation.hybrid is not None:
        return [round(value, 9) for value in derivation.hybrid.q_at_reference.tolist()]
    return [_within(c.limits, distance) for c in derivation.robot.coordinates]


def _within(limits: Limits, distance: float) -> float:
    low = -math.inf if limits[0] is None else float(limits[0]) + distance
    high = math.inf if limits[1] is None else float(limits[1]) - distance
    if low > _START or high < _START:
        middle = (low + high) / 2
        return round(middle if math.isfinite(middle) else max(low, min(high, _START)), 6)
    return _START
