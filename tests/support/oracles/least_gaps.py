"""Minimizes the sum of squared closure errors of a mechanism.

The closure errors follow only from the frames, closures and lengths of the robot description.
SciPy's ``least_squares`` starts the minimization near the tested configuration, and CasADi computes
exact derivatives of the closure errors.
"""

from collections.abc import Sequence

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from chasles.derive.model.mechanism import Closure, Strut
from chasles.derive.model.robot import Joint
from tests.support.oracles.multi_start import Multistart

START_OFFSET = 1e-3
"""Offset of the minimization's start from the tested configuration (radian or meter)."""
NEWTON_STEPS = 6
EXACT = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}


class LeastGaps:
    """Sum of squared closure errors of a mechanism as a function of its configuration."""

    def __init__(self, numbers: Multistart, names: Sequence[str], held: Sequence[str]) -> None:
        """Compile the closure errors of a mechanism and their derivatives.

        Args:
            numbers: The numeric mechanism.
            names: Names of the variables in a configuration, of which swing angles are ignored.
            held: Names of the joints and cylinders that keep their values.
        """
        symbols = {name: ca.SX.sym(name) for name in names}
        members = {*numbers.joints, *numbers.cylinders}
        self.free = [k for k, n in enumerate(names) if n in members and n not in held]
        left = ca.vertcat(*_gaps(numbers, symbols))
        u = ca.vertcat(*(symbols[names[k]] for k in self.free))
        slope, gradient = ca.jacobian(left, u), ca.gradient(ca.sumsqr(left) / 2, u)
        results = [left, slope, gradient, ca.jacobian(gradient, u)]
        self._at = ca.Function("gaps", [ca.vertcat(*symbols.values())], results)

    def least(self, z: np.ndarray) -> np.ndarray:
        """Return the free entries of z at a local minimum of the squared closure error near z."""

        def at(x: np.ndarray) -> np.ndarray:
            whole = z.copy()
            whole[self.free] = x
            return whole

        def gaps(x: np.ndarray) -> np.ndarray:
            return np.array(self._at(at(x))[0]).ravel()

        def slopes(x: np.ndarray) -> np.ndarray:
            return np.array(self._at(at(x))[1])

        x = least_squares(gaps, z[self.free] + START_OFFSET, slopes, **EXACT).x
        for _ in range(NEWTON_STEPS):
            _, _, gradient, hessian = self._at(at(x))
            x = x - np.linalg.solve(np.array(hessian), np.array(gradient).ravel())
        return x


def _gaps(numbers: Multistart, values: dict[str, ca.SX]) -> list[ca.SX]:
    """Return the closure errors in meters.

    Rotation errors are multiplied by the mechanism size.

    For a strut, only the length error counts, because the pins of the strut need not be parallel.
    """
    size = float(f"{numbers.size:.3g}")
    found = []
    for loop_joint in numbers.mechanism.loop_joints:
        A, B = (
            _body(numbers, frame.body, values) @ numbers.pose(frame.placement)
            for frame in (loop_joint.a, loop_joint.b)
        )
        d = B[:3, 3] - A[:3, 3]
        if isinstance(loop_joint, Strut):
            length = numbers.number(loop_joint.length) + values.get(loop_joint.name, 0.0)
            found.append(ca.norm_2(d) - length)
            continue
        if not isinstance(loop_joint, Closure) or loop_joint.kind != "pin":
            raise NotImplementedError(loop_joint)
        found += [d, size * (A[:3, :2].T @ B[:3, 2])]
    return found


def _body(numbers: Multistart, name: str, values: dict[str, ca.SX]) -> ca.SX:
    T = ca.SX.eye(4)
    for joint in numbers.mechanism.path_to(name):
        _, before, after = numbers.around(joint)
        motion = ca.SX.eye(4) if joint.kind == "fixed" else _motion(joint, values[joint.name])
        T = T @ before @ motion @ after
    return T


def _motion(joint: Joint, value: ca.SX) -> ca.SX:
    M, value = ca.SX.eye(4), joint.direction * value
    if joint.kind == "prismatic":
        M[2, 3] = value
        return M
    c, s = ca.cos(value), ca.sin(value)
    M[0, 0], M[0, 1], M[1, 0], M[1, 1] = c, -s, s, c
    return M
