"""Time scalings: piecewise polynomials that give a length as a function of time.

All profiles except "constant" start and end at rest. All time derivatives of the length, and their
jumps, are exact.

The profile "constant" has a speed limit, and its rate jumps. The profiles "cubic" and "trapezoidal"
have limits of speed and acceleration, and their acceleration jumps. The profiles "quintic" and
"s_curve" have limits of speed, acceleration and jerk, and their jerk jumps.

Source:
    J. J. Craig, Introduction to Robotics, chapter 7, for polynomials and trapezoids; L. Berscheid,
    T. Kröger, Jerk-limited real-time trajectory generation with arbitrary target states, 2021, for
    the S-curve (the library ruckig).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError
from chasles.contract import requires
from chasles.summaries import summary_repr

from ..arguments import real

FloatArray = NDArray[np.float64]
Profile = Literal["constant", "cubic", "quintic", "trapezoidal", "s_curve"]
DERIVATIVES = ("position", "rate", "acceleration", "jerk")

_JUMP = 1e-9
"""A jump of a derivative is reported if it exceeds this value times length / duration^order."""


@dataclass(frozen=True, eq=False)
class TimeScaling:
    """The path length as a function of time.

    Attributes:
        breaks: (k + 1,) start times of the k polynomials, from 0, followed by the end time [s].
        coefficients: (k, m) coefficients of each polynomial in the time since its start [s], from
            power 0 to power m - 1.
        length: Total path length at the end time, in the unit of the path, for example m.
    """

    breaks: FloatArray
    coefficients: FloatArray
    length: float

    def __repr__(self) -> str:
        """Return a short summary with the length and the duration of the time scaling."""
        pieces = f"{len(self.coefficients)} polynomials"
        return summary_repr(self, "", f"length {self.length:.6g} in {self.duration:.6g} s", pieces)

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.breaks[-1])

    def at(self, t: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return path length, rate and acceleration at the times `t`.

        Args:
            t: (m,) times [s].

        Returns:
            (length, rate, acceleration), three arrays (m,). If u is the unit of the path, the units
            of the arrays are u, u/s and u/s^2.
        """
        time = real("TimeScaling: t", t)
        inside = np.clip(time, 0, self.duration)
        piece = np.clip(np.searchsorted(self.breaks, inside, "right") - 1, 0, len(self.breaks) - 2)
        u = inside - self.breaks[piece]
        s, v, a = (self._derivative(order, piece, u) for order in range(3))
        rests = (time < 0) | (time > self.duration)
        return s, np.where(rests, 0, v), np.where(rests, 0, a)

    def jumps(self) -> list[tuple[str, float, float]]:
        """List (name of the lowest derivative that jumps, time [s], jump size) for each break."""
        found = []
        orders = self.coefficients.shape[1]
        ends = [self._at_ends(order) for order in range(min(orders, len(DERIVATIVES)))]
        for k, time in enumerate(self.breaks):
            for order, (before, after) in enumerate(ends):
                step = after[k] - before[k]
                if abs(step) > _JUMP * self.length / self.duration**order:
                    found.append((DERIVATIVES[order], float(time), float(step)))
                    break
        return found

    def stretched(self, factor: float) -> TimeScaling:
        """Return the same time scaling with `factor` times the duration."""
        powers = factor ** -np.arange(self.coefficients.shape[1], dtype=float)
        return TimeScaling(self.breaks * factor, self.coefficients * powers, self.length)

    def _derivative(self, order: int, piece: NDArray[np.intp], u: FloatArray) -> FloatArray:
        rows = _derived(self.coefficients, order)[piece]
        value = np.zeros(u.shape)
        for column in rows.T[::-1]:
            value = value * u + column
        return value

    def _at_ends(self, order: int) -> tuple[FloatArray, FloatArray]:
        """Return the values of a derivative just before and just after each of the `breaks`."""
        rows = _derived(self.coefficients, order)
        widths = np.diff(self.breaks)
        last = np.array([polynomial.polyval(w, row) for w, row in zip(widths, rows, strict=True)])
        outside = (0.0, self.length if order == 0 else 0.0)
        return np.r_[outside[0], last], np.r_[rows[:, 0], outside[1]]


