"""Motion in velocity space: joint rates from a twist, joint accelerations from its derivative.

The twist is reached by damped least squares: with J' = sum sigma_i u_i v_i^T the Jacobian in pure
numbers (`manipulability`),

    qd = sum of sigma_i / (sigma_i^2 + lambda_i^2) v_i u_i^T V,
    lambda_i^2 = damping^2 - sigma_i^2  where sigma_i < damping, else 0.

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
from numpy.typing import ArrayLike, NDArray

from ..call.capabilities import needs
from ..call.validation import real_array
from ..errors import InputTypeError, InputValueError, ShapeError
from ..locks import Lock, locked_coordinates
from . import _rates
from .manipulability import ManipulabilityMethods, Metric, Rows

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Representation = Literal["space", "body", "mixed"]

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
        smallest: (...,) the smallest singular value, a pure number.
        damping: (...,) its lambda^2, 0 where nothing is damped.
        direction: (..., 6) its twist, the first direction to be lost, in the requested
            representation; (v / length, omega) has unit norm. Its sign is arbitrary.
    """

    qd: FloatArray
    twist: FloatArray
    scale: FloatArray
    limited: BoolArray
    smallest: FloatArray
    damping: FloatArray
    direction: FloatArray


@dataclass(frozen=True, slots=True)
class Accelerations:
    """Joint accelerations, and the derivative of the twist that they give.

    Attributes:
        qdd: (..., n) joint accelerations [rad/s^2 or m/s^2].
        acceleration: (..., 6) the time derivative of the twist that they give, in the requested
            representation.
        scale: (...,) s in [0, 1]: the share of J qdd that the limits allow.
        limited: (..., n) whether the acceleration limit held the joint.
        smallest: (...,) the smallest singular value, a pure number.
        damping: (...,) its lambda^2, 0 where nothing is damped.
        direction: (..., 6) its twist, as in `Rates`.
    """

    qdd: FloatArray
    acceleration: FloatArray
    scale: FloatArray
    limited: BoolArray
    smallest: FloatArray
    damping: FloatArray
    direction: FloatArray


