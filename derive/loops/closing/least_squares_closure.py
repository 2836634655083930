"""Closes overconstrained loops in the least-squares sense.

Overconstrained loops have more equations than variables. For example, the pin joint that closes a
planar loop keeps the links in a plane, although the other joints already do so. In a parallelogram
linkage with three cranks, the third crank constrains the direction of the coupler a second time. On
a real robot, redundant constraints contradict each other slightly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.errors import DescriptionError
from ...model.mechanism import Closure, Mechanism, Strut
from ...model.tolerances import (
    MEASURED_STRUCTURE,
    NUMERICALLY_CLOSED,
    REPEATED_AS_BUILT,
    REPEATED_EQUATION,
)
from ..model.numeric_mechanism import NumericMechanism
from ..model.numeric_rows import NumericRows
from .actuation import overactuated_start, spare_actuators
from .closed_loops import ClosedLoops

Floats = NDArray[np.float64]
REPORTED = 0.05
"""Closure errors below this fraction of the largest closure error are not reported."""


@dataclass(frozen=True)
class LeastSquaresClosure:
    """Least-squares configuration of overconstrained loops that cannot all close exactly.

    Attributes:
        at: Joint and cylinder values by name (radian or meter) with the smallest sum of squared
            closure errors. Unless actuators are redundant, the actuated coordinates keep their
            reference values.
        repeated: Number of redundant constraints.
        closure_errors: Texts that describe the remaining closure errors, keyed by closure or strut
            name, with the largest error first.
        spare: Names of the closures and struts that can be omitted without adding a degree of
            freedom.
        actuators: Number of redundant actuators. With redundant actuators, the loops close only for
            some actuator values.
    """

    at: Mapping[str, float]
    repeated: int
    closure_errors: Mapping[str, str]
    spare: tuple[str, ...]
    actuators: int = 0

    def __str__(self) -> str:
        """Describe the redundant actuators, or the redundant constraints and the closure errors."""
        if self.actuators:
            return f"{self.actuators} more actuators than degrees of freedom"
        open_ = ", ".join(
            f"{name!r} {closure_error}" for name, closure_error in self.closure_errors.items()
        )
        many = "1 constraint is" if self.repeated == 1 else f"{self.repeated} constraints are"
        message = f"{many} redundant; smallest achievable closure errors: {open_}"
        if not self.spare:
            return message
        spare = " or ".join(map(repr, self.spare))
        return f"{message}; omitting {spare} adds no freedom"


def least_squares_closure(mechanism: Mechanism) -> LeastSquaresClosure | None:
    """Return the least-squares configuration of overconstrained loops near the reference.

    No configuration (None) is returned if all loops close, if no equation is redundant, or if a
    closure error exceeds typical manufacturing errors. None is also returned if the actuated
    coordinates are not independent.
    """
    bodies = NumericMechanism(mechanism)
    loop_joints = [loop_joint.name for loop_joint in mechanism.loop_joints]
    at = bodies.nearest(bodies.values, bodies.unknown, loop_joints)
    closure_errors = bodies.closure_errors(at)
    if bodies.all_closed(at, loop_joints) or not all(
        max(
            closure_errors[loop_joint.name].distance / bodies.size,
            closure_errors[loop_joint.name].turn,
        )
        <= MEASURED_STRUCTURE * _joints(mechanism, loop_joint)
        for loop_joint in mechanism.loop_joints
    ):
        return None
    rows = NumericRows(bodies)
    every, owners = rows.relative(at), np.array(rows.owners)
    J = every[:, [name in bodies.unknown for name in rows.names]]
    if _rank(J, REPEATED_EQUATION) < J.shape[1] or J.shape[0] == J.shape[1]:
        return None
    if _rank(every, REPEATED_AS_BUILT) > J.shape[1]:
        return None
    spare = tuple(
        name for name in loop_joints if _rank(J[owners != name], REPEATED_AS_BUILT) == J.shape[1]
    )
    message = _message(bodies, mechanism.loop_joints, at)
    return LeastSquaresClosure(at, J.shape[0] - J.shape[1], message, spare)


def overactuated(mechanism: Mechanism) -> LeastSquaresClosure | None:
    """Return the least-squares configuration of a platform with redundant actuators, else None."""
    try:
        spare = spare_actuators(ClosedLoops(mechanism))
    except DescriptionError:
        return None
    return (
        LeastSquaresClosure(overactuated_start(mechanism), spare, {}, (), spare) if spare else None
    )


def _joints(mechanism: Mechanism, loop_joint: Closure | Strut) -> int:
    """Return the number of joints in a loop, including the closing joint or strut."""
    one, other = (
        {joint.name for joint in mechanism.path_to(f.body)} for f in (loop_joint.a, loop_joint.b)
    )
    return len(one ^ other) + 1


def _rank(J: Floats, least: float) -> int:
    """Return the number of singular values above ``least`` times the largest singular value."""
    values = np.linalg.svd(J, compute_uv=False) if J.size else np.zeros(0)
    return int(np.sum(values > least * max(values, default=0.0)))


def _message(
    bodies: NumericMechanism, loop_joints: Sequence[Closure | Strut], at: Mapping[str, float]
) -> dict[str, str]:
    closure_errors = bodies.closure_errors(at)
    sizes = {
        name: closure_error.distance / bodies.size + closure_error.turn
        for name, closure_error in closure_errors.items()
    }
    widest = max(sizes.values())
    found = {}
    for loop_joint in sorted(loop_joints, key=lambda loop_joint: -sizes[loop_joint.name]):
        if sizes[loop_joint.name] < REPORTED * widest:
            continue
        closure_error, parts = closure_errors[loop_joint.name], []
        if closure_error.distance > NUMERICALLY_CLOSED * bodies.size:
            parts.append(f"{_distance(bodies, loop_joint, at)}")
        if closure_error.turn > NUMERICALLY_CLOSED:
            parts.append(f"{1e3 * closure_error.turn:.3g} mrad of misalignment")
        found[loop_joint.name] = " and ".join(parts)
    return found


def _distance(
    bodies: NumericMechanism, loop_joint: Closure | Strut, at: Mapping[str, float]
) -> str:
    """Describe the position error of a loop joint, for a pin along and across the pin axis."""
    closure_error = bodies.closure_errors(at)[loop_joint.name].distance
    if isinstance(loop_joint, Strut):
        return f"{1e3 * closure_error:.3g} mm in length"
    if loop_joint.kind != "pin":
        return f"{1e3 * closure_error:.3g} mm"
    A, _, d = bodies.ends(loop_joint, at)
    along = abs(float(A[:3, 2] @ d))
    across = float(np.sqrt(max(closure_error**2 - along**2, 0.0)))
    parts = [(along, "along its axis"), (across, "across its axis")]
    return " and ".join(
        f"{1e3 * v:.3g} mm {path}" for v, path in parts if v > REPORTED * closure_error
    )
