"""Minimum error of an unbiased estimator under noise: the Cramer-Rao bound.

Let J be the derivative of all measured values with respect to the variables, at the true values and
in units of the standard deviations. No unbiased estimator has a covariance below C = (J^T J)^-1.
Errors dx of the variables are sampled from a distribution with the covariance C. The errors at the
validation configurations are K dx, where K is the derivative of these errors with respect to the
variables.

Source:
    S. M. Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, chapter 3.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from chasles.calibration import Calibration, Measurements, Poses, Positions

DRAWS = 30
"""Number of samples of the estimation error."""


def least_error(
    robot, drawn: Any, found: Calibration, random: np.random.Generator, chance: float
) -> tuple[float, float]:
    """Return the validation error [m] of an estimator with the Cramer-Rao covariance.

    The validation error is the mean length of the vectors ``K dx``. Let ``dx = A g``, with ``A A^T
    = C`` and standard normal numbers g. As a function of g, the validation error is Lipschitz
    continuous. The Lipschitz constant of the validation error is at most the largest singular value
    of ``K A`` over the square root of the point count. Let f be a function of standard normal
    variables with Lipschitz constant L. The probability that f exceeds its mean by ``L sqrt(-2 ln
    chance)`` is at most ``chance``. Borell proved this concentration bound, and Tsirelson,
    Ibragimov and Sudakov proved it independently.

    Args:
        robot: The robot, with parametric functions.
        drawn: The true robot.
        found: A calibration, which defines the variables and standard deviations.
        random: Random generator for the samples of the estimation error.
        chance: Probability that the error exceeds the returned bound.

    Returns:
        (mean validation error, bound of the validation error).
    """
    sigma, count = found.measurements.sigma, len(drawn.q)
    unknowns, validation = (
        drawn.targets.ravel(),
        np.zeros((len(drawn.validation), len(drawn.targets), 3)),
    )
    measured: Measurements = Positions(np.zeros((count, len(drawn.targets), 3)), sigma)
    if isinstance(found.measurements, Poses):
        measured = replace(found.measurements, T_tool_probe=drawn.T_tool_probe)
        unknowns, validation = drawn.T_tool_probe[:3, 3], np.zeros((len(drawn.validation), 1, 3))
    sought = unknowns[: len(found.measurements.unknowns)]
    J = derivative(robot, found, measured, drawn.q, drawn.T_W_base, drawn.p, sought)
    at = Positions(validation, 1.0)
    K = derivative(robot, found, at, drawn.validation, drawn.T_W_base, drawn.p, unknowns)[
        :, : J.shape[1]
    ]
    C = np.linalg.inv(J.T @ J)
    dx = random.multivariate_normal(np.zeros(len(C)), (C + C.T) / 2, DRAWS)
    x, y, z = (K[axis::3] @ dx.T for axis in range(3))
    mean = float(np.sqrt(x * x + y * y + z * z).mean())
    A = np.linalg.cholesky((C + C.T) / 2)
    L = np.sqrt(np.linalg.eigvalsh(A.T @ (K.T @ K) @ A)[-1] / (len(K) / 3))
    return mean, mean + float(L * np.sqrt(-2 * np.log(chance)))


def derivative(
    robot,
    found: Calibration,
    measured: Measurements,
    q: np.ndarray,
    T_W_base: np.ndarray,
    p: np.ndarray,
    unknowns: np.ndarray,
) -> np.ndarray:
    """Return derivatives (M, k) of measured values with respect to calibration variables."""
    names = [item.name for item in robot.geometry]
    sought = [names.index(name) for name in found.names if name in names]
    J, R = robot.identification_jacobian(q, p)[..., sought], T_W_base[:3, :3]
    J = np.concatenate([R @ J[:, :3], R @ J[:, 3:]], 1)
    by_p, by_x = measured._derivatives(T_W_base @ robot.fk_p(q, p), J, unknowns)
    return np.concatenate([by_p, by_x], 1)
