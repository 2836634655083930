"""The minimum error of an unbiased estimator under noise: the bound of Cramer and Rao.

With J the derivative of all measured numbers, in their standard deviations, by the variables at the
truth, no unbiased estimator has a covariance below C = (J^T J)^-1. An estimator that reaches this
errs by K dx at held-back configurations, K their derivative and dx drawn from C. Rows of gross
errors count as sound ones, so that the bound lies below what such measurements allow.

Source:
    S. M. Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, chapter 3.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from chasles.calibration import Calibration, Measurements, Poses, Positions

DRAWS = 30
"""Estimates that are drawn; their mean error is then known to a few percent."""


def least_error(
    robot, drawn: Any, found: Calibration, random: np.random.Generator, chance: float
) -> tuple[float, float]:
    """Errors at held-back configurations of an estimator that reaches the bound [m].

    The error is the mean of ``|K dx|``. As a function of standard normal numbers g, with
    ``dx = A g`` and ``A A^T = C``, its Lipschitz constant L is at most the largest singular value
    of ``K A`` over the root of the number of points. A Lipschitz function of normal numbers exceeds
    its mean by ``L sqrt(-2 ln chance)`` with a probability of at most ``chance`` (Borell;
    Tsirelson, Ibragimov and Sudakov).

    Args:
        robot: The robot, with parametric functions.
        drawn: The truth.
        found: A calibration, whose variables and standard deviations are taken.
        random: Draws the estimates.
        chance: Probability that the error exceeds the second result.

    Returns:
        The mean error, and the error that is exceeded with the given probability at most.
    """
    sigma, count = found.measurements.sigma, len(drawn.q)
    unknowns, held = drawn.targets.ravel(), np.zeros((len(drawn.held), len(drawn.targets), 3))
    measured: Measurements = Positions(np.zeros((count, len(drawn.targets), 3)), sigma)
    if isinstance(found.measurements, Poses):
        measured = replace(found.measurements, T_tool_probe=drawn.T_tool_probe)
        unknowns, held = drawn.T_tool_probe[:3, 3], np.zeros((len(drawn.held), 1, 3))
    sought = unknowns[: len(found.measurements.unknowns)]
    J = derivative(robot, found, measured, drawn.q, drawn.T_W_base, drawn.p, sought)
    at = Positions(held, 1.0)
    K = derivative(robot, found, at, drawn.held, drawn.T_W_base, drawn.p, unknowns)[:, : J.shape[1]]
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
    """(M, k) derivative of measured numbers by the variables of a calibration, at a geometry p."""
    names = [item.name for item in robot.geometry]
    sought = [names.index(name) for name in found.names if name in names]
    J, R = robot.identification_jacobian(q, p)[..., sought], T_W_base[:3, :3]
    J = np.concatenate([R @ J[:, :3], R @ J[:, 3:]], 1)
    by_p, by_x = measured.derivatives(T_W_base @ robot.fk_p(q, p), J, unknowns)
    return np.concatenate([by_p, by_x], 1)
