"""Minimum error of an unbiased estimator under noise: the Cramer-Rao bound.

Let J be the derivative of all measured values with respect to the variables, at the true values and
in units of the standard deviations. No unbiased estimator has a covariance below C = (J^T J)^-1. An
estimator with the covariance C has the error K dx at validation configurations. The matrix K is the
derivative of the validation errors with respect to the variables. The error dx of the variables is
sampled from C. Outlier rows count as valid rows, so the true bound is higher.

Source:
    S. M. Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, chapter 3.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from chasles.calibration import Calibration, Measurements, Poses, Positions

DRAWS = 30
"""Number of sampled estimates, for a mean error that is accurate to a few percent."""


def least_error(
    robot, drawn: Any, found: Calibration, random: np.random.Generator, chance: float
) -> tuple[float, float]:
    """Returns the validation error [m] of an estimator that reaches the bound.

    The error is the mean length of the vectors ``K dx``. For ``dx = A g`` with ``A A^T = C`` and
    standard normal numbers g, the Lipschitz constant of this error is at most the largest singular
    value of ``K A`` divided by the square root of the point count. A Lipschitz function of normal
    numbers exceeds its mean by ``L sqrt(-2 ln chance)`` with a probability of at most ``chance``.
    Borell proved this bound, and independently Tsirelson, Ibragimov and Sudakov.

    Args:
        robot: The robot, with parametric functions.
        drawn: The true robot.
        found: A calibration, which defines the variables and standard deviations.
        random: Random generator of the estimates.
        chance: Probability that the error exceeds the returned bound.

    Returns:
        (mean error, bound). The error exceeds the bound with at most the probability ``chance``.
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
    """Returns derivatives (M, k) of measured values with respect to calibration variables."""
    names = [item.name for item in robot.geometry]
    sought = [names.index(name) for name in found.names if name in names]
    J, R = robot.identification_jacobian(q, p)[..., sought], T_W_base[:3, :3]
    J = np.concatenate([R @ J[:, :3], R @ J[:, 3:]], 1)
    by_p, by_x = measured._derivatives(T_W_base @ robot.fk_p(q, p), J, unknowns)
    return np.concatenate([by_p, by_x], 1)
