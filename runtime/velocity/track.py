"""Path tracking by joint rates, without an IK function and through singularities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import FloatArray, IntArray, real_array
from ..call.capabilities import needs
from ..errors import InputValueError, ShapeError
from ..fixed import Fixed, fixed_coordinates
from ..se3 import project
from ..tolerances import TRACK_GAIN
from . import _track
from .manipulability import ManipulabilityMethods


@dataclass(frozen=True, slots=True)
class Track:
    """The result of path tracking. Step k leads from pose k to pose k + 1.

    Attributes:
        q: (m, n) coordinates [rad or m], exactly within the limits.
        qd: (m - 1, n) rates [rad/s or m/s] of each step, `np.diff(q, axis=0) / dt`; none exceeds
            its limit, not even by rounding.
        error: (m, 2) tool error at each pose: distance [m] and angle [rad].
        singular_value: (m,) the smallest singular value of the Jacobian at each pose. The singular
            value is dimensionless, 0 at a singularity, and about 1 far from singularities.
        max_distance: The largest distance [m] of the tool from its prescribed pose.
        max_distance_index: The pose index of the largest distance.
        max_angle: The largest rotation angle of the tool error [rad].
        max_angle_index: The pose index of the largest angle.
        min_singular_value: The smallest singular value of all poses.
        min_singular_value_index: The pose index of the smallest singular value.
        at_rate_limit: For each coordinate name, the steps in which the rate limit of this
            coordinate is active. Fixed coordinates, and coordinates that never reach a rate limit,
            are not listed.
        at_limit: For each coordinate that reaches its position limit, the steps at which this limit
            is active.
        shortened_steps: Steps that were shortened because a loop would have been open at their end.
    """

    q: FloatArray
    qd: FloatArray
    error: FloatArray
    singular_value: FloatArray
    max_distance: float
    max_distance_index: int
    max_angle: float
    max_angle_index: int
    min_singular_value: float
    min_singular_value_index: int
    at_rate_limit: Mapping[str, IntArray]
    at_limit: Mapping[str, IntArray]
    shortened_steps: IntArray

    def __str__(self) -> str:
        """Return a summary of several sentences."""
        sentences = [
            f"{len(self.q)} poses followed within {self.max_distance:.3g} m (pose "
            f"{self.max_distance_index}) and {self.max_angle:.3g} rad (pose "
            f"{self.max_angle_index}).",
            f"Smallest singular value {self.min_singular_value:.3g} at pose "
            f"{self.min_singular_value_index}.",
            _limit_remark("its rate limit", self.at_rate_limit),
            _limit_remark("a limit", self.at_limit),
        ]
        if len(self.shortened_steps):
            steps = _steps(self.shortened_steps)
            sentences.append(f"{steps} shortened: forward kinematics is not defined further on.")
        return " ".join(filter(None, sentences))


class TrackMethods(ManipulabilityMethods):
    """Robot methods for path tracking."""

    @needs("fk_jacobian_mixed")
    def track(
        self,
        T: ArrayLike,
        q_start: ArrayLike,
        dt: float,
        *,
        rate_limits: ArrayLike | None = None,
        fixed: Fixed | None = None,
        gain: float | None = None,
        characteristic_length: float | None = None,
    ) -> Track:
        """Track a path of poses by resolved rates with closed-loop error correction.

        Each step from pose k to pose k + 1 also corrects the fraction `gain * dt` of the tool error
        at pose k. The step is the damped least-squares solution within all limits. The tool
        deviates from the path only at singularities and limits, and returns to the path afterwards.
        A redundant robot moves its joints as little as possible.

        A path through a wrist singularity needs rate limits, because joints rotate at their maximum
        rates there. The manual page "Follow a path by joint rates" describes damping and errors.

        Args:
            T: (m, 4, 4) tool poses in the base frame, at time intervals `dt`. Deviations from rigid
                poses up to `se3.NEARLY_RIGID` are corrected.
            q_start: (n,) coordinates at the start [rad or m], within the limits. The tool may start
                away from the first pose.
            dt: Time between poses [s].
            rate_limits: () or (n,) maximum rates [rad/s or m/s], or None for no limits. A limit of
                0 fixes the coordinate.
            fixed: Names or indices of coordinates that keep their exact values at `q_start`. The
                name of a main-chain joint means the coordinate that moves it. Singular values and
                damping do not include the fixed coordinates.
            gain: The gain of the error correction [1/s], in (0, 1 / dt]; by default 0.5 / dt.
            characteristic_length: The length [m] that multiplies the angular errors and the angular
                rows of the Jacobian, by default `robot.characteristic_length`. A smaller length
                reduces position errors and increases orientation errors.

        Returns:
            Coordinates, rates, errors, singular values, and the steps with active limits.

        Raises:
            ShapeError: If the shape of `T`, `q_start` or `rate_limits` is wrong.
            InputValueError: If a matrix of T is not nearly rigid, if `q_start` is outside the
                limits, if the loops do not close at `q_start`, or if an argument is out of range.

        Source:
            D. E. Whitney, Resolved motion rate control of manipulators and human prostheses, 1969;
            S. Chiaverini, B. Siciliano, O. Egeland, Review of the damped least-squares inverse
            kinematics with experiments on an industrial robot manipulator, 1994 (numerical
            filtering); P. B. Stark, R. L. Parker, Bounded-variable least squares, 1995.
        """
        path, start = self._checked_path(T, q_start)
        rates = self._rates(rate_limits, fixed)
        _require(
            isinstance(dt, Real) and 0 < dt < np.inf,
            f"{self.name}.track: dt must be a positive number, got {dt!r}",
        )
        share = TRACK_GAIN if gain is None else gain * dt
        _require(0 < share <= 1, f"{self.name}.track: gain must be in (0, 1 / dt], got {gain!r}")
        length = self._checked_length("track", characteristic_length)
        unit = self._units(start, length)
        m, n = len(path), self.n
        q, qd = np.empty((m, n)), np.empty((m - 1, n))
        error, sigma = np.empty((m, 2)), np.empty(m)
        touched = np.zeros((m - 1, n), np.uint8)
        q[0] = start
        arrays = (path, self.lower, self.upper, rates, unit, q, qd, error, sigma, touched)
        numbers = (length, dt, share, _track.BORDER, _track.DAMPING)
        defined = _track.follow(self.fk_jacobian_mixed.kernel, *arrays, *numbers)
        _require(defined, f"{self.name}.track: fk is not defined at q_start {start}")
        return self._tracked(q, qd, error, sigma, touched)

    def _checked_path(self, T: ArrayLike, q_start: ArrayLike) -> tuple[FloatArray, FloatArray]:
        path = np.ascontiguousarray(real_array(f"{self.name}.track", "T", T))
        start = real_array(f"{self.name}.track", "q_start", q_start)
        if path.ndim != 3 or path.shape[1:] != (4, 4) or not len(path):  # noqa: PLR2004
            raise ShapeError(f"{self.name}.track: expected T (m, 4, 4), got {path.shape}")
        if start.shape != (self.n,):
            raise ShapeError(f"{self.name}.track: expected q_start ({self.n},), got {start.shape}")
        unknown = ~np.isfinite(path).all((-2, -1))
        _require(not unknown.any(), f"{self.name}.track: T[{np.argmax(unknown)}] is not finite")
        path = project(path, caller=f"{self.name}.track", name="T")
        outside = ~((start >= self.lower) & (start <= self.upper) & np.isfinite(start))
        name = self.coordinates[int(np.argmax(outside))].name
        _require(not outside.any(), f"{self.name}.track: q_start: {name} is outside its limits")
        return path, start

    def _rates(self, rate_limits: ArrayLike | None, fixed: Fixed | None) -> FloatArray:
        rates = self._limits("track", "rate_limits", rate_limits)
        if rates.ndim > 1:
            raise ShapeError(
                f"{self.name}.track: expected rate_limits ({self.n},), got {rates.shape}"
            )
        rates[fixed_coordinates(self, "track", fixed)] = 0
        _require(
            bool(rates.any()),
            f"{self.name}.track: every rate limit is 0, so that nothing is left to move",
        )
        return rates

    def _units(self, q: FloatArray, length: float) -> FloatArray:
        """Return the tool motion [m] per unit of each coordinate, which depends on gear ratios."""
        J = self.fk_jacobian_mixed(q)[1]
        moved = np.hypot(np.linalg.norm(J[:3], axis=0), length * np.linalg.norm(J[3:], axis=0))
        return np.where(moved > 0, moved, length)

    def _tracked(
        self,
        q: FloatArray,
        qd: FloatArray,
        error: FloatArray,
        sigma: FloatArray,
        touched: NDArray[np.uint8],
    ) -> Track:
        distance, angle = error.argmax(0).tolist()
        least = int(sigma.argmin())
        return Track(
            q=q,
            qd=qd,
            error=error,
            singular_value=sigma,
            max_distance=float(error[distance, 0]),
            max_distance_index=distance,
            max_angle=float(error[angle, 1]),
            max_angle_index=angle,
            min_singular_value=float(sigma[least]),
            min_singular_value_index=least,
            at_rate_limit=self._by_name(touched & 1),
            at_limit=self._by_name(touched & 2),
            shortened_steps=np.flatnonzero((touched & 4).any(-1)),
        )

    def _by_name(self, touched: NDArray[Any]) -> Mapping[str, IntArray]:
        steps = {c.name: np.flatnonzero(touched[:, j]) for j, c in enumerate(self.coordinates)}
        return {name: at for name, at in steps.items() if len(at)}


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise InputValueError(message)


def _limit_remark(limit: str, by_name: Mapping[str, IntArray]) -> str:
    parts = [f"{name} in {_steps(at)}" for name, at in by_name.items()]
    return f"At {limit}: {', '.join(parts)}." if parts else ""


def _steps(at: IntArray) -> str:
    if len(at) == 1:
        return f"step {at[0]}"
    return f"{len(at)} steps from {at[0]} to {at[-1]}"
