"""Joint rates from a twist, and joint accelerations from the derivative of the twist.

The damped least-squares solution, with the dimensionless Jacobian J' = sum sigma_i u_i v_i^T, is

    qd = sum of sigma_i / (sigma_i^2 + lambda_i^2) v_i u_i^T V,
    lambda_i^2 = epsilon^2 - sigma_i^2  if sigma_i < epsilon = `damping_threshold`, else 0.

The twist is exact in all directions that are not nearly singular.

Source:
    Nakamura and Hanafusa 1986 (damping); Maciejewski and Klein 1988 (single directions);
    Chiaverini, Siciliano and Egeland, Review of the damped least-squares inverse kinematics, 1994:
    lambda^2 = (1 - (sigma / epsilon)^2) lambda_max^2, here with lambda_max = epsilon.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray
from ..call.capabilities import needs
from ..call.threads import call_in_parts
from ..errors import InputTypeError, InputValueError, ShapeError
from ..fixed import Fixed, fixed_coordinates
from . import _rates
from .manipulability import COST, PART, ManipulabilityMethods, Metric, Part, gradient_of

Representation = Literal["space", "body", "mixed"]
Redundancy = Literal["minimum_norm", "limits", "manipulability"]

_NO_TICK = np.array(np.nan)
_SPATIAL = 6


@dataclass(frozen=True, slots=True)
class Rates:
    """Joint rates with the resulting twist.

    Attributes:
        qd: (..., n) joint rates [rad/s or m/s].
        twist: (..., 6) resulting twist, in the requested representation.
        scale: (...,) s in [0, 1], the fraction of the twist within the limits. The resulting twist
            has the direction of the requested twist, unless acceleration limits exclude this
            direction (a sharp turn).
        limited: (..., n) whether a rate, acceleration or joint limit is active.
        min_singular_value: (...,) the smallest singular value, dimensionless.
        damping_squared: (...,) squared damping factor lambda^2 that is applied to the smallest
            singular value, or 0 if no damping is needed.
        singular_direction: (..., 6) twist for the smallest singular value, in the requested
            representation. Near a singularity, the tool can hardly move along this twist. The
            vector (v / characteristic length, omega) has unit norm and a positive largest entry.
    """

    qd: FloatArray
    twist: FloatArray
    scale: FloatArray
    limited: BoolArray
    min_singular_value: FloatArray
    damping_squared: FloatArray
    singular_direction: FloatArray


@dataclass(frozen=True, slots=True)
class Accelerations:
    """Joint accelerations, and the resulting time derivative of the tool twist.

    Attributes:
        qdd: (..., n) joint accelerations [rad/s^2 or m/s^2].
        acceleration: (..., 6) resulting time derivative of the twist, in the requested
            representation.
        scale: (...,) s in [0, 1]; the limits permit only the fraction s of J qdd.
        limited: (..., n) whether the acceleration limit of the joint is active.
        min_singular_value: (...,) the smallest singular value, as in `Rates`.
        damping_squared: (...,) squared damping factor lambda^2 for the smallest singular value, as
            in `Rates`.
        singular_direction: (..., 6) twist for the smallest singular value, as in `Rates`.
    """

    qdd: FloatArray
    acceleration: FloatArray
    scale: FloatArray
    limited: BoolArray
    min_singular_value: FloatArray
    damping_squared: FloatArray
    singular_direction: FloatArray


class VelocityMethods(ManipulabilityMethods):
    """Robot methods for joint rates and accelerations."""

    @needs("jacobian_mixed", "jacobian_body")
    def joint_rates(
        self,
        q: ArrayLike,
        V: ArrayLike,
        *,
        representation: Representation = "mixed",
        components: Part = "all",
        redundancy: Redundancy | ArrayLike = "minimum_norm",
        gain: float = 1.0,
        rate_limits: ArrayLike | None = None,
        acceleration_limits: ArrayLike | None = None,
        qd_previous: ArrayLike | None = None,
        dt: ArrayLike | None = None,
        fixed: Fixed | None = None,
        damping_threshold: float = _rates.DAMPING_THRESHOLD,
        characteristic_length: float | None = None,
    ) -> Rates:
        """Return damped joint rates qd within all limits for a twist V of the tool, J qd = V.

        Away from singularities and limits, J qd = V up to rounding error. Near a singularity,
        damped least squares bounds the rates: |qd| <= |(v / length, omega)| / `damping_threshold`.
        In |qd|, the rates of prismatic joints are also divided by the characteristic length.

        A joint that would exceed a limit stays at the limit. The other joints compensate for this
        joint if this is possible without damping. Otherwise, the twist is scaled down and keeps its
        direction. If acceleration limits exclude the direction of V, the result is the nearest
        allowed twist. For details, see the page "Joint rates, singularities and manipulability".

        Args:
            q: (..., n) coordinates [rad or m].
            V: (..., 6) twist, linear first [m/s, rad/s]; or (..., 3), the linear or angular part
                that `components` selects.
            representation: The function that defines V: "space" (`twist_space`), "body"
                (`twist_body`) or "mixed" (`twist_mixed`).
            components: The controlled components of the twist at the tip: "all", "linear" (the
                angular part of V is ignored) or "angular". For "linear" components in the "space"
                representation, V must have all six components.
            redundancy: The objective of the null-space motion. "minimum_norm" minimizes the rates.
                "limits" moves joints towards the middle of their ranges, by the gradient of half
                the sum of ((q - middle) / half range)^2. "manipulability" increases Yoshikawa's
                measure. A configuration (..., n) [rad or m] is the target of the motion.
            gain: Gain of the objective [1/s]. For a target configuration, the gain is the fraction
                of the remaining difference that is removed per second.
            rate_limits: (..., n) or () maximum |qd| [rad/s or m/s]; by default unlimited.
            acceleration_limits: (..., n) or () maximum |qdd| [rad/s^2 or m/s^2], by default
                unlimited. Acceleration limits also require `qd_previous` and `dt`.
            qd_previous: (..., n) joint rates of the previous time step [rad/s or m/s].
            dt: (...) time step [s]. If `dt` is given, no joint exceeds its position limits within
                `dt`.
            fixed: Names or indices of coordinates with the rate 0. The name of a main-chain joint
                means the coordinate that moves it.
            damping_threshold: The dimensionless singular value below which a direction is damped.
            characteristic_length: The length [m] that scales radians to meters, by default
                `robot.characteristic_length`.

        Returns:
            Joint rates, the resulting twist, the damping and the active limits. All are NaN if an
            input is not finite or the loops do not close.

        Raises:
            ShapeError: If a shape is wrong, or the leading dimensions do not broadcast.
            InputError: If the type or the value of an argument is invalid.

        Source:
            Flacco, De Luca and Khatib, Motion control of redundant robots under joint constraints:
            saturation in the null space, 2012 (limits); Liegeois, 1977 (secondary objective).
        """
        method = "joint_rates"
        rate, kept = self._fixed_limits(method, "rate_limits", rate_limits, fixed)
        self._check_options(method, representation, damping_threshold)
        metric = self._metric(method, components, characteristic_length, kept)
        if not (isinstance(gain, int | float) and 0 <= gain < np.inf):
            raise InputValueError(
                f"{self.name}.{method}: gain must be a nonnegative number, got {gain!r}"
            )
        twist = self._twist(method, "V", V, components, representation)
        posed = self._at_tip(q, representation)
        q = np.asarray(q, np.float64)
        bounds = self._bounds(q, rate, acceleration_limits, qd_previous, dt)
        secondary = self._null_space_rates(q, redundancy, gain, metric, kept)
        return Rates(
            *self._solve(method, posed, twist, bounds, secondary, metric, damping_threshold)
        )

    @needs("acceleration_mixed")
    def joint_accelerations(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        A: ArrayLike,
        *,
        representation: Representation = "mixed",
        components: Part = "all",
        acceleration_limits: ArrayLike | None = None,
        fixed: Fixed | None = None,
        damping_threshold: float = _rates.DAMPING_THRESHOLD,
        characteristic_length: float | None = None,
    ) -> Accelerations:
        """Return joint accelerations qdd for an acceleration A of the tool, J qdd = A - J_dot qd.

        Damping, and scaling at the acceleration limits, are as for `joint_rates`. The joint
        accelerations have minimum norm, and do not stop a self-motion of a redundant robot.

        Args:
            q: (..., n) coordinates [rad or m].
            qd: (..., n) joint rates [rad/s or m/s].
            A: (..., 6) time derivative of the twist components, linear first [m/s^2, rad/s^2]; or
                (..., 3), the linear or angular part that `components` selects.
            representation: The function that defines A: "space" (`acceleration_space`), "body"
                (`acceleration_body`) or "mixed" (`acceleration_mixed`).
            components: The controlled components of A at the tip, as in `joint_rates`.
            acceleration_limits: (..., n) or () maximum |qdd| [rad/s^2 or m/s^2]; by default
                unlimited. A coordinate with the acceleration limit 0 keeps its rate exactly.
            fixed: Names or indices of coordinates with the acceleration 0, as in `joint_rates`.
            damping_threshold: The dimensionless singular value below which a direction is damped.
            characteristic_length: The length [m] that scales radians to meters, by default
                `robot.characteristic_length`.

        Returns:
            Joint accelerations, the resulting A, the damping and the active limits. All are NaN if
            an input is not finite or the loops do not close. Exceptions are as for `joint_rates`.
        """
        method = "joint_accelerations"
        limits, kept = self._fixed_limits(method, "acceleration_limits", acceleration_limits, fixed)
        self._check_options(method, representation, damping_threshold)
        metric = self._metric(method, components, characteristic_length, kept)
        wanted = self._twist(method, "A", A, components, representation)
        posed = self._at_tip(q, representation)
        none = np.zeros(self.n)
        without: FloatArray = self.functions[f"acceleration_{representation}"](q, qd, none)
        bounds = (none - limits, none + limits)
        try:
            wanted = wanted - without
        except ValueError:
            raise self._no_broadcast(method, A=wanted, qd=without) from None
        found = self._solve(method, posed, wanted, bounds, none, metric, damping_threshold)
        return Accelerations(found[0], found[1] + without, *found[2:])

    def _solve(
        self,
        method: str,
        posed: tuple[FloatArray | None, FloatArray],
        twist: FloatArray,
        bounds: tuple[FloatArray, FloatArray],
        secondary: FloatArray,
        metric: Metric,
        threshold: float,
    ) -> tuple[Any, ...]:
        origin, J = posed
        try:
            at_tip = twist if origin is None else _shifted(twist, origin)
            scales = metric.unit, metric.row, np.asarray(threshold), np.asarray(metric.rank)
            operands = J, at_tip, *bounds, secondary, *scales
            found = call_in_parts(_rates.solve, operands, (2, 1, 1, 1, 1, 1, 1, 0, 0), COST)
            qd, reached, damping, sigma, direction, scale, limited = found
        except ValueError:
            given = {"q": J[..., 0, :], "V" if method == "joint_rates" else "A": twist}
            if bounds[0].shape[:-1] not in {(), J.shape[:-2]}:
                given["limits"] = bounds[0]
            raise self._no_broadcast(method, **given) from None
        if origin is not None:
            reached, direction = _shifted(reached, -origin), _shifted(direction, -origin)
        return qd, reached, scale, limited, sigma, damping, direction

    def _at_tip(
        self, q: ArrayLike, representation: Representation
    ) -> tuple[FloatArray | None, FloatArray]:
        if representation == "mixed":
            return None, self.jacobian_mixed(q)
        if representation == "body":
            return None, self.jacobian_body(q)
        return self.fk(q)[..., :3, 3], self.jacobian_mixed(q)

    def _bounds(
        self,
        q: FloatArray,
        rate: FloatArray,
        acceleration_limits: ArrayLike | None,
        qd_previous: ArrayLike | None,
        dt: ArrayLike | None,
    ) -> tuple[FloatArray, FloatArray]:
        method = "joint_rates"
        acceleration = self._limits(method, "acceleration_limits", acceleration_limits)
        before, tick = np.zeros(self.n), _NO_TICK
        if acceleration_limits is not None:
            if qd_previous is None or dt is None:
                raise InputTypeError(
                    f"{self.name}.{method}: acceleration_limits also require qd_previous and dt"
                )
            before = self._reals(method, "qd_previous", qd_previous, (self.n,))
        if dt is not None:
            tick = self._reals(method, "dt", dt, ())
            if not (tick > 0).all():
                raise InputValueError(f"{self.name}.{method}: dt must be positive, got {dt!r}")
        limits = {"rate_limits": rate, "acceleration_limits": acceleration, "qd_previous": before}
        try:
            operands = q, self.lower, self.upper, *limits.values(), tick
            found = call_in_parts(_rates.bounds, operands, (1, 1, 1, 1, 1, 1, 0), COST)
        except ValueError:
            raise self._no_broadcast(method, q=q, **limits) from None
        return found[0], found[1]

    def _null_space_rates(
        self, q: FloatArray, redundancy: object, gain: float, metric: Metric, fixed: tuple[int, ...]
    ) -> FloatArray:
        """Return joint rates along the dimensionless gradient of the secondary objective."""
        weight = gain * metric.unit**2
        if isinstance(redundancy, str):
            if redundancy == "minimum_norm":
                return np.zeros(self.n)
            if redundancy == "manipulability":
                if ("hessian", "actuators", "") not in self._roles:
                    raise InputValueError(
                        f"{self.name}.joint_rates: loops solved by iteration have no Hessian for "
                        'redundancy="manipulability"; pass redundancy=<configuration> instead'
                    )
                J, H = self.jacobian_mixed(q), self.hessian_mixed(q)
                J[..., list(fixed)] = H[..., list(fixed), :] = 0
                return np.asarray(weight * gradient_of(J, H, metric))
            if redundancy == "limits":
                bounded = np.isfinite(self.lower) & np.isfinite(self.upper)
                lower, upper = np.where(bounded, (self.lower, self.upper), ([[-1.0], [1.0]]))
                middle, half = (lower + upper) / 2, (upper - lower) / 2
                return np.where(bounded, weight * (middle - q) / half**2, 0.0)
            raise InputValueError(
                f'{self.name}.joint_rates: redundancy must be "minimum_norm", "limits", '
                f'"manipulability" or a configuration (..., {self.n}), got {redundancy!r}'
            )
        target = self._reals("joint_rates", "redundancy", redundancy, (self.n,))
        try:
            return gain * (target - q)
        except ValueError:
            raise self._no_broadcast("joint_rates", q=q, redundancy=target) from None

    @needs("jacobian_mixed")
    def actuator_forces(
        self, q: ArrayLike, wrench: ArrayLike, *, representation: Representation = "mixed"
    ) -> FloatArray:
        """Return the actuator forces that are equivalent to a wrench on the tool: J^T wrench.

        The actuators have the same power as the wrench: `forces @ qd == wrench @ (J @ qd)`. If the
        environment exerts the opposite wrench on the tool, these actuator forces keep the robot in
        equilibrium. Gravity, friction and elasticity are neglected.

        Args:
            q: (..., n) coordinates [rad or m].
            wrench: (..., 6) force and torque on the tool [N, N m], force first.
            representation: Reference point and axes of the wrench: "mixed" (tip, base axes), "body"
                (tip, tip axes) or "space" (base origin, base axes).

        Returns:
            (..., n) torques [N m] and forces [N], positive in the direction of the coordinate.
        """
        self._check_representation("actuator_forces", representation)
        w = self._reals("actuator_forces", "wrench", wrench, (_SPATIAL,))
        J = self.functions[f"jacobian_{representation}"](q)
        return np.asarray((J.mT @ w[..., None])[..., 0])

    def _check_options(self, method: str, representation: str, threshold: float) -> None:
        self._check_representation(method, representation)
        if not 0 < threshold < np.inf:
            raise InputValueError(
                f"{self.name}.{method}: damping_threshold must be positive, got {threshold!r}"
            )

    def _check_representation(self, method: str, representation: str) -> None:
        if representation not in get_args(Representation):
            raise InputValueError(
                f'{self.name}.{method}: representation must be "space", "body" or "mixed", got '
                f"{representation!r}"
            )

    def _fixed_limits(
        self, method: str, name: str, given: ArrayLike | None, fixed: Fixed | None
    ) -> tuple[FloatArray, tuple[int, ...]]:
        limits = self._limits(method, name, given)
        if fixed is None and given is None:
            return limits, ()
        limits[..., fixed_coordinates(self, method, fixed)] = 0
        return limits, tuple(np.flatnonzero((limits == 0).reshape(-1, self.n).all(0)))

    def _twist(
        self, method: str, name: str, given: ArrayLike, components: Part, representation: str
    ) -> FloatArray:
        part = self._reals(method, name, given, ())
        has_three = components != "all" and (components, representation) != ("linear", "space")
        if not has_three or part.shape[-1:] != (3,):
            return self._reals(method, name, part, (_SPATIAL,))
        twist = np.zeros((*part.shape[:-1], _SPATIAL))
        twist[..., PART[components]] = part
        return twist

    def _no_broadcast(self, method: str, **arrays: FloatArray) -> ShapeError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        return ShapeError(f"{self.name}.{method}: leading dimensions do not broadcast: {shapes}")


def _shifted(V: FloatArray, p: FloatArray) -> FloatArray:
    omega = V[..., 3:]
    v = V[..., :3] + np.cross(omega, p)
    return np.concatenate(np.broadcast_arrays(v, omega), -1)
