"""Identification: the parameters of a robot from measurements of its tool.

The sum of squares of the errors, each divided by its standard deviation, is least at the sought
parameters and unknowns. Levenberg and Marquardt's iteration takes the exact derivative, which the
robot's generated identification Jacobian gives. Variables count in parts of 1 mm and 1 mrad.

Source:
    J. M. Hollerbach, W. Khalil, M. Gautier, Model identification, Springer Handbook of Robotics,
    chapter 6; A. Joubair, I. A. Bonev, Non-kinematic calibration of a six-axis serial robot using
    planar constraints, Precision Engineering 40 (2015), for scaling.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.optimize
from numpy.typing import ArrayLike, NDArray

from ..errors import InputValueError, ShapeError
from .doubts import check_units
from .identifiable import Redundancy, identifiable
from .observations import SMALL, Observation
from .parameters import chosen, nominal
from .result import Calibration

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

OUTLYING = 5.0
"""Errors of a row, in robust standard deviations, from which on the row counts as an outlier."""
_CONSISTENT = 1.4826
"""Median absolute deviation to standard deviation of a normal distribution."""


def identify(
    robot: Any,
    q: ArrayLike,
    observation: Observation,
    *,
    vary: Collection[str] = ("axis",),
    robust: bool = True,
    T_W_base: ArrayLike | None = None,
) -> Calibration:
    """The parameters with which a robot explains measurements best.

    Args:
        robot: A robot with parametric functions, `chasles.load(name, parametric=True)`.
        q: (N, n) coordinates at which the tool was measured [rad or m].
        observation: The measurements.
        vary: Parameters that may differ from nominal: names, or parts of the model ("joint",
            "offset", "axis", "transmission", "base", "tool"). The default, with the tool's
            corrections where poses are measured, is complete and minimal for every robot. Without
            "axis" the corrections of the base are added.
        T_W_base: (4, 4) the base frame in the device's, where it is known; it is found otherwise.
        robust: Whether rows that contradict the others are left out and named.

    Raises:
        ShapeError: q does not fit the robot.
        InputValueError: There are fewer measurements than variables, or an unknown name in vary.
    """
    at = np.asarray(q, dtype=np.float64)
    if at.shape[1:] != (robot.n,):
        raise ShapeError(f"identify: q must have shape (N, {robot.n}), got {at.shape}")
    p = nominal(robot)
    start = observation.start(robot.fk_p(at, p))
    check_units(robot, at, p, observation, start.misfit)
    frame = start.T_W_base if T_W_base is None else np.asarray(T_W_base, dtype=np.float64)
    problem = problem_at(robot, at, start.observation, frame, start.unknowns, vary)
    if len(problem.observation.rows) <= len(problem.x0):
        raise InputValueError(
            f"identify: {len(problem.observation.rows)} measured numbers do not determine "
            f"{len(problem.x0)} variables; measure more configurations, or vary fewer parameters"
        )
    x = problem.solve(problem.x0, problem.everything, robust=robust)
    used = problem.everything
    if robust:
        used = problem.within(x)
        x = problem.solve(x, used)
        used = problem.within(x)
        x = problem.solve(x, used)
    return problem.calibration(x, used)


def problem_at(
    robot: Any,
    q: FloatArray,
    observation: Observation,
    T_W_base: FloatArray,
    unknowns: FloatArray,
    vary: Collection[str],
) -> Problem:
    """The variables that measurements tell apart, at the nominal robot.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        observation: The measurements.
        T_W_base: (4, 4) the base frame in the device's.
        unknowns: Values of the observation's unknowns [m].
        vary: As in :func:`identify`.
    """
    p = nominal(robot)
    candidates = _candidates(robot, vary, observation)
    x0 = np.concatenate([p[candidates], unknowns])
    whole = Problem(robot, q, observation, T_W_base, p, candidates, x0, ())
    J = whole.derivative(x0) * SMALL
    n = len(candidates)
    told, redundant = identifiable(J[:, n:], J[:, :n], whole.names[:n], observation.unknowns)
    x0 = np.concatenate([p[candidates[told]], unknowns])
    return replace(whole, sought=candidates[told], x0=x0, redundant=redundant)


@dataclass(frozen=True, eq=False)
class Problem:
    """The variables x and the errors: x holds identified parameters, then unknowns.

    Attributes:
        robot: The robot.
        q: (N, n) coordinates.
        observation: The measurements.
        T_W_base: (4, 4) base frame in the device's.
        nominal: The robot's geometry.
        sought: Indices of the identified parameters in it.
        x0: Start of x.
        redundant: Parameters that are not told apart.
    """

    robot: Any
    q: FloatArray
    observation: Observation
    T_W_base: FloatArray
    nominal: FloatArray
    sought: NDArray[np.intp]
    x0: FloatArray
    redundant: tuple[Redundancy, ...]

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
        p = self.nominal.copy()
        p[self.sought] = x[: len(self.sought)]
        return p

    def errors(self, x: FloatArray) -> FloatArray:
        """All errors."""
        T = self.T_W_base @ self.robot.fk_p(self.q, self.geometry(x))
        return self.observation.errors(T, x[len(self.sought) :])

    def derivative(self, x: FloatArray) -> FloatArray:
        """(M, k) derivative of all errors by x."""
        p = self.geometry(x)
        T = self.T_W_base @ self.robot.fk_p(self.q, p)
        J = self.robot.identification_jacobian(self.q, p)[..., self.sought]
        R = self.T_W_base[:3, :3]
        J = np.concatenate([R @ J[:, :3], R @ J[:, 3:]], 1)
        return np.concatenate(self.observation.derivatives(T, J, x[len(self.sought) :]), 1)

    def solve(self, x: FloatArray, used: BoolArray, *, robust: bool = False) -> FloatArray:
        """The least sum of squares over some rows, or of a loss that outliers do not govern."""
        kept = used[self.observation.rows]
        found = scipy.optimize.least_squares(
            lambda y: self.errors(y)[kept],
            x,
            jac=lambda y: self.derivative(y)[kept],
            x_scale=SMALL,
            loss="cauchy" if robust else "linear",
            f_scale=self.spread(x) if robust else 1.0,
            method="trf",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        return np.asarray(found.x)

    def spread(self, x: FloatArray) -> float:
        """A standard deviation of the errors that outliers do not govern."""
        return float(_CONSISTENT * np.median(np.abs(self.errors(x))))

    def within(self, x: FloatArray) -> BoolArray:
        """Which rows agree with the others."""
        e, rows = self.errors(x), self.observation.rows
        largest = np.zeros(len(self.observation.labels))
        np.maximum.at(largest, rows, np.abs(e))
        return largest <= OUTLYING * self.spread(x)

    def calibration(self, x: FloatArray, used: BoolArray) -> Calibration:
        """The result at the variables found."""
        kept = used[self.observation.rows]
        e, J = self.errors(x)[kept], self.derivative(x)[kept] * SMALL
        freedoms = len(e) - len(x)
        noise = float(np.sqrt(e @ e / freedoms))
        covariance = np.asarray(np.linalg.inv(J.T @ J) * (SMALL * noise) ** 2)
        before = np.concatenate([self.nominal[self.sought], np.zeros(len(x) - len(self.sought))])
        return Calibration(
            self.names,
            x,
            x - before,
            covariance,
            self.geometry(x),
            self.redundant,
            self.T_W_base,
            _rms(self.errors(self.x0)[kept]),
            _rms(e),
            noise,
            tuple(np.array(self.observation.labels)[~used].tolist()),
            freedoms,
            self.observation,
            self.robot,
        )


def _candidates(robot: Any, vary: Collection[str], observation: Observation) -> NDArray[np.intp]:
    # The device's frame is never known exactly: axes that shift contain it, else the base does.
    frame = set() if "axis" in vary else {"base"}
    wanted = set(vary) | frame | ({"tool"} if observation.fixes_tool else set())
    return chosen(robot, wanted)


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def cross_validated(
    robot: Any, q: ArrayLike, observation: Observation, folds: int = 6, **options: Any
) -> FloatArray:
    """Errors of each configuration when the robot is identified from the others.

    Args:
        robot: As in :func:`identify`.
        q: As in :func:`identify`.
        observation: As in :func:`identify`.
        folds: Number of parts, each of which is held back once; every folds-th configuration.
        options: Further arguments of :func:`identify`.

    Returns:
        The errors, part by part, in standard deviations.
    """
    at = np.asarray(q, dtype=np.float64)
    every = np.arange(len(at))
    errors = []
    for fold in range(folds):
        others, held = every[every % folds != fold], every[every % folds == fold]
        found = identify(robot, at[others], observation.at(others), **options)
        errors.append(found.held_back(at[held], observation.at(held)))
    return np.concatenate(errors)