def _derived(coefficients: FloatArray, order: int) -> FloatArray:
    for _ in range(order):
        coefficients = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
    return coefficients if coefficients.shape[1] else np.zeros((len(coefficients), 1))


def time_scaling(
    profile: Profile,
    length: float,
    *,
    duration: float | None = None,
    speed: float = math.inf,
    acceleration: float = math.inf,
    jerk: float = math.inf,
) -> TimeScaling:
    """Return the path length as a function of time.

    Args:
        profile: "constant" for a constant rate. "cubic" or "quintic" for one polynomial of this
            degree, from rest to rest. "trapezoidal" for constant acceleration, constant rate and
            constant deceleration. "s_curve" for acceleration, constant rate and deceleration with
            limited jerk.
        length: Total path length, at least 0, in the unit u of the path, for example m.
        duration: The duration [s]. None means the shortest duration within the limits. If
            `duration` is passed, "trapezoidal" and "s_curve" need no limits. Without limits, the
            phases of acceleration, constant rate and deceleration of these two profiles take equal
            times.
        speed: Maximum rate of change of the path length [u/s].
        acceleration: The maximum acceleration [u/s^2], which the profile "constant" ignores.
        jerk: The maximum jerk [u/s^3], which only the profiles "quintic" and "s_curve" use.

    Raises:
        InputValueError: `duration` is None, and a limit that "trapezoidal" or "s_curve" needs is
            infinite, or no limit of another profile is finite. `duration` is too short for the
            limits, or `profile` is unknown. `length` is negative, or `duration` or a limit is not
            above 0. `length` is 0, and `duration` is None.
    """
    if profile not in get_args(Profile):
        raise InputValueError(
            f"time_scaling: expected one of {', '.join(get_args(Profile))}, got {profile!r}"
        )
    limits = {"speed": speed, "acceleration": acceleration, "jerk": jerk}
    wrong = [name for name, value in limits.items() if not value > 0]
    timed = duration is None or 0 < duration < math.inf
    if wrong or not 0 <= length < math.inf or not timed:
        raise InputValueError(
            "time_scaling: expected a finite length >= 0, a finite duration > 0 and limits > 0, "
            f"got length {length}, duration {duration}, "
            f"{', '.join(f'{n} {v}' for n, v in limits.items())}"
        )
    if length == 0:
        if duration is None:
            raise InputValueError(
                "time_scaling: a length of 0 takes no time; pass a duration to wait"
            )
        return TimeScaling(np.array([0, duration]), np.zeros((1, 1)), 0.0)
    if profile in _PEAKS:
        return _single(profile, length, duration, limits)
    return _in_phases(profile, length, duration, limits)


def _in_phases(
    profile: Profile, length: float, duration: float | None, limits: dict[str, float]
) -> TimeScaling:
    """Return a trapezoidal or S-curve profile within the limits."""
    needed = ("speed", "acceleration", *(("jerk",) if profile == "s_curve" else ()))
    if all(math.isfinite(limits[name]) for name in needed):
        return _in_time(_MAKERS[profile](length, limits), duration)
    if duration is None:
        raise InputValueError(
            f"time_scaling: expected a duration, or the limits {', '.join(needed)} for profile "
            f"{profile}"
        )
    peaks = _by_time(profile, length, duration)
    for name in needed:
        if peaks[name] > limits[name]:
            raise InputValueError(
                f"time_scaling: a duration of {duration:g} s requires {name} {peaks[name]:.6g}, "
                f"above the limit {limits[name]:g}; pass a longer duration, or all limits of "
                f"{', '.join(needed)}"
            )
    found: TimeScaling = _MAKERS[profile](length, peaks)
    return found


