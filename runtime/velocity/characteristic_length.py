"""The characteristic length of a robot, which scales radians to meters.

The length L is the root mean square distance of the tip from the rotation axes of the coordinates,

    L^2 = mean over configurations and coordinates k of |v_k|^2 / |omega_k|^2

The vector (v_k, omega_k) is column k of the Jacobian at the tip. The mean is taken over 256
configurations that are evenly distributed within the limits. If no coordinate rotates the tool, L
is the root mean square of the linear rates of revolute coordinates, or 1 m without such rates.

Source:
    Angeles, Fundamentals of Robotic Mechanical Systems, for isotropic Jacobians.
"""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..call.capabilities import needs
from ..errors import InputValueError
from ..facts import RobotFacts
from ..size import configurations
from ..tolerances import TURNS


def length_of(J: FloatArray, turning: BoolArray) -> float:
    """Return the characteristic length [m] of Jacobians."""
    squared = (J**2).mean(0)
    linear, angular = squared[:3].sum(0), squared[3:].sum(0)
    turns_tool = angular > TURNS**2 * linear
    ratios = linear[turns_tool] / angular[turns_tool] if turns_tool.any() else linear[turning]
    return float(np.sqrt(ratios.mean())) if ratios.any() else 1.0


def _has_jacobian(robot: RobotFacts) -> bool:
    return not robot.functions.keys().isdisjoint(("jacobian_mixed", "velocity_relation"))


class LengthMethods(RobotFacts):
    """The characteristic length of a robot, and its sampled Jacobians."""

    @needs(when=_has_jacobian)  # type: ignore[prop-decorator]
    @functools.cached_property
    def characteristic_length(self) -> float:
        """The default length [m] that scales radians to meters.

        The characteristic length is the root mean square distance of the tip from the rotation axes
        of the coordinates, over 256 configurations within the limits.
        """
        turning = np.array([c.kind == "revolute" for c in self.coordinates])
        return length_of(self._samples, turning)

    @needs(when=_has_jacobian)  # type: ignore[prop-decorator]
    @functools.cached_property
    def _samples(self) -> FloatArray:
        if "jacobian_mixed" not in self.functions:
            return self._jacobian_at_reference()
        J = self.jacobian_mixed(configurations(self.coordinates, self.reference))
        closed = np.isfinite(J).all((-2, -1))
        if closed.any():
            return J[closed]
        middle = np.zeros(self.n) if self.reference is None else np.array(self.reference.q)
        return self.jacobian_mixed(middle)[None]

    def _reference_theta(self) -> FloatArray:
        assert self.reference is not None
        z = {v.name: k for k, v in enumerate(self.configuration_variables)}
        return np.array([self.reference.z[z[joint.name]] for joint in self.chain_joints])

    def _jacobian_at_reference(self) -> FloatArray:
        relation = self.manifest.with_role("velocity relation", "chain")
        assert relation is not None and self.reference is not None  # noqa: PT018
        at = self._reference_theta(), self.reference.q
        J_x, J_q = self.functions["velocity_relation"](*at)
        J = np.zeros((1, 6, self.n))
        J[0, list(relation.role.directions)] = np.linalg.pinv(J_x) @ J_q
        return J

    def _checked_length(self, method: str, length: float | None) -> float:
        if length is None:
            return self.characteristic_length
        if not (np.isfinite(length) and length > 0):
            raise InputValueError(
                f"{self.name}.{method}: characteristic_length must be positive, got {length!r}"
            )
        return float(length)