class VelocityMethods(ManipulabilityMethods):
    """The methods of a robot in velocity space."""

    @needs("jacobian_mixed", "jacobian_body")
    def joint_rates(
        self,
        q: ArrayLike,
        V: ArrayLike,
        *,
        representation: Representation = "mixed",
        rows: Rows = "all",
        secondary: Literal["limits", "manipulability"] | ArrayLike | None = None,
        gain: float = 1.0,
        rate_limits: ArrayLike | None = None,
        acceleration_limits: ArrayLike | None = None,
        previous: ArrayLike | None = None,
        dt: ArrayLike | None = None,
        lock: Lock | None = None,
        damping: float = _rates.DAMPING,
        length: float | None = None,
    ) -> Rates:
        """Joint rates that give the tool a twist: J qd = V, damped, and within all limits.

        Away from singularities and limits J qd = V to rounding. Near a singularity the law at the
        head of `rates.py` damps the direction that is being lost, and qd stays finite and bounded:
        its norm is at most that of (v / length, omega) divided by `damping` (with rates of sliders
        divided by length too).

        Limits hold exactly for every twist. A joint that would pass its bound is held there, and
        the other joints take over as long as they can do so undamped; where they cannot, as in
        every arm without redundancy, the twist is scaled down and keeps its direction. Where
        acceleration limits exclude that direction, the result is the nearest allowed twist. The
        page "Motion in velocity space" of the manual has limits and locks in detail.

        The null space of a redundant robot serves a secondary objective without effect on the task:
        joint rates down the gradient of the objective, projected to the null space.

        Args:
            q: (..., n) coordinates [rad or m].
            V: (..., 6) twist, linear first [m/s, rad/s].
            representation: The representation of V: "space", "body" or "mixed".
            rows: The components of the twist that count, at the tip: "all", "linear" (the other
                components of V are ignored) or "angular".
            secondary: "limits": towards the middle between the limits, down half the sum of squares
                of (q - middle) / half range over the joints with limits; "manipulability": up
                Yoshikawa's measure; coordinates (..., n): towards that posture; None: the smallest
                rates.
            gain: Gain of the secondary objective [1/s]: for a posture, the share of the remaining
                way per second.
            rate_limits: (..., n) or () greatest |qd| [rad/s or m/s].
            acceleration_limits: (..., n) or () greatest |qdd| [rad/s^2 or m/s^2]; requires
                `previous` and `dt`.
            previous: (..., n) joint rates of the previous tick [rad/s or m/s].
            dt: (...) duration of the rates [s].
            lock: Coordinates that do not move, by names or indexes; a joint of the main chain
                stands for the coordinate that moves it.
            damping: The singular value below which a direction is damped, a pure number.
            length: The characteristic length [m] that makes metres and radians comparable;
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
        rate, locked = self._locked_limits(method, "rate_limits", rate_limits, lock)
        metric = self._checked(method, representation, rows, damping, length, locked)
        if not (isinstance(gain, int | float) and 0 <= gain < np.inf):
            raise InputValueError(
                f"{self.name}.{method}: gain must be a number that is not negative, got {gain!r}"
            )
        twist = self._reals(method, "V", V, (_SPATIAL,))
        posed = self._at_tip(q, representation)
        q = np.asarray(q, np.float64)
        bounds = self._bounds(q, rate, acceleration_limits, previous, dt)
        wanted = np.zeros(self.n)
        if secondary is not None:
            wanted = self._secondary(q, secondary, gain, metric, locked)
        return Rates(*self._solve(method, posed, twist, bounds, wanted, metric, damping))

    @needs("acceleration_mixed")
    def joint_accelerations(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        A: ArrayLike,
        *,
        representation: Representation = "mixed",
        rows: Rows = "all",
        acceleration_limits: ArrayLike | None = None,
        lock: Lock | None = None,
        damping: float = _rates.DAMPING,
        length: float | None = None,
    ) -> Accelerations:
        """Joint accelerations that give the tool's twist a time derivative: J qdd = A - J_dot qd.

        Damped and limited in the same way as `joint_rates`. The result is the smallest
        acceleration, so that a redundant robot keeps its self-motion.

        A locked coordinate has the acceleration 0 exactly and keeps its rate, which is 0 where
        `joint_rates` locks it too; the others are the whole arm. An acceleration limit of 0 is a
        lock.

        Args:
            q: (..., n) coordinates [rad or m].
            qd: (..., n) joint rates [rad/s or m/s].
            A: (..., 6) time derivative of the twist's components, linear first [m/s^2, rad/s^2].
            representation: The representation of A: "space", "body" or "mixed".
            rows: As in `joint_rates`.
            acceleration_limits: (..., n) or () greatest |qdd| [rad/s^2 or m/s^2].
            lock: As in `joint_rates`.
            damping: As in `joint_rates`.
            length: As in `joint_rates`.

        Returns:
            The accelerations, the derivative that they give, damping and limits; NaN where an input
            is not finite or a loop is open.

        Raises:
            ShapeError: If a shape is wrong, or the leading dimensions do not broadcast.
            InputError: If an argument is not as described above.
        """
        method = "joint_accelerations"
        most, locked = self._locked_limits(method, "acceleration_limits", acceleration_limits, lock)
        metric = self._checked(method, representation, rows, damping, length, locked)
        asked = self._reals(method, "A", A, (_SPATIAL,))
        posed = self._at_tip(q, representation)
        none = np.zeros(self.n)
        without: FloatArray = self.functions[f"acceleration_{representation}"](q, qd, none)
        bounds = (none - most, none + most)
        try:
            asked = asked - without
        except ValueError:
            raise self._no_broadcast(method, A=asked, qd=without) from None
        found = self._solve(method, posed, asked, bounds, none, metric, damping)
        return Accelerations(found[0], found[1] + without, *found[2:])

    def _solve(
        self,
        method: str,
        posed: tuple[FloatArray | None, FloatArray],
        twist: FloatArray,
        bounds: tuple[FloatArray, FloatArray],
        wanted: FloatArray,
        metric: Metric,
        damping: float,
    ) -> tuple[Any, ...]:
        """The fields of `Rates`."""
        origin, J = posed
        try:
            at_tip = twist if origin is None else _shifted(twist, origin)
            qd, reached, damped, smallest, direction, scale, limited = _rates.solve(
                J, at_tip, *bounds, wanted, metric.unit, metric.row, damping, metric.rank
            )
        except ValueError:
            given = {"q": J[..., 0, :], "V" if method == "joint_rates" else "A": twist}
            if bounds[0].shape[:-1] not in {(), J.shape[:-2]}:
                given["limits"] = bounds[0]
            raise self._no_broadcast(method, **given) from None
        if origin is not None:
            reached, direction = _shifted(reached, -origin), _shifted(direction, -origin)
        return qd, reached, scale, limited, smallest, damped, direction

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
        previous: ArrayLike | None,
        dt: ArrayLike | None,
    ) -> tuple[FloatArray, FloatArray]:
        """The least and the greatest rates (..., n)."""
        method = "joint_rates"
        acceleration = self._limits(method, "acceleration_limits", acceleration_limits)
        before, tick = np.zeros(self.n), _NO_TICK
        if acceleration_limits is not None:
            if previous is None or dt is None:
                raise InputTypeError(
                    f"{self.name}.{method}: acceleration_limits need previous and dt as well"
                )
            before = self._reals(method, "previous", previous, (self.n,))
        if dt is not None:
            tick = self._reals(method, "dt", dt, ())
            if not (tick > 0).all():
                raise InputValueError(f"{self.name}.{method}: dt must be positive, got {dt!r}")
        try:
            least, greatest = _rates.bounds(
                q, self.lower, self.upper, rate, acceleration, before, tick
            )
        except ValueError:
            raise self._no_broadcast(
                method, q=q, rate_limits=rate, acceleration_limits=acceleration, previous=before
            ) from None
        return least, greatest

    def _secondary(
        self,
        q: FloatArray,
        secondary: object,
        gain: float,
        metric: Metric,
        locked: tuple[int, ...],
    ) -> FloatArray:
        """Joint rates down the gradient of the objective, in pure numbers."""
        weight = gain * metric.unit**2
        if isinstance(secondary, str):
            if secondary == "manipulability":
                if ("hessian", "actuators", "") not in self._roles:
                    raise InputValueError(
                        f"{self.name}.joint_rates: its loops are solved by iteration, without the "
                        "derivative that manipulability needs; secondary can be a posture"
                    )
                J, H = self.jacobian_mixed(q), self.hessian_mixed(q)
                J[..., list(locked)] = H[..., list(locked), :] = 0
                _, upwards = _rates.gradient(J, H, metric.unit, metric.row, metric.rank)
                return np.asarray(weight * upwards)
            if secondary == "limits":
                bounded = np.isfinite(self.lower) & np.isfinite(self.upper)
                lower, upper = np.where(bounded, (self.lower, self.upper), ([[-1.0], [1.0]]))
                middle, half = (lower + upper) / 2, (upper - lower) / 2
                return np.where(bounded, weight * (middle - q) / half**2, 0.0)
            raise InputValueError(
                f'{self.name}.joint_rates: secondary must be "limits", "manipulability" or '
                f"coordinates (..., {self.n}), got {secondary!r}"
            )
        posture = self._reals("joint_rates", "secondary", secondary, (self.n,))
        try:
            return gain * (posture - q)
        except ValueError:
            raise self._no_broadcast("joint_rates", q=q, secondary=posture) from None

    def _checked(
        self,
        method: str,
        representation: Representation,
        rows: Rows,
        damping: float,
        length: float | None,
        locked: tuple[int, ...] = (),
    ) -> Metric:
        if representation not in get_args(Representation):
            raise InputValueError(
                f'{self.name}.{method}: representation must be "space", "body" or "mixed", got '
                f"{representation!r}"
            )
        if not 0 < damping < np.inf:
            raise InputValueError(
                f"{self.name}.{method}: damping must be a positive number, got {damping!r}"
            )
        return self._metric(method, rows, length, locked)

    def _locked_limits(
        self, method: str, name: str, given: ArrayLike | None, lock: Lock | None
    ) -> tuple[FloatArray, tuple[int, ...]]:
        """Limits (..., n), 0 where a coordinate is locked, and which are 0 in every row."""
        limits = self._limits(method, name, given)
        if lock is None and given is None:
            return limits, ()
        limits[..., locked_coordinates(self, method, lock)] = 0
        return limits, tuple(np.flatnonzero((limits == 0).reshape(-1, self.n).all(0)))

    def _limits(self, method: str, name: str, given: ArrayLike | None) -> FloatArray:
        """Limits (..., n) in an array of their own, infinite where none are given."""
        if given is None:
            return np.full(self.n, np.inf)
        limits = np.asarray(given)
        if not limits.ndim:
            limits = np.full(self.n, limits)
        limits = self._reals(method, name, limits, (self.n,))
        if not (limits >= 0).all():
            raise InputValueError(
                f"{self.name}.{method}: {name} must not be negative, got {given!r}"
            )
        return np.array(limits)

    def _reals(self, method: str, name: str, given: Any, core: tuple[int, ...]) -> FloatArray:
        """A float64 array (..., *core)."""
        array = real_array(f"{self.name}.{method}", name, given)
        if core and array.shape[-1:] != core:
            raise ShapeError(
                f"{self.name}.{method}: {name} must have shape (..., {core[0]}), got {array.shape}"
            )
        return array

    def _no_broadcast(self, method: str, **arrays: FloatArray) -> ShapeError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        return ShapeError(f"{self.name}.{method}: leading dimensions do not broadcast: {shapes}")


def _shifted(V: FloatArray, p: FloatArray) -> FloatArray:
    """The twist of the body point displaced by p, in the same axes: v + omega x p."""
    v, omega = V[..., :3], V[..., 3:]
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    a, b, c = omega[..., 0], omega[..., 1], omega[..., 2]
    turned = np.stack([b * z - c * y, c * x - a * z, a * y - b * x], -1)
    return np.concatenate(np.broadcast_arrays(v + turned, omega), -1)
