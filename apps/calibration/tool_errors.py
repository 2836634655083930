"""Tool errors caused by manufacturing tolerances: first-order analysis and Monte Carlo analysis.

J_p is the identification Jacobian. S is the diagonal matrix of the parameters' standard deviations.
To first order, the covariance of the small tool displacement (v, omega) is J_p S^2 J_p^T. The Monte
Carlo analysis compares the exact tool poses of random arms with the nominal pose.
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
    """First-order tool errors.

    Attributes:
        covariance: (..., 6, 6) covariance of the small tool displacement (v, omega), in base axes
            [m, rad].
        names: The parameters with a standard deviation, the largest effect first.
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
    """Tool errors of arms with random manufacturing errors.

    Attributes:
        displacement: (samples, 3) tool displacement in the base frame [m].
        position: (samples,) length of the tool displacement [m].
        orientation: (samples,) angle between the nominal and the random tool orientation [rad].
    """

    displacement: FloatArray
    position: FloatArray
    orientation: FloatArray

    __repr__ = short_repr

    def quantiles(self, of: tuple[float, ...] = QUANTILES) -> FloatArray:
        """Return (k, 2) quantiles of the position error [m] and the orientation error [rad]."""
        return np.stack([np.quantile(self.position, of), np.quantile(self.orientation, of)], -1)

    def plot(self, ax: Any = None) -> Any:
        """Plot the fraction of random arms with a position error [mm] below each value.

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
    """Propagate standard deviations of parameters to the tool pose, to first order.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (..., n) actuated coordinates [rad or m].
        parameter_std: Standard deviations of parameters about their nominal values [m, rad, 1]. The
            keys are names, groups or units ("m", "rad", "1") of parameters. A name takes precedence
            over a group, and a group over a unit. A parameter without a key has no error.

    Returns:
        A `FirstOrderErrors`. `covariance` (..., 6, 6) is the covariance of the small tool
        displacement (v, omega) in the axes of the base frame [m, rad]. `position` (...,) [m] and
        `orientation` (...,) [rad] are root mean square errors of the tool. `names` lists the
        parameters with a standard deviation, the largest effect first. `effects` contains the root
        mean square tool displacement [m] due to each of these parameters alone. At a configuration
        with open loops or with a NaN, the covariance is NaN, and all `effects` are NaN.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, or `q` contains values that are not real numbers.
        ShapeError: `q` is not (..., n).
        InputValueError: A key of `parameter_std` is not a parameter, a group or a unit of the
            robot.
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
    """Return the tool errors of random robots with normally distributed parameters.

    Args:
        robot: A robot with parametric functions, as returned by `chasles.load(name,
            parametric=True)`.
        q: (n,) actuated coordinates [rad or m] for all random robots, or (samples, n) coordinates
            of each random robot.
        parameter_std: Standard deviations of parameters about their nominal values [m, rad, 1]. The
            keys are names, groups or units ("m", "rad", "1") of parameters. A name takes precedence
            over a group, and a group over a unit. A parameter without a key has no error.
        samples: Number of random robots, at least 1.
        rng: A seed (an int of at least 0), a `numpy.random.Generator`, or None for fresh random
            numbers.

    Returns:
        A `MonteCarloErrors`. `displacement` (samples, 3) is the tool displacement in the base frame
        [m]. `position` (samples,) is the length of the displacement [m]. `orientation` (samples,)
        is the angle between the nominal and the random tool orientation [rad]. `quantiles()`
        returns quantiles of the position errors and the orientation errors. The errors of a random
        robot with open loops are NaN.

    Raises:
        MissingFunctionError: The robot has no parametric functions.
        InputTypeError: `robot` is not a `Robot`, `q` or `samples` contains values that are not real
            numbers, or `rng` has an unsupported type.
        ShapeError: `q` is neither (n,) nor (samples, n), or `samples` has one or more dimensions.
        InputValueError: A key of `parameter_std` is not a parameter, a group or a unit of the
            robot. `q` contains a number that is not finite. `samples` is less than 1 or has a
            fractional part, or the seed is negative.
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
        # The distance of two rotations R and R' is |R - R'| = 2 sqrt(2) sin(angle / 2).
        apart = np.linalg.norm((T - true)[:, :3, :3], axis=(-2, -1))
        angle[part] = 2 * np.arcsin(np.minimum(apart / math.sqrt(8), 1))
    return MonteCarloErrors(displacement, np.linalg.norm(displacement, axis=-1), angle)
