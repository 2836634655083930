"""Least squares: the variables of an identification, their errors, and the solution.

The sum of squares of the errors, each divided by its standard deviation, is least at the sought
parameters and unknowns. Levenberg and Marquardt's iteration takes the exact derivative, which the
robot's generated identification Jacobian gives. Variables count in parts of 1 mm and 1 mrad.

Tolerances tell how far parameters stray from nominal. With s the noise, in the standard deviations
that were stated, and t_k the tolerance of parameter k, the most probable parameters make

    sum_i e_i^2 + sum_k (s (p_k - nominal_k) / t_k)^2

least. s is estimated along with them: s^2 = sum e_i^2 / (M - trace(H^-1 J^T J)), where
H = J^T J + diag(s / t_k)^2 counts a parameter that the tolerance alone determines as none.

Source:
    J. M. Hollerbach, W. Khalil, M. Gautier, Model identification, Springer Handbook of Robotics,
    chapter 6; A. Joubair, I. A. Bonev, Non-kinematic calibration of a six-axis serial robot using
    planar constraints, Precision Engineering 40 (2015), for scaling; D. J. C. MacKay, Bayesian
    interpolation, Neural Computation 4 (1992), for the noise beside tolerances.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from chasles import InputValueError, ShapeError
from chasles.screws import inverse
from chasles.summaries import short_repr

from ..doubts import doubts
from ..observed.observations import SMALL, Observation, Start
from ..parameters import chosen, deviations, nominal, parts
from ..result import Calibration
from .identifiable import Redundancy, identifiable
from .levenberg_marquardt import Errors, least_squares

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
Inputs = ParamSpec("Inputs")
Output = TypeVar("Output")

OUTLYING = 5.0
"""Errors of a row, in robust standard deviations, from which on the row counts as an outlier."""
_CONSISTENT = 1.4826
"""Median absolute deviation to standard deviation of a normal distribution."""
_ROUNDS = 12
"""Rounds of solving and of judging rows and noise; two or three suffice as a rule."""
_STEP = 1e-12
"""Relative change of the sum of squares, and of variables, behind which only rounding is left."""
_LEAST_NOISE = 1e-3
"""Noise, in standard deviations that were stated, below that of any device."""
_EVALUATIONS = 100
"""Most evaluations of a solution: twenty suffice, and measurements without noise never settle."""
_NEARNESS = 0.3
"""Error that 1 mm or 1 mrad off the design counts as, in standard deviations: below the noise, and
enough to decide between parameters of the same effect."""
_PLACED = 1e-3
"""The same of frames and targets, which no design places."""
_FAR = 0.1
"""How far frames and targets may be from their start [m or rad]: a tool that hardly turns tells the
place of its targets from that of the base by what it turns alone."""
_NEARBY = 1e-6
"""Relative step at which a robot explains the measurements well enough to tell parameters apart."""
_MOST_NEARBY = 50
"""Evaluations on the way there."""
_SAME_NOISE = 0.01
"""Change of the noise, in parts of it, that no longer moves a parameter by its uncertainty."""


def in_one_thread(function: Callable[Inputs, Output]) -> Callable[Inputs, Output]:
    """The function, with linear algebra in one thread.

    These matrices are small: further threads would only wait for each other, a hundred times as
    long as one thread takes where the machine is busy.
    """

    @functools.wraps(function)
    def alone(*args: Inputs.args, **kwargs: Inputs.kwargs) -> Output:
        with threadpool_limits(1):
            return function(*args, **kwargs)

    return alone


def problem_at(
    robot: Any,
    q: FloatArray,
    start: Start,
    vary: Collection[str],
    tolerances: Mapping[str, float] | None = None,
    p: FloatArray | None = None,
) -> Problem:
    """The variables that measurements tell apart, at the nominal robot or at another geometry.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        start: The measurements, their frame and unknowns.
        vary: As in :func:`identify`.
        tolerances: As in :func:`identify`.
        p: The geometry; parameters that are not told apart keep its values.
    """
    p, observation = nominal(robot) if p is None else p, start.observation
    candidates = _candidates(robot, vary, observation, bool(tolerances))
    known = deviations(robot, tolerances or {})[candidates]
    x0 = np.concatenate([p[candidates], start.unknowns])
    whole = Problem(
        robot, q, observation, start.T_W_base, p, candidates, x0, known, (), np.ones(len(q))
    )
    J = np.concatenate([whole.derivative(x0) * SMALL, whole.drawn()], 0)
    free, n = np.flatnonzero(known == 0), len(candidates)
    kept = np.setdiff1d(np.arange(len(x0)), free)
    names = np.array(whole.names)
    told, redundant = identifiable(J[:, kept], J[:, free], tuple(names[free]), tuple(names[kept]))
    sought = np.union1d(free[told], kept[kept < n]).astype(np.intp)
    x0 = np.concatenate([p[candidates[sought]], start.unknowns])
    return replace(
        whole, sought=candidates[sought], x0=x0, known=known[sought], redundant=redundant
    )


def problem_nearby(
    first: Problem,
    start: Start,
    vary: Collection[str],
    tolerances: Mapping[str, float] | None = None,
    *,
    robust: bool,
) -> Problem:
    """The variables that are told apart at a robot with loops that explains the measurements.

    A design may hide what its robots show: the rods of a delta are parallel in the design alone. So
    all candidates are sought first; where some have the same effect, they share it.

    Args:
        first: The variables that are told apart at the nominal robot.
        start: The measurements, their frame and unknowns.
        vary: As in :func:`identify`.
        tolerances: As in :func:`identify`.
        robust: Whether a loss is taken that outliers do not govern.
    """
    sought = _candidates(first.robot, vary, start.observation, bool(tolerances))
    x0 = np.concatenate([first.held[sought], start.unknowns])
    whole = replace(first, sought=sought, x0=x0, known=np.zeros(len(sought)))
    designed = np.zeros(len(x0), dtype=bool)
    designed[: len(sought)] = [first.robot.geometry[k].part != "base" for k in sought]
    nearness = np.where(designed, _NEARNESS, _PLACED) / SMALL

    def errors(x: FloatArray) -> Errors:
        return Errors(
            np.concatenate([whole.errors(x), nearness * (x - x0)]),
            lambda: np.concatenate([whole.derivative(x), np.diag(nearness)]),
        )

    found = least_squares(
        errors,
        x0,
        np.where(designed, SMALL, _FAR),
        loss_from=first.spread(first.x0) if robust else 0.0,
        step=_NEARBY,
        evaluations=_MOST_NEARBY,
    )
    at = start._replace(unknowns=found[len(sought) :])
    return problem_at(first.robot, first.q, at, vary, tolerances, whole.geometry(found))


def _candidates(
    robot: Any, vary: Collection[str], observation: Observation, has_tolerances: bool
) -> IntArray:
    """Indices of the parameters that may be sought."""
    words = parts(robot, vary)
    # The device's frame is never known exactly: axes that shift freely contain it, else the base.
    if has_tolerances or "axis" not in words or robot.kind != "serial":
        words.add("base")
    if observation.fixes_tool:
        words.add("tool")
    return chosen(robot, words)


class Fit(NamedTuple):
    """Variables that fit, whether each row took part, and the noise of the rows that did."""

    x: FloatArray
    used: BoolArray
    noise: float


@dataclass(frozen=True, eq=False)
class Problem:
    """The variables x and the errors: x holds identified parameters, then unknowns.

    Attributes:
        robot: The robot.
        q: (N, n) coordinates.
        observation: The measurements.
        T_W_base: (4, 4) base frame in the device's.
        held: The geometry of which the sought parameters are a part.
        sought: Indices of the identified parameters in it.
        x0: Start of x.
        known: Standard deviations of the identified parameters about nominal; 0 of free ones.
        redundant: Parameters that are not told apart.
        weights: (N,) weight of each configuration.
    """

    robot: Any
    q: FloatArray
    observation: Observation
    T_W_base: FloatArray
    held: FloatArray
    sought: NDArray[np.intp]
    x0: FloatArray
    known: FloatArray
    redundant: tuple[Redundancy, ...]
    weights: FloatArray

    __repr__ = short_repr

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        own = (self.robot.geometry[k].name for k in self.sought)
        return (*own, *self.observation.unknowns)

    @property
    def everything(self) -> BoolArray:
        """All rows."""
        return np.ones(len(self.observation.labels), dtype=bool)

    def geometry(self, x: FloatArray) -> FloatArray:
        """The robot's geometry at variables x."""
        p = self.held.copy()
        p[self.sought] = x[: len(self.sought)]
        return p

    def poses(self, q: FloatArray, x: FloatArray) -> FloatArray:
        """(N, 4, 4) poses of the tool in W at coordinates (N, n) and variables x."""
        return np.asarray(self.T_W_base @ self.robot.fk_p(q, self.geometry(x)))

    def unknowns(self, x: FloatArray) -> FloatArray:
        """The observation's unknowns among the variables x."""
        return x[len(self.sought) :]

    def errors(self, x: FloatArray) -> FloatArray:
        """All errors."""
        return self._errors_at(self.poses(self.q, x), x)

    def derivative(self, x: FloatArray) -> FloatArray:
        """(M, k) derivative of all errors by x."""
        return self._derivative_at(self.poses(self.q, x), x)

    def _errors_at(self, T: FloatArray, x: FloatArray) -> FloatArray:
        return np.asarray(self._roots * self.observation.errors(T, self.unknowns(x)))

    def _derivative_at(self, T: FloatArray, x: FloatArray) -> FloatArray:
        J = self.robot.identification_jacobian(self.q, self.geometry(x))[..., self.sought]
        R = self.T_W_base[:3, :3]
        J = np.concatenate([R @ J[:, :3], R @ J[:, 3:]], 1)
        found = np.concatenate(self.observation.derivatives(T, J, self.unknowns(x)), 1)
        return np.asarray(self._roots[:, None] * found)

    @functools.cached_property
    def _rows(self) -> IntArray:
        """The row of each error."""
        return self.observation.rows

    @functools.cached_property
    def _roots(self) -> FloatArray:
        """(M,) root of the weight of each error."""
        return np.sqrt(self.weights[self.observation.configurations[self._rows]])

    def weighted(self, weights: FloatArray) -> Problem:
        """The same variables, with other weights (N,).

        Raises:
            ShapeError: There is not one weight for each configuration.
        """
        if weights.shape != (len(self.q),):
            raise ShapeError(
                f"identify: weights must have shape ({len(self.q)},), got {weights.shape}"
            )
        return replace(self, weights=weights)

    def at(self, index: IntArray) -> Problem:
        """The same variables, from the measurements of some configurations."""
        observation = self.observation.at(index)
        return replace(self, q=self.q[index], observation=observation, weights=self.weights[index])

    def drawn(self) -> FloatArray:
        """(t, k) derivative of (p - nominal) / tolerance by the scaled variables."""
        rows = np.flatnonzero(self.known)
        found = np.zeros((len(rows), len(self.x0)))
        found[np.arange(len(rows)), rows] = SMALL / self.known[rows]
        return found

    def solved(self, x: FloatArray, *, robust: bool) -> Calibration:
        """The calibration, from variables near by.

        Args:
            x: Where the iteration starts.
            robust: Whether rows that contradict the others are left out.

        Raises:
            InputValueError: There are fewer measurements than variables.
        """
        x = self.solve(x, self.everything, 1.0, robust=robust)
        fit = self.settled(Fit(x, self.everything, 1.0), robust=robust)
        return replace(found := self.calibration(fit), doubts=doubts(found))

    def settled(self, fit: Fit, *, robust: bool) -> Fit:
        """Variables, rows that agree, and noise that belong together, from those near by.

        Args:
            fit: Where the iteration starts.
            robust: Whether rows that contradict the others are left out.

        Raises:
            InputValueError: There are fewer measurements than variables.
        """
        count = len(self.x0) + len(self.redundant)
        if len(self._rows) + len(self.drawn()) <= count:
            raise InputValueError(
                f"identify: {len(self._rows)} measured numbers do not determine {count} "
                "variables; measure more configurations, or vary fewer parameters"
            )
        x, used, noise = fit
        for _ in range(_ROUNDS):
            before, last = used, noise
            used = self.within(x) if robust else used
            noise = self.noise(x, used, noise)
            x = self.solve(x, used, noise)
            if (used == before).all() and abs(noise - last) <= _SAME_NOISE * last:
                break
            if not (robust or len(self.drawn())):
                break
        return Fit(x, used, self.noise(x, used, noise))

    def solve(
        self, x: FloatArray, used: BoolArray, noise: float, *, robust: bool = False
    ) -> FloatArray:
        """The least sum of squares over some rows, or of a loss that outliers do not govern.

        Configurations whose loops do not close at the start are left out.
        """
        kept = used[self._rows] & np.isfinite(self.errors(x))
        drawn = noise * self.drawn() / SMALL

        def errors(y: FloatArray) -> Errors:
            T = self.poses(self.q, y)
            values = np.concatenate([self._errors_at(T, y)[kept], drawn @ (y - self.x0)])
            return Errors(
                values, lambda: np.concatenate([self._derivative_at(T, y)[kept], drawn], 0)
            )

        size = self.spread(x) if robust else 0.0
        return least_squares(errors, x, SMALL, loss_from=size, step=_STEP, evaluations=_EVALUATIONS)

    def spread(self, x: FloatArray) -> float:
        """A standard deviation of the errors that outliers do not govern."""
        e = self.errors(x)
        closed = np.isfinite(e)
        return float(_CONSISTENT * np.median(np.abs(e[closed]))) if closed.any() else 0.0

    def within(self, x: FloatArray) -> BoolArray:
        """Which rows agree with the others."""
        largest = np.zeros(len(self.observation.labels))
        # Loops that do not close at x give NaN.
        np.maximum.at(largest, self._rows, np.nan_to_num(np.abs(self.errors(x)), nan=np.inf))
        return largest <= OUTLYING * self.spread(x)

    def noise(self, x: FloatArray, used: BoolArray, last: float) -> float:
        """Factor by which errors exceed their standard deviations, beside the noise before."""
        kept = used[self._rows]
        e = self.errors(x)[kept]
        freedoms = len(e) - (self._determined(x, kept, last) if len(e) else 0)
        if freedoms <= 0:
            raise InputValueError(
                f"identify: only {len(e)} of {len(kept)} measured numbers agree with one another, "
                f"too few for {len(x)} variables; is another robot, or another column, measured?"
            )
        found = float(np.sqrt(e @ e / freedoms))
        # Tolerances beside no noise at all would leave a singular matrix.
        return max(found, _LEAST_NOISE) if self.known.any() else found

    def _determined(self, x: FloatArray, kept: BoolArray, noise: float) -> float:
        """Number of variables that the measurements determine, not their tolerances."""
        J, drawn = self.derivative(x)[kept] * SMALL, noise * self.drawn()
        if not len(drawn):
            return float(len(x))
        return float(np.trace(np.linalg.solve(J.T @ J + drawn.T @ drawn, J.T @ J)))

    def calibration(self, fit: Fit) -> Calibration:
        """The result at the variables found."""
        x, used, noise = fit
        kept = used[self._rows]
        J, drawn = self.derivative(x)[kept] * SMALL, noise * self.drawn()
        covariance = np.linalg.inv(J.T @ J + drawn.T @ drawn) * (SMALL * noise) ** 2
        own = nominal(self.robot)[self.sought]
        before = np.concatenate([own, np.zeros(len(x) - len(self.sought))])
        p, T_W_base = self._framed(self.geometry(x))
        return Calibration(
            names=self.names,
            values=x,
            deviations=x - before,
            covariance=np.asarray(covariance),
            p=p,
            redundant=self.redundant,
            T_W_base=T_W_base,
            nominal_errors=self.errors(self.x0),
            errors=self.errors(x),
            used=used,
            noise=noise,
            freedoms=round(kept.sum() - self._determined(x, kept, noise)),
            observation=self.observation,
            q=self.q,
            robot=self.robot,
        )

    def _framed(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The geometry without corrections of the base, and the device's frame with them."""
        still, own = self.q[0], p.copy()
        own[[item.part == "base" for item in self.robot.geometry]] = 0.0
        moved = self.robot.fk_p(still, p) @ inverse(self.robot.fk_p(still, own))
        return own, np.asarray(self.T_W_base @ moved)
