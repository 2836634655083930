"""Paths of poses followed by joint rates: through singularities, and without an inverse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import FloatArray, IntArray
from ..call.capabilities import needs
from ..call.validation import real_array
from ..errors import InputValueError, ShapeError
from ..fixed import Fixed, fixed_coordinates
from ..se3 import project
from ..tolerances import TRACK_GAIN
from . import _track
from .manipulability import ManipulabilityMethods


@dataclass(frozen=True, slots=True)
class Track:
    """The result of following a path of poses.

    Attributes:
        q: (m, n) coordinates [rad or m], within the limits exactly.
        qd: (m - 1, n) rates [rad/s or m/s] of each step, `np.diff(q, axis=0) / dt`, within the rate
            limits exactly.
        error: (m, 2) error of the tool at each pose: distance [m] and angle [rad].
        singular_value: (m,) the smallest singular value of the Jacobian at each pose, a pure
            number: 0 at a singularity, of order 1 far from all singularities.
        max_distance, max_distance_index: The largest distance [m] and the index of its pose.
        max_angle, max_angle_index: The largest angle [rad] and the index of its pose.
        min_singular_value, min_singular_value_index: The smallest singular value, with its index.
        at_rate_limit: The steps in which a coordinate was held at its rate limit, by its name.
            Fixed coordinates and coordinates without such steps are left out. Step k leads from
            pose k to pose k + 1.
        at_limit: The steps in which a coordinate was held at one of its limits, by its name.
        shortened_steps: The steps that were shortened because the robot's forward kinematics is not
            defined at their ends (a loop does not close).
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
        """The result in sentences."""
        sentences = [
            f"{len(self.q)} poses followed within {self.max_distance:.3g} m (pose "
            f"{self.max_distance_index}) and {self.max_angle:.3g} rad (pose "
            f"{self.max_angle_index}).",
            f"Smallest singular value {self.min_singular_value:.3g} at pose "
            f"{self.min_singular_value_index}.",
            _held("its rate limit", self.at_rate_limit),
            _held("a limit", self.at_limit),
        ]
        if len(self.shortened_steps):
            steps = _steps(self.shortened_steps)
            sentences.append(f"{steps} shortened: forward kinematics is not defined further on.")
        return " ".join(filter(None, sentences))


class TrackMethods(ManipulabilityMethods):
    """The methods of a robot that follow paths by rates."""

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
        """Follows a path of poses by resolved rates, with closed-loop correction.

        In each step the tool should move from pose k to pose k + 1 and correct a fraction `gain dt`
        of its error. The step taken is the one within rate limits and limits that comes nearest to
        this motion in least squares, over distance and the characteristic length times angle; small
        singular values are damped. So the tool leaves the path only where a singularity or a limit
        prevents it from following, and joins it again afterwards. Where several configurations
        reach a pose, the joints move least.

        The singular values belong to the Jacobian with angles of the tool times this length, and
        each column divided by the motion of the tool at `q_start` per unit of that coordinate.
        Where a wrist has to turn over, its joints turn at their greatest rates to bring the tool
        back: give rate limits for such a path. The page "Following a path" of the manual has the
        damping and an estimate of the error.

        Args:
            T: (m, 4, 4) poses of the tool measured and expressed in the base frame, dt apart;
                the nearest rigid pose is taken where one is off by at most `se3.NEARLY_RIGID`.
            q_start: (n,) coordinates at the start [rad or m], within the limits. They need not
                reach the first pose.
            dt: Time from pose to pose [s].
            rate_limits: () or (n,) largest rates [rad/s or m/s]; none if None. A limit of 0
                fixes the coordinate.
            fixed: Coordinates that keep their values of `q_start` exactly, by names or indices; a
                joint of the main chain stands for the coordinate that moves it. Singular values and
                damping are those of the robot without them.
            gain: The rate at which errors are corrected [1/s], above 0, at most 1 / dt; 0.5 / dt if
                None.
            characteristic_length: The length [m] that compares angles with distances: with a
                smaller length, the tool deviates less in position and more in orientation.
                `robot.characteristic_length` if None.

        Returns:
            Coordinates, rates and errors, and the steps in which limits held coordinates.

        Raises:
            ShapeError: If T is not a list of poses, or q_start or rate_limits not n values.
            InputValueError: If a pose is not nearly rigid, with the reason; if q_start lies outside
                the limits or forward kinematics is not defined there, or if a number is not as
                described above.

        Source:
            D. E. Whitney, Resolved motion rate control of manipulators and human prostheses, 1969;
            S. Chiaverini, B. Siciliano, O. Egeland, Review of the damped least-squares inverse
            kinematics with experiments on an industrial robot manipulator, 1994, for numerical
            filtering, here of all small singular values; P. B. Stark, R. L. Parker,
            Bounded-variable least squares, 1995.
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
        """Motion of the tool [m] per unit of each coordinate, which depends on gears."""
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


def _held(limit: str, by_name: Mapping[str, IntArray]) -> str:
    """The sentence that names the coordinates held at a limit, "" if there are none."""
    parts = [f"{name} in {_steps(at)}" for name, at in by_name.items()]
    return f"Held at {limit}: {', '.join(parts)}." if parts else ""


def _steps(at: IntArray) -> str:
    """The number of steps, with the first and the last."""
    if len(at) == 1:
        return f"step {at[0]}"
    return f"{len(at)} steps from {at[0]} to {at[-1]}"
