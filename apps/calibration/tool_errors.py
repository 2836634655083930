"""Tool errors caused by manufacturing tolerances: first-order analysis and Monte Carlo analysis.

To first order, a small tool displacement (v, omega) has the covariance J_p S^2 J_p^T. J_p is the
identification Jacobian, and S is the diagonal matrix of the parameters' standard deviations. The
Monte Carlo analysis compares the exact tool poses of random arms with the nominal pose.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import Robot
from chasles.contract import check_type, requires
from chasles.summaries import short_repr

from ..study.arguments import finite, integer_at_least, key_of
from ..study.results import StudyResult
from .parameters import deviations, nominal

FloatArray = NDArray[np.float64]

_AT_ONCE = 20_000
"""Maximum number of random arms computed at once, to limit memory."""
QUANTILES = (0.5, 0.95, 0.99, 1.0)


@dataclass(frozen=True, eq=False)
class FirstOrderErrors(StudyResult):
    """Tool errors due to parameter errors, to first order.

    Attributes:
        covariance: (..., 6, 6) covariance of the tool error: a translation of the tool origin [m],
            then a rotation vector [rad], in the axes of the base frame.
        names: (k,) names of the parameters with a standard deviation, the largest effect first.
        effects: (k,) root mean square tool displacement [m] over all configurations, caused by each
            parameter alone.
    """

    covariance: FloatArray
    names: tuple[str, ...]
    effects: FloatArray

    __repr__ = short_repr

    @property
    def position(self) -> FloatArray:
        """(...,) root mean square error of the tool position at each configuration [m]."""
        return np.asarray(np.sqrt(np.trace(self.covariance[..., :3, :3], axis1=-2, axis2=-1)))

    @property
    def orientation(self) -> FloatArray:
        """(...,) root mean square error of the tool orientation at each configuration [rad]."""
        return np.asarray(np.sqrt(np.trace(self.covariance[..., 3:, 3:], axis1=-2, axis2=-1)))

    def plot(self, ax: Any = None) -> Any:
        """Plot the root mean square tool displacement [mm] that each parameter alone causes.

        Args:
            ax: matplotlib axes, or None for a new figure 8 cm wide.

        Returns:
            The axes.
        """
        with requires("chasles[calibration]"):
            from .report.plots import plot_effects  # noqa: PLC0415

        return plot_effects(self, ax)


@dataclass(frozen=True, eq=False)
class MonteCarloErrors(StudyResult):
    """Tool errors of robots with random parameter errors.

    Attributes:
        displacement: (samples, 3) random minus nominal tool position, in the base frame [m].
        position: (samples,) length of the tool displacement [m].
        orientation: (samples,) angle between the nominal and the random tool orientation [rad].
    """

    displacement: FloatArray
    position: FloatArray
    orientation: FloatArray

    __repr__ = short_repr

    def quantiles(self, of: tuple[float, ...] = QUANTILES) -> FloatArray:
        """Return quantiles (k, 2) of the position error [m] and the orientation error [rad]."""
        return np.stack([np.quantile(self.position, of), np.quantile(self.orientation, of)], -1)

    def plot(self, ax: Any = None) -> Any:
        """Plot the cumulative distribution of the position error [mm].

        Args:
            ax: matplotlib axes, or None for a new figure 8 cm wide.

        Returns:
            The axes.
        """
        with requires("chasles[calibration]"):
            from .report.plots import plot_distribution  # noqa: PLC0415

        return plot_distribution(self, ax)


def first_order_errors(
    robot: Robot, q: ArrayLike, parameter_std: Mapping[str, float]
) -> FirstOrderErrors:
    """Propagate standard deviations of robot parameters to the tool pose, to first order.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (..., n) actuated coordinates [rad or m].
        parameter_std: Standard deviations of parameters about their nominal values, in the units of
            the parameters (such as m or rad). A key is a name, a group (`part`) or a unit from
            `robot.geometry`. If several keys match a parameter, a name takes precedence over a
            group, and a group over a unit. A parameter that matches no key has no error.

    Returns:
        A `FirstOrderErrors`. `covariance` (..., 6, 6) is the covariance of the tool error: a
        translation of the tool origin [m], then a rotation vector [rad], both in the axes of the
        base frame. `position` (...,) [m] and `orientation` (...,) [rad] are root mean square errors
        of the tool. `names` lists the parameters with a standard deviation, the largest effect
        first. `effects` contains the root mean square tool displacement [m] due to each of these
        parameters alone, over all configurations. At a configuration with a NaN, or with loops that
        do not close, the covariance is NaN. If the covariance of any configuration is NaN, all
        `effects` are NaN.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q` contains values that are not real numbers.
        ShapeError: `q` is not (..., n).
        InputValueError: A key of `parameter_std` is not a name, group or unit in `robot.geometry`.
    """
    check_type("first_order_errors: robot", robot, Robot)
    sigma = deviations(robot, parameter_std)
    J = robot.identification_jacobian(q, nominal(robot)) * sigma
    covariance = J @ J.swapaxes(-1, -2)
    squares = (J[..., :3, :] ** 2).sum(-2)
    effects = np.sqrt(squares.reshape(-1, len(sigma)).mean(0))
    order = np.argsort(-effects, kind="stable")
    order = order[sigma[order] > 0]
    return FirstOrderErrors(
        covariance, tuple(robot.geometry[k].name for k in order), effects[order]
    )


def monte_carlo(
    robot: Robot,
    q: ArrayLike,
    parameter_std: Mapping[str, float],
    samples: int = 100_000,
    *,
    rng: int | np.random.Generator | None = 0,
) -> MonteCarloErrors:
    """Return the tool errors of random robots whose parameters are normally distributed.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (n,) actuated coordinates [rad or m] of all random robots, or (samples, n) with one row
            per random robot.
        parameter_std: Standard deviations of parameters about their nominal values, in the units of
            the parameters (such as m or rad). A key is a name, a group (`part`) or a unit from
            `robot.geometry`. If several keys match a parameter, a name takes precedence over a
            group, and a group over a unit. A parameter that matches no key has no error.
        samples: Number of random robots, at least 1.
        rng: A seed (an int of at least 0), a `numpy.random.Generator`, or None for fresh random
            numbers.

    Returns:
        A `MonteCarloErrors`. `displacement` (samples, 3) is the tool position of each random robot
        minus the nominal position, in the base frame [m]. `position` (samples,) is the length of
        the displacement [m]. `orientation` (samples,) is the angle between the nominal and the
        random tool orientation [rad]. `quantiles()` returns quantiles of `position` and
        `orientation`. If the loops of a random robot do not close, its errors are NaN.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, `q` or `samples` contains values that are not real
            numbers, or `rng` has an unsupported type.
        ShapeError: `q` is neither (n,) nor (samples, n), or `samples` has one or more dimensions.
        InputValueError: A key of `parameter_std` is not a name, group or unit in `robot.geometry`.
            `q` contains a number that is not finite. `samples` is less than 1 or has a fractional
            part, or the seed `rng` is negative.
    """
    check_type("monte_carlo: robot", robot, Robot)
    sigma, center = deviations(robot, parameter_std), nominal(robot)
    random = rng if isinstance(rng, np.random.Generator) else key_of("monte_carlo", rng)
    random = np.random.default_rng(random)
    samples = integer_at_least("monte_carlo: samples", samples, 1)
    at = finite("monte_carlo: q", q)
    displacement, angle = np.empty((samples, 3)), np.empty(samples)
    used = np.flatnonzero(sigma)
    p = np.tile(center, (min(samples, _AT_ONCE), 1))
    for first in range(0, samples, _AT_ONCE):
        part = slice(first, min(first + _AT_ONCE, samples))
        count = part.stop - first
        sampled = random.standard_normal((len(used), count))
        for row, k in zip(sampled, used, strict=True):
            p[:count, k] = center[k] + sigma[k] * row
        here = at if at.ndim == 1 else at[part]
        T, true = robot.fk_p(here, p[:count], threads="all"), robot.fk_p(here, center)
        displacement[part] = T[:, :3, 3] - true[..., :3, 3]
        # Two rotations R and R' that differ by an angle have the distance |R - R'| = 2 sqrt(2)
        # sin(angle / 2).
        apart = np.linalg.norm((T - true)[:, :3, :3], axis=(-2, -1))
        angle[part] = 2 * np.arcsin(np.minimum(apart / math.sqrt(8), 1))
    return MonteCarloErrors(displacement, np.linalg.norm(displacement, axis=-1), angle)
