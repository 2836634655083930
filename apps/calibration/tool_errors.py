"""From manufacturing tolerances to errors of the tool: to first order, and by Monte Carlo.

With J_p the identification Jacobian and S the diagonal matrix of standard deviations of the
parameters, the covariance of the tool's small displacement (v, omega) is J_p S^2 J_p^T. Random arms
take no approximation: each has its own parameters, and the pose of its tool is compared with that
of the nominal arm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import Robot
from chasles.summaries import short_repr

from ..study.results import StudyResult
from .parameters import deviations, nominal

FloatArray = NDArray[np.float64]

_AT_ONCE = 20_000
"""Random arms computed at once, so that memory stays bounded."""
QUANTILES = (0.5, 0.95, 0.99, 1.0)


@dataclass(frozen=True, eq=False)
class FirstOrderErrors(StudyResult):
    """Errors of the tool to first order.

    Attributes:
        covariance: (..., 6, 6) of the tool's small displacement (v, omega), base axes [m, rad].
        names: The parameters with a tolerance, those of the largest effect first.
        effects: (k,) root mean square displacement of the tool [m] by each alone, over all
            configurations.
    """

    covariance: FloatArray
    names: tuple[str, ...]
    effects: FloatArray

    __repr__ = short_repr

    @property
    def position(self) -> FloatArray:
        """(...,) root mean square error of the tool's position [m]: a map over configurations."""
        return np.asarray(np.sqrt(np.trace(self.covariance[..., :3, :3], axis1=-2, axis2=-1)))

    @property
    def orientation(self) -> FloatArray:
        """(...,) root mean square error of the tool's orientation [rad]."""
        return np.asarray(np.sqrt(np.trace(self.covariance[..., 3:, 3:], axis1=-2, axis2=-1)))


@dataclass(frozen=True, eq=False)
class MonteCarloErrors(StudyResult):
    """Errors of random arms.

    Attributes:
        displacement: (samples, 3) displacement of the tool along each axis of the base [m].
        position: (samples,) its length [m].
        orientation: (samples,) angle between the tool's orientations [rad].
    """

    displacement: FloatArray
    position: FloatArray
    orientation: FloatArray

    __repr__ = short_repr

    def quantiles(self, of: tuple[float, ...] = QUANTILES) -> FloatArray:
        """(k, 2) bounds of position [m] and orientation [rad] that a share of the arms keeps."""
        return np.stack([np.quantile(self.position, of), np.quantile(self.orientation, of)], -1)


def first_order_errors(
    robot: Robot, q: ArrayLike, parameter_std: Mapping[str, float]
) -> FirstOrderErrors:
    """Propagate standard deviations of parameters to the tool, to first order.

    Args:
        robot: A robot with parametric functions.
        q: (..., n) coordinates [rad or m].
        parameter_std: Standard deviations by name of a parameter, by part ("axis", "offset", ...)
            or by unit ("m", "rad", "1"); a name takes precedence over a part, and a part over a
            unit.

    Raises:
        InputValueError: A name is neither a parameter, a part nor a unit.
    """
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
    """Draw robots with normally distributed parameters and return the errors of their tools.

    Args:
        robot: A robot with parametric functions.
        q: (n,) coordinates, or (samples, n): of each arm [rad or m].
        parameter_std: As in :func:`first_order_errors`.
        samples: Number of arms.
        rng: An int or a generator for random numbers; None for fresh ones.

    Raises:
        InputValueError: A name is neither a parameter, a part nor a unit.
    """
    sigma, centre = deviations(robot, parameter_std), nominal(robot)
    random = np.random.default_rng(rng)
    at = np.asarray(q, dtype=np.float64)
    displacement, angle = np.empty((samples, 3)), np.empty(samples)
    used = np.flatnonzero(sigma)
    p = np.tile(centre, (min(samples, _AT_ONCE), 1))
    for first in range(0, samples, _AT_ONCE):
        part = slice(first, min(first + _AT_ONCE, samples))
        count = part.stop - first
        drawn = random.standard_normal((len(used), count))
        for row, k in zip(drawn, used, strict=True):
            p[:count, k] = centre[k] + sigma[k] * row
        here = at if at.ndim == 1 else at[part]
        T, true = robot.fk_p(here, p[:count], threads="all"), robot.fk_p(here, centre)
        displacement[part] = T[:, :3, 3] - true[..., :3, 3]
        # |R - R'| = 2 sqrt(2) sin(angle / 2)
        apart = np.linalg.norm((T - true)[:, :3, :3], axis=(-2, -1))
        angle[part] = 2 * np.arcsin(np.minimum(apart / math.sqrt(8), 1))
    return MonteCarloErrors(displacement, np.linalg.norm(displacement, axis=-1), angle)
