"""The least-squares problem of an identification: variables, errors and solution.

The identified parameters and unknowns minimize the sum of squared errors. Each error is divided by
its standard deviation. The Levenberg-Marquardt iteration uses the exact derivative from the
generated identification Jacobian. Lengths are scaled by 1 mm, and angles by 1 mrad.

Let s be the noise relative to the stated standard deviations. Let t_k be the standard deviation of
parameter k about its nominal value. For the errors e_i, the most probable parameters p minimize the
following sum:

    sum_i e_i^2 + sum_k (s (p_k - nominal_k) / t_k)^2

The noise s is estimated together with the parameters (`noise.py`).

Source:
    J. M. Hollerbach, W. Khalil, M. Gautier, Model identification, Springer Handbook of Robotics,
    chapter 6; A. Joubair, I. A. Bonev, Non-kinematic calibration of a six-axis serial robot using
    planar constraints, Precision Engineering 40 (2015), for scaling.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from chasles import InputValueError, Robot, ShapeError, se3
from chasles.summaries import short_repr

from ..diagnostics import diagnose
from ..measurements.tool_measurements import SMALL, Measurements, Start
from ..parameters import FRAMES, chosen, deviations, nominal, parts
from ..result import Calibration
from .identifiable import Unidentifiable, identifiable
from .levenberg_marquardt import Errors, least_squares
from .noise import MIN_NOISE, Linearized, Undetermined, robust_deviation

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
Inputs = ParamSpec("Inputs")
Output = TypeVar("Output")

_ROUNDS = 12
"""Maximum number of repeated fits, each with updated outliers and noise."""
_STEP = 1e-12
"""Relative change, of the variables or of the sum of squares, at which the fit stops."""
_EVALUATIONS = 100
"""Maximum number of error evaluations per fit. For exact data, the fit does not converge before
rounding errors dominate. About twenty error evaluations suffice."""
_NEARNESS = 0.3
"""Penalty, in standard deviations, for a deviation of a parameter by 1 mm or 1 mrad from the
nominal design. This penalty selects one solution if several parameters have the same effect on the
measurements."""
_PLACED = 1e-3
"""Penalty, in standard deviations, for a deviation of a frame or target by 1 mm or 1 mrad from its
start value."""
_FAR = 0.1
"""Scale of the frame and target variables in the first fit [m or rad]. This scale is large because
a tool that hardly rotates determines target and base positions only weakly."""
_NEARBY = 1e-6
"""The first fit of a robot with loops stops if the relative change of the variables or of the sum
of squares is at most this value."""
_MAX_NEARBY = 200
"""Maximum number of error evaluations in the first fit of a robot with loops."""
_SAME_NOISE = 0.01
"""Relative noise change up to which the parameters do not change significantly."""


def in_one_thread(function: Callable[Inputs, Output]) -> Callable[Inputs, Output]:
    """Run the linear algebra of a function in one thread.

    One thread is sufficient, because the matrices are small.
    """

    @functools.wraps(function)
    def alone(*args: Inputs.args, **kwargs: Inputs.kwargs) -> Output:
        with threadpool_limits(1):
            return function(*args, **kwargs)

    return alone


def problem_at(
    robot: Robot,
    q: FloatArray,
    start: Start,
    vary: Collection[str],
    parameter_std: Mapping[str, float] | None = None,
    p: FloatArray | None = None,
) -> Problem:
    """Return the least-squares problem for the parameters that the measurements identify.

    The function determines at the geometry p which parameters are identifiable.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        start: The measurements, with start values of the base frame and the unknowns.
        vary: As in ``identify``.
        parameter_std: As in ``identify``.
        p: Values of all geometry parameters, or None for the nominal geometry.
    """
    p, measurements = nominal(robot) if p is None else p, start.measurements
    candidates = _candidates(robot, vary, measurements, bool(parameter_std))
    known = deviations(robot, parameter_std or {})[candidates]
    complete = _whole(robot, q, start, p, candidates, known)
    J, names, n = (
        complete.derivative(complete.x0) * SMALL,
        np.array(complete.names),
        len(candidates),
    )
    unknown, unclear = identifiable(J[:, :0], J[:, n:], complete.names[n:], ())
    J, free = np.concatenate([J, complete.prior_jacobian()], 0), np.flatnonzero(known == 0)
    kept = np.concatenate([np.flatnonzero(known), n + unknown]).astype(np.intp)
    message, unseen = identifiable(J[:, kept], J[:, free], tuple(names[free]), tuple(names[kept]))
    sought = np.union1d(free[message], np.flatnonzero(known)).astype(np.intp)
    return replace(
        complete,
        sought=candidates[sought],
        open_unknowns=unknown,
        x0=np.concatenate([p[candidates[sought]], start.unknowns[unknown]]),
        known=known[sought],
        unidentifiable=(*unseen, *unclear),
    )


def _whole(
    robot: Robot, q: FloatArray, start: Start, p: FloatArray, sought: IntArray, known: FloatArray
) -> Problem:
    """Return the problem in which all candidate parameters and all unknowns are variables."""
    return Problem(
        robot=robot,
        q=q,
        measurements=start.measurements,
        T_W_base=start.T_W_base,
        start_geometry=p,
        fixed_unknowns=start.unknowns,
        sought=sought,
        open_unknowns=np.arange(len(start.unknowns)),
        x0=np.concatenate([p[sought], start.unknowns]),
        known=known,
        unidentifiable=(),
        weights=np.ones(len(q)),
    )


def problem_nearby(
    first: Problem,
    start: Start,
    vary: Collection[str],
    parameter_std: Mapping[str, float] | None = None,
    *,
    robust: bool,
) -> Problem:
    """Return the calibration problem of a robot with loops, with only the identifiable variables.

    Some parameters are identifiable for a real robot, but not for its nominal design. For example,
    the rods of a real delta robot are not exactly parallel. The function therefore first fits all
    candidate parameters and unknowns, and then determines the identifiable parameters at the fitted
    geometry.

    Args:
        first: The least-squares problem with the variables that are identifiable for the nominal
            robot.
        start: The measurements, with start values of the base frame and the unknowns.
        vary: As in ``identify``.
        parameter_std: As in ``identify``.
        robust: Whether the first fit uses a robust loss.
    """
    sought = _candidates(first.robot, vary, start.measurements, bool(parameter_std))
    complete = _whole(
        first.robot, first.q, start, first.start_geometry, sought, np.zeros(len(sought))
    )
    complete, x0 = complete.weighted(first.weights), complete.x0
    designed = np.zeros(len(x0), dtype=bool)
    designed[: len(sought)] = [first.robot.geometry[k].part not in FRAMES for k in sought]
    nearness = np.where(designed, _NEARNESS, _PLACED) / SMALL

    def errors(x: FloatArray) -> Errors:
        return Errors(
            np.concatenate([complete.errors(x), nearness * (x - x0)]),
            lambda: np.concatenate([complete.derivative(x), np.diag(nearness)]),
        )

    found = least_squares(
        errors,
        x0,
        np.where(designed, SMALL, _FAR),
        loss_from=first.spread(first.x0) if robust else 0.0,
        step=_NEARBY,
        evaluations=_MAX_NEARBY,
    )
    at = start._replace(unknowns=found[len(sought) :])
    return problem_at(first.robot, first.q, at, vary, parameter_std, complete.geometry(found))


def _candidates(
    robot: Robot, vary: Collection[str], measurements: Measurements, has_deviations: bool
) -> IntArray:
    """Return the indices of the geometry parameters that a fit may vary."""
    words = parts(robot, vary)
    # The pose of the device frame is never exactly known. If joint axes are varied, their
    # parameters can absorb the error of the device frame. If no joint axes are varied, corrections
    # of the base frame absorb the error of the device frame.
    if has_deviations or "axis" not in words or robot.kind != "serial":
        words.add("base")
    if measurements._fixes_tool:
        words.add("tool")
    return chosen(robot, words)


class Fit(NamedTuple):
    """Result of a fit: the variables x, a mask of the used measurement rows, and the noise."""

    x: FloatArray
    used: BoolArray
    noise: float


@dataclass(frozen=True, eq=False)
class Problem:
    """Least-squares problem of a calibration.

    The variables x are the identified parameters, followed by the identified unknowns.

    Attributes:
        robot: The robot.
        q: (N, n) actuated coordinates at which the tool was measured.
        measurements: The measurements.
        T_W_base: (4, 4) base frame in the device frame W.
        start_geometry: Initial values of the geometry parameters.
        fixed_unknowns: Values of the unknowns before the identification.
        sought: Indices of the identified parameters in the geometry.
        open_unknowns: Indices of the identified unknowns.
        x0: Start values of the variables x.
        known: Standard deviations of the identified parameters about their nominal values, 0 for
            parameters without a stated standard deviation.
        unidentifiable: Parameters and unknowns that the measurements do not determine.
        weights: (N,) weight of each configuration.
    """

    robot: Robot
    q: FloatArray
    measurements: Measurements
    T_W_base: FloatArray
    start_geometry: FloatArray
    fixed_unknowns: FloatArray
    sought: IntArray
    open_unknowns: IntArray
    x0: FloatArray
    known: FloatArray
    unidentifiable: tuple[Unidentifiable, ...]
    weights: FloatArray

    __repr__ = short_repr

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables: the identified parameters, then the identified unknowns."""
        own = (self.robot.geometry[k].name for k in self.sought)
        unknowns = self.measurements.unknowns
        return (*own, *(unknowns[k] for k in self.open_unknowns))

    @property
    def everything(self) -> BoolArray:
        """A mask that selects all rows of the measurements."""
        return np.ones(len(self.measurements.labels), dtype=bool)

    def geometry(self, x: FloatArray) -> FloatArray:
        """Return the geometry of the robot at variables x."""
        p = self.start_geometry.copy()
        p[self.sought] = x[: len(self.sought)]
        return p

    def poses(self, q: FloatArray, x: FloatArray) -> FloatArray:
        """Return the (N, 4, 4) tool poses in frame W at coordinates (N, n) and variables x."""
        return np.asarray(self.T_W_base @ self.robot.fk_p(q, self.geometry(x)))

    def unknowns(self, x: FloatArray) -> FloatArray:
        """Return the values of all unknowns of the measurements at variables x.

        Unknowns that are not identified keep their values in `fixed_unknowns`.
        """
        found = self.fixed_unknowns.copy()
        found[self.open_unknowns] = x[len(self.sought) :]
        return found

    def errors(self, x: FloatArray) -> FloatArray:
        """Return the (M,) measurement errors at variables x, in standard deviations."""
        return self._errors_at(self.poses(self.q, x), x)

    def derivative(self, x: FloatArray) -> FloatArray:
        """Return the (M, k) derivative of the measurement errors with respect to variables x."""
        return self._derivative_at(self.poses(self.q, x), x)

    def _errors_at(self, T: FloatArray, x: FloatArray) -> FloatArray:
        return np.asarray(self._roots * self.measurements._errors(T, self.unknowns(x)))

    def _derivative_at(self, T: FloatArray, x: FloatArray) -> FloatArray:
        J = self.robot.identification_jacobian(self.q, self.geometry(x))[..., self.sought]
        R = self.T_W_base[:3, :3]
        J = np.concatenate([R @ J[:, :3], R @ J[:, 3:]], 1)
        by_p, by_unknowns = self.measurements._derivatives(T, J, self.unknowns(x))
        found = np.concatenate([by_p, by_unknowns[:, self.open_unknowns]], 1)
        return np.asarray(self._roots[:, None] * found)

    @functools.cached_property
    def _rows(self) -> IntArray:
        """Index of the measurement row of each error."""
        return self.measurements.rows

    @functools.cached_property
    def _roots(self) -> FloatArray:
        """(M,) square root of the weight of each error."""
        return np.sqrt(self.weights[self.measurements.configurations[self._rows]])

    def weighted(self, weights: FloatArray) -> Problem:
        """Return a copy of the problem in which the configurations have the weights (N,).

        Raises:
            ShapeError: The number of weights differs from the number of configurations.
        """
        if weights.shape != (len(self.q),):
            raise ShapeError(
                f"identify: weights must have shape ({len(self.q)},), got {weights.shape}"
            )
        return replace(self, weights=weights)

    def at(self, index: IntArray) -> Problem:
        """Return the problem reduced to the configurations with the indices `index`."""
        measurements = self.measurements.at(index)
        return replace(
            self, q=self.q[index], measurements=measurements, weights=self.weights[index]
        )

    def prior_jacobian(self) -> FloatArray:
        """Return the derivative (t, k) of `strays` by the k scaled variables."""
        rows = np.flatnonzero(self.known)
        found = np.zeros((len(rows), len(self.x0)))
        found[np.arange(len(rows)), rows] = SMALL / self.known[rows]
        return found

    def strays(self, x: FloatArray) -> FloatArray:
        """Return the parameter deviations (t,) from nominal, divided by their standard deviations.

        Each deviation belongs to one of the t parameters with a known standard deviation.
        """
        at = np.flatnonzero(self.known)
        return np.asarray((x[at] - nominal(self.robot)[self.sought[at]]) / self.known[at])

    def solved(self, x: FloatArray, *, robust: bool) -> Calibration:
        """Return the calibration.

        Args:
            x: Start values of the variables.
            robust: Whether outliers are excluded.

        Raises:
            InputValueError: There are fewer measurements than variables.
        """
        x = self.solve(x, self.everything, 1.0, robust=robust)
        fit = self.settled(Fit(x, self.everything, 1.0), robust=robust)
        return replace(found := self.calibration(fit), warnings=diagnose(found))

    def settled(self, fit: Fit, *, robust: bool) -> Fit:
        """Fit repeatedly until the outliers and the noise no longer change.

        Args:
            fit: Start values of the variables, mask of the used measurement rows, and noise.
            robust: Whether outliers are excluded.

        Raises:
            InputValueError: There are fewer measurements than variables.
        """
        design = {item.name for item in self.robot.geometry if item.part not in FRAMES}
        count = len(self.x0) + sum(item.name in design for item in self.unidentifiable)
        if len(self._rows) + len(self.prior_jacobian()) <= count:
            raise InputValueError(
                "identify: measure more configurations, or vary fewer parameters; got "
                f"{len(self._rows)} measured values for {count} variables"
            )
        x, used, noise = fit
        for _ in range(_ROUNDS):
            before, last = used, noise
            used = self.within(Fit(x, used, noise)) if robust else used
            noise = self.noise(x, used)
            x = self.solve(x, used, noise)
            if (used == before).all() and abs(noise - last) <= _SAME_NOISE * last:
                break
            if not (robust or len(self.prior_jacobian())):
                break
        return Fit(x, used, self.noise(x, used))

    def solve(
        self, x: FloatArray, used: BoolArray, noise: float, *, robust: bool = False
    ) -> FloatArray:
        """Return the variables that best fit the measurement rows selected by the mask `used`.

        Configurations whose loops do not close at the start values `x` are ignored.
        """
        kept = used[self._rows] & np.isfinite(self.errors(x))
        prior_jacobian = noise * self.prior_jacobian() / SMALL

        def errors(y: FloatArray) -> Errors:
            T = self.poses(self.q, y)
            values = np.concatenate([self._errors_at(T, y)[kept], noise * self.strays(y)])
            return Errors(
                values, lambda: np.concatenate([self._derivative_at(T, y)[kept], prior_jacobian], 0)
            )

        size = self.spread(x) if robust else 0.0
        return least_squares(errors, x, SMALL, loss_from=size, step=_STEP, evaluations=_EVALUATIONS)

    def spread(self, x: FloatArray) -> float:
        """Return a robust standard deviation of the measurement errors at variables x."""
        e = self.errors(x)
        return robust_deviation(e[np.isfinite(e)])

    def within(self, fit: Fit) -> BoolArray:
        """Return a mask of the measurement rows that are not outliers."""
        # Errors are NaN if a loop does not close at the variables x.
        closed = np.isfinite(self.errors(fit.x))
        open_ = np.zeros(len(fit.used), dtype=bool)
        open_[self._rows[~closed]] = True
        used = fit.used & ~open_
        agreeing = ~open_
        try:
            at, every = (self._linearized(fit.x, kept) for kept in (used[self._rows], closed))
            wrong = at.contradicting(every, used[self._rows][closed], fit.noise)
            agreeing[self._rows[closed][wrong]] = False
            self._linearized(fit.x, agreeing[self._rows]).inverse_root(fit.noise)
        except Undetermined:
            return used
        return agreeing

    def noise(self, x: FloatArray, used: BoolArray) -> float:
        """Return the noise, relative to the stated standard deviations."""
        at = self._linearized(x, used[self._rows])
        if len(at.e) + len(at.D) <= len(x):
            raise self._few_agree(used)
        # If parameters have known standard deviations, the noise must be above 0, because the
        # matrix of the normal equations could otherwise be singular.
        return max(at.noise(), MIN_NOISE) if len(at.D) else at.noise()

    def _linearized(self, x: FloatArray, kept: BoolArray) -> Linearized:
        """Linearize the selected measurement errors and all parameter deviations at variables x."""
        J = self.derivative(x)[kept] * SMALL
        return Linearized(self.errors(x)[kept], J, self.strays(x), self.prior_jacobian())

    def _few_agree(self, used: BoolArray) -> InputValueError:
        kept = used[self._rows]
        return InputValueError(
            f"identify: only {int(kept.sum())} of {len(kept)} measured values agree with one "
            f"another, too few for {len(self.x0)} variables; check that the measurements belong to "
            "this robot and that their columns are correct"
        )

    def calibration(self, fit: Fit) -> Calibration:
        """Return the calibration result of a fit."""
        x, used, noise = fit
        at = self._linearized(x, used[self._rows])
        try:
            root = at.inverse_root(noise) * (SMALL * noise)
        except Undetermined:
            raise self._few_agree(used) from None
        own = nominal(self.robot)[self.sought]
        before = np.concatenate([own, np.zeros(len(x) - len(self.sought))])
        p, T_W_base = self._framed(self.geometry(x))
        return Calibration(
            names=self.names,
            values=x,
            deviations=x - before,
            covariance=np.asarray(root @ root.T),
            parameter_std=np.concatenate([self.known, np.zeros(len(self.open_unknowns))]),
            p=p,
            unidentifiable=self.unidentifiable,
            T_W_base=T_W_base,
            nominal_errors=self.errors(self.x0),
            errors=self.errors(x),
            used=used,
            noise=noise,
            residual_dof=max(round(at.freedoms(noise)), 1),
            unknowns=self.unknowns(x),
            measurements=self.measurements,
            q=self.q,
            robot=self.robot,
        )

    def _framed(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the geometry p without base corrections, and the corrected base frame in W."""
        still, own = self.q[0], p.copy()
        own[[item.part == "base" for item in self.robot.geometry]] = 0.0
        moved = self.robot.fk_p(still, p) @ se3.inverse(self.robot.fk_p(still, own))
        return own, np.asarray(self.T_W_base @ moved)
