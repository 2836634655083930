"""Robot functions with automatic differentiation, and solutions of the inverse kinematics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from chasles import InputValueError, Robot


class Solutions(NamedTuple):
    """All solutions of the inverse kinematics.

    Each solution slot contains one solution or is empty.

    Attributes:
        q: (..., slots, n) coordinates [rad or m].
        residual: (..., slots) deviation of `fk(q)` from the target, NaN in an empty solution slot.
        margin: (..., slots) margin of each solution, as in `chasles.Solutions`.
    """

    q: Any
    residual: Any
    margin: Any


@dataclass(frozen=True)
class DifferentiableArm:
    """Differentiable functions of a robot. Leading dimensions of the arrays are batch dimensions.

    Attributes:
        robot: The robot.
        fk: `fk(q)` returns poses (..., 4, 4).
        jacobian: `jacobian(q)` returns mixed Jacobians (..., 6, n): twists (v, omega) of the tool's
            origin, in base axes.
        hessian: `hessian(q)` returns derivatives (..., 6, n, n) of the Jacobian. The derivatives of
            the Jacobian cannot be differentiated again.
        ik: `ik(T)` returns `Solutions`. For a robot with redundancy parameters, call
            `ik(T, *fixed)`. The derivatives of q follow from the inverse Jacobian. The derivatives
            are NaN at a singular solution, and 0 in slots without a solution. The derivatives of
            residual and margin are 0.
    """

    robot: Robot
    fk: Callable[..., Any]
    jacobian: Callable[..., Any]
    hessian: Callable[..., Any]
    ik: Callable[..., Solutions]


def fixed_coordinates(robot: Robot) -> tuple[int, ...]:
    """Return the indices of the coordinates that `ik` needs in addition to the pose.

    Raises:
        InputValueError: `ik` needs a value that is not a coordinate, for example a swivel angle.
    """
    indices = [item.index for item in robot.redundancy]
    if None in indices:
        raise InputValueError(f"{robot.name}: an input of ik is an angle that is not a coordinate")
    return tuple(index for index in indices if index is not None)
