"""Motion in velocity space: joint rates from a twist, joint accelerations from its derivative.

The twist is reached by damped least squares: with J' = sum sigma_i u_i v_i^T the Jacobian in pure
numbers (`manipulability`),

    qd = sum of sigma_i / (sigma_i^2 + lambda_i^2) v_i u_i^T V,
    lambda_i^2 = epsilon^2 - sigma_i^2  if sigma_i < epsilon = `damping_threshold`, else 0.

The twist is reached exactly in all directions that are not close to singular.

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
from ..errors import InputTypeError, InputValueError, ShapeError
from ..fixed import Fixed, fixed_coordinates
from . import _rates
from .manipulability import PART, ManipulabilityMethods, Metric, Part

Representation = Literal["space", "body", "mixed"]
Redundancy = Literal["minimum_norm", "limits", "manipulability"]

_NO_TICK = np.array(np.nan)
_SPATIAL = 6


@dataclass(frozen=True, slots=True)
class Rates:
    """Joint rates, and the twist that they give.

    Attributes:
        qd: (..., n) joint rates [rad/s or m/s].
        twist: (..., 6) the twist that they give, in the requested representation.
        scale: (...,) s in [0, 1]: the share of the twist that the limits allow. The result is s
            times the result without limits, in the same direction; where acceleration limits
            exclude this direction, as in a sharp turn, s belongs to the nearest allowed twist.
        limited: (..., n) whether a rate, acceleration or joint limit held the joint.
        min_singular_value: (...,) the smallest singular value, a pure number.
        damping_squared: (...,) lambda^2 of the smallest singular value, 0 without damping.
        singular_direction: (..., 6) twist of the smallest singular value, the direction that a
            singularity removes first, in the requested representation; (v / length, omega) has
            unit norm, with length the characteristic length. Its sign is arbitrary.
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
    """Joint accelerations, and the derivative of the twist that they give.

    Attributes:
        qdd: (..., n) joint accelerations [rad/s^2 or m/s^2].
        acceleration: (..., 6) the time derivative of the twist that they give, in the requested
            representation.
        scale: (...,) s in [0, 1]: the fraction of J qdd that the limits allow.
        limited, min_singular_value, damping_squared, singular_direction: As in `Rates`.
    """

    qdd: FloatArray
    acceleration: FloatArray
    scale: FloatArray
    limited: BoolArray
    min_singular_value: FloatArray
    damping_squared: FloatArray
    singular_direction: FloatArray