def _by_time(profile: Profile, length: float, duration: float) -> dict[str, float]:
    """Return limits with which acceleration, constant rate and deceleration take equal times."""
    speed = length / duration * 3 / 2
    acceleration = speed / (duration / 3)
    if profile == "trapezoidal":
        return {"speed": speed, "acceleration": acceleration, "jerk": math.inf}
    return {
        "speed": speed,
        "acceleration": 2 * acceleration,
        "jerk": 4 * acceleration / (duration / 3),
    }


def _in_time(found: TimeScaling, duration: float | None) -> TimeScaling:
    if duration is None:
        return found
    if duration < found.duration * (1 - _JUMP):
        raise InputValueError(
            f"time_scaling: the limits require a duration of at least {found.duration:.6g} s, got "
            f"{duration:g} s"
        )
    return found.stretched(duration / found.duration)


_PEAKS = {"constant": (1.0,), "cubic": (1.5, 6.0), "quintic": (1.875, 10 / math.sqrt(3), 60.0)}
"""Maximum rate, acceleration and jerk of each profile for unit length and unit duration, without
infinite maxima."""
_POWERS: dict[str, tuple[float, ...]] = {
    "constant": (0, 1),
    "cubic": (0, 0, 3, -2),
    "quintic": (0, 0, 0, 10, -15, 6),
}
"""Coefficients of the path length s(t) of each profile, from the lowest power of t, for unit length
and unit duration."""


def _single(
    profile: Profile, length: float, duration: float | None, limits: dict[str, float]
) -> TimeScaling:
    times = [
        (peak * length / limit) ** (1 / power)
        for power, (peak, limit) in enumerate(
            zip(_PEAKS[profile], limits.values(), strict=False), 1
        )
    ]
    least = max(times)
    if duration is None and least == 0:
        raise InputValueError(
            "time_scaling: expected a duration, or a limit of speed or acceleration, for profile "
            f"{profile}"
        )
    T = least if duration is None else duration
    if least * (1 - _JUMP) > T:
        raise InputValueError(
            f"time_scaling: the limits require a duration of at least {least:.6g} s, got {T:g} s"
        )
    row = np.array(_POWERS[profile]) * T ** -np.arange(len(_POWERS[profile]), dtype=float)
    return TimeScaling(np.array([0, T]), length * row[None], length)


def _trapezoid(length: float, limits: dict[str, float]) -> TimeScaling:
    v = min(limits["speed"], math.sqrt(length * limits["acceleration"]))
    a = limits["acceleration"]
    start, cruise = v / a, max(length / v - v / a, 0.0)
    return _by_jerk(length, [start, cruise, start], [a, 0, -a], order=2)


def _s_curve(length: float, limits: dict[str, float]) -> TimeScaling:
    with requires("chasles[study]"):
        import ruckig  # noqa: PLC0415

    request = ruckig.InputParameter(1)
    request.target_position = [length]
    request.max_velocity = [limits["speed"]]
    request.max_acceleration = [limits["acceleration"]]
    request.max_jerk = [limits["jerk"]]
    found = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(request, found)
    profile = found.profiles[0][0]
    return _by_jerk(length, profile.t, profile.j, order=3)


def _by_jerk(
    length: float, widths: Sequence[float], values: Sequence[float], order: int
) -> TimeScaling:
    """Return a time scaling from rest whose `order`-th derivative is piecewise constant."""
    kept = [(w, j) for w, j in zip(widths, values, strict=True) if w > 0]
    state, rows = np.zeros(order), []
    for width, value in kept:
        row = np.r_[state, value] / [math.factorial(k) for k in range(order + 1)]
        rows.append(row)
        state = np.array(
            [polynomial.polyval(width, polynomial.polyder(row, k)) for k in range(order)]
        )
    return TimeScaling(np.r_[0, np.cumsum([w for w, _ in kept])], np.array(rows), length)


_MAKERS: dict[str, Any] = {"trapezoidal": _trapezoid, "s_curve": _s_curve}