class VelocityMethods(ManipulabilityMethods):
    """The methods of a robot in velocity space."""

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
        """Joint rates that give the tool a twist: J qd = V, damped, and within all limits.

        Away from singularities and limits J qd = V to rounding. Near a singularity the law at the
        head of `rates.py` damps the direction that is being lost, and qd stays finite and bounded:
        its norm is at most the norm of (v / length, omega) divided by `damping_threshold`, with
        length the characteristic length, which also divides the rates of prismatic joints.

        Limits hold exactly for every twist. A joint that would pass its bound is held there, and
        the other joints take over as long as they can do so undamped; where they cannot, as in
        every arm without redundancy, the twist is scaled down and keeps its direction. Where
        acceleration limits exclude that direction, the result is the nearest allowed twist. The
        page "Motion in velocity space" of the manual has limits and fixed joints in detail.

        Args:
            q: (..., n) coordinates [rad or m].
            V: (..., 6) twist, linear first [m/s, rad/s]; or (..., 3), its linear or angular part
                alone, as `components` says.
            representation: The representation of V: "space", "body" or "mixed".
            components: The components of the twist that count, at the tip: "all", "linear" (the
                angular part of V is ignored) or "angular". The linear velocity at the tip follows
                from a spatial twist of six components only.
            redundancy: How surplus freedom is used, by rates in the null space. "minimum_norm": the
                smallest rates; "limits": towards the middle between the limits, down half the sum
                of squares of (q - middle) / half range over the joints with limits;
                "manipulability": up Yoshikawa's measure; a configuration (..., n): towards it.
            gain: Gain of this objective [1/s]: for a configuration, the fraction of the remaining
                difference per second.
            rate_limits: (..., n) or () greatest |qd| [rad/s or m/s].
            acceleration_limits: (..., n) or () greatest |qdd| [rad/s^2 or m/s^2]; requires
                `qd_previous` and `dt`.
            qd_previous: (..., n) joint rates of the previous tick [rad/s or m/s].
            dt: (...) duration of the rates [s].
            fixed: Coordinates that do not move, by names or indices; a joint of the main chain
                stands for the coordinate that moves it.
            damping_threshold: The singular value below which a direction is damped, a pure number.
            characteristic_length: The length [m] that makes metres and radians comparable;
                `robot.characteristic_length` if None.

        Returns:
            The rates, the twist that they give, damping and limits; NaN where an input is not
            finite or a loop is open.

        Raises:
            ShapeError: If a shape is wrong, or the leading dimensions do not broadcast.
            InputError: If an argument is not as described above.

        Source:
            The head of `rates.py`; Flacco, De Luca and Khatib, Motion control of redundant robots
            under joint constraints: saturation in the null space, 2012 (limits); Liegeois, 1977
            (secondary objective).
        """
        method = "joint_rates"
        rate, kept = self._fixed_limits(method, "rate_limits", rate_limits, fixed)
        self._check_options(method, representation, damping_threshold)
        metric = self._metric(method, components, characteristic_length, kept)
        if not (isinstance(gain, int | float) and 0 <= gain < np.inf):
            raise InputValueError(
                f"{self.name}.{method}: gain must be a number that is not negative, got {gain!r}"
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
        """Joint accelerations that give the tool's twist a time derivative: J qdd = A - J_dot qd.

        Damped and limited in the same way as `joint_rates`. The result is the smallest
        acceleration, so that a redundant robot keeps its self-motion.

        A fixed coordinate has the acceleration 0 exactly and keeps its rate, which is 0 if
        `joint_rates` fixes it too. An acceleration limit of 0 has the same effect.

        Args:
            q: (..., n) coordinates [rad or m].
            qd: (..., n) joint rates [rad/s or m/s].
            A: (..., 6) time derivative of the twist's components, linear first [m/s^2, rad/s^2]; or
                (..., 3), as V of `joint_rates`.
            representation: The representation of A: "space", "body" or "mixed".
            components: As in `joint_rates`.
            acceleration_limits: (..., n) or () greatest |qdd| [rad/s^2 or m/s^2].
            fixed: As in `joint_rates`.
            damping_threshold: As in `joint_rates`.
            characteristic_length: As in `joint_rates`.

        Returns:
            The accelerations, the derivative that they give, damping and limits; NaN where an input
            is not finite or a loop is open.

        Raises:
            ShapeError: If a shape is wrong, or the leading dimensions do not broadcast.
            InputError: If an argument is not as described above.
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
        """The fields of `Rates`."""
        origin, J = posed
        try:
            at_tip = twist if origin is None else _shifted(twist, origin)
            qd, reached, damping, sigma, direction, scale, limited = _rates.solve(
                J, at_tip, *bounds, secondary, metric.unit, metric.row, threshold, metric.rank
            )
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
        """The Jacobian at the tip, whose singular values are the same in all axes.

        Spatial twists refer to another point: the position of the tip comes with them, else None.
        """
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
        """Return the minimum and the maximum rates (..., n)."""
        method = "joint_rates"
        acceleration = self._limits(method, "acceleration_limits", acceleration_limits)
        before, tick = np.zeros(self.n), _NO_TICK
        if acceleration_limits is not None:
            if qd_previous is None or dt is None:
                raise InputTypeError(
                    f"{self.name}.{method}: acceleration_limits need qd_previous and dt as well"
                )
            before = self._reals(method, "qd_previous", qd_previous, (self.n,))
        if dt is not None:
            tick = self._reals(method, "dt", dt, ())
            if not (tick > 0).all():
                raise InputValueError(f"{self.name}.{method}: dt must be positive, got {dt!r}")
        limits = {"rate_limits": rate, "acceleration_limits": acceleration, "qd_previous": before}
        try:
            lower, upper = _rates.bounds(q, self.lower, self.upper, *limits.values(), tick)
        except ValueError:
            raise self._no_broadcast(method, q=q, **limits) from None
        return lower, upper

    def _null_space_rates(
        self, q: FloatArray, redundancy: object, gain: float, metric: Metric, fixed: tuple[int, ...]
    ) -> FloatArray:
        """Return joint rates down the gradient of the objective, in pure numbers."""
        weight = gain * metric.unit**2
        if isinstance(redundancy, str):
            if redundancy == "minimum_norm":
                return np.zeros(self.n)
            if redundancy == "manipulability":
                if ("hessian", "actuators", "") not in self._roles:
                    raise InputValueError(
                        f"{self.name}.joint_rates: its loops are solved by iteration, without the "
                        "derivative that manipulability needs; redundancy can be a configuration"
                    )
                J, H = self.jacobian_mixed(q), self.hessian_mixed(q)
                J[..., list(fixed)] = H[..., list(fixed), :] = 0
                _, upwards = _rates.gradient(J, H, metric.unit, metric.row, metric.rank)
                return np.asarray(weight * upwards)
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

    def _check_options(self, method: str, representation: str, threshold: float) -> None:
        if representation not in get_args(Representation):
            raise InputValueError(
                f'{self.name}.{method}: representation must be "space", "body" or "mixed", got '
                f"{representation!r}"
            )
        if not 0 < threshold < np.inf:
            raise InputValueError(
                f"{self.name}.{method}: damping_threshold must be positive, got {threshold!r}"
            )

    def _fixed_limits(
        self, method: str, name: str, given: ArrayLike | None, fixed: Fixed | None
    ) -> tuple[FloatArray, tuple[int, ...]]:
        """Limits (..., n), 0 for fixed coordinates, and the coordinates with 0 in every row."""
        limits = self._limits(method, name, given)
        if fixed is None and given is None:
            return limits, ()
        limits[..., fixed_coordinates(self, method, fixed)] = 0
        return limits, tuple(np.flatnonzero((limits == 0).reshape(-1, self.n).all(0)))

    def _twist(
        self, method: str, name: str, given: ArrayLike, components: Part, representation: str
    ) -> FloatArray:
        """Return a twist (..., 6) from its six components, or from the three that count."""
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
    """The twist of the body point displaced by p, in the same axes: v + omega x p."""
    omega = V[..., 3:]
    v = V[..., :3] + np.cross(omega, p)
    return np.concatenate(np.broadcast_arrays(v, omega), -1)
