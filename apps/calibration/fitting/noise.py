"""Estimate the noise of measurements and detect outliers from linearized measurement errors.

Near the solution of a fit, a change dx of the scaled variables changes the measurement errors from
e to e + J dx. Parameters with known standard deviations contribute additional errors d + D dx. For
the noise s, the matrix H of the normal equations combines the measurement errors and the parameter
errors:

    H = J^T J + s^2 D^T D

The inverse of H gives the covariance s^2 H^-1 of the variables and the leverages h = diag(J H^-1
J^T) of the errors. Each measurement error also shifts the fit. For an error with leverage h, the
variance of the residual is therefore only 1 - h times the variance of the error. The sum of 1 - h
over all errors is the number of residual degrees of freedom.

If no parameter has a known standard deviation, M errors and k variables give the squared noise s^2
= sum e^2 / (M - k). If parameters have known standard deviations, the noise s maximizes the
marginal likelihood of the measurements. An error along a singular vector of J D^-1 has the variance
lambda + s^2, where lambda is the squared singular value. If there are only a few measurements, the
noise s is uncertain. A wide prior of log s, centered at the stated noise, therefore regularizes the
noise estimate. With thirty residual degrees of freedom, the measurements affect the noise estimate
more than the prior.

Source:
    D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992), for the noise estimate if
    standard deviations of parameters are known; R. D. Cook, S. Weisberg, Residuals and Influence in
    Regression, 1982, for leverages and the outlier test by Student's distribution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize
import scipy.special
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

OUTLYING = 5.0
"""Outlier limit for a large number of residual degrees of freedom, in robust standard deviations.
"""
CONSISTENT = 1.4826
"""Ratio of the standard deviation to the median absolute deviation of a normal distribution."""
MIN_NOISE = 1e-3
"""Minimum noise relative to the stated standard deviations. Real measuring devices have more noise
than this minimum."""
_MIN_DEVIATION = 0.01
"""Minimum robust standard deviation of the errors, as a fraction of the stated standard deviation.
If measurements are exact, residuals below this fraction come from rounding and do not indicate
outliers."""
CHANCE = float(scipy.special.ndtr(-OUTLYING))
"""One-sided probability that the normally distributed error of a correct measurement exceeds the
outlier limit."""
_EFFICIENCY = 0.37
"""Statistical efficiency of the median absolute deviation for a normal distribution."""
_ESTIMATED = 0.1
"""An error is tested as an outlier only if its relative variance exceeds this value. The relative
variance of an error with leverage h is 1 - h if the fit uses the error."""
_STRAY = math.log(10)
"""Prior standard deviation of log s, equivalent to a factor of ten in the noise s."""
_LOG_NOISE = np.linspace(math.log(MIN_NOISE), math.log(1e6), 200)
"""Search grid for the logarithm of the noise, log s."""
_FULL = 1e-13
"""Minimum ratio of the smallest to the largest diagonal entry of the QR factor R. If the ratio is
below this value, the measurements do not determine all variables."""


class Undetermined(Exception):
    """The measurements and the parameters' standard deviations do not determine all variables."""


@dataclass(frozen=True)
class Linearized:
    """Linearized errors and parameter deviations near a solution.

    Attributes:
        e: (M,) measurement errors, in standard deviations.
        J: (M, k) derivative of the measurement errors with respect to the scaled variables.
        d: (t,) deviations of parameters from their nominal values, divided by their standard
            deviations.
        D: (t, k) derivative of the parameter deviations d with respect to the scaled variables,
            with one nonzero entry per row.
    """

    e: FloatArray
    J: FloatArray
    d: FloatArray
    D: FloatArray

    def inverse_root(self, noise: float) -> FloatArray:
        """Return the (k, k) matrix A with A A^T = H^-1, where H is the normal equations' matrix.

        Raises:
            Undetermined: The matrix H of the normal equations is singular.
        """
        R = scipy.linalg.qr(np.concatenate([self.J, noise * self.D]), mode="r")[0]
        R = R[: self.J.shape[1]]
        sizes = np.abs(np.diag(R))
        if len(R) < R.shape[1] or sizes.min(initial=np.inf) <= _FULL * sizes.max(initial=0.0):
            raise Undetermined
        return np.asarray(scipy.linalg.solve_triangular(R, np.eye(len(R))))

    def freedoms(self, noise: float) -> float:
        """Return the number of residual degrees of freedom.

        Only parameters that the measurements determine reduce the number of degrees of freedom.
        """
        if not len(self.D):
            return float(self.J.shape[0] - self.J.shape[1])
        return float((1 - _leverages(self.J, self.inverse_root(noise))).sum())

    def noise(self) -> float:
        """Return the noise as a multiple of the stated standard deviations.

        If no parameter has a known standard deviation, the noise is 0 unless there are more errors
        than variables.
        """
        if len(self.D):
            return self._most_probable_noise()
        surplus = self.J.shape[0] - self.J.shape[1]
        return float(np.sqrt(self.e @ self.e / surplus)) if surplus > 0 else 0.0

    def contradicting(self, every: Linearized, used: BoolArray, noise: float) -> BoolArray:
        """Return a mask (M,) that is true for each error that is an outlier.

        Args:
            every: The M linearized errors to test.
            used: (M,) mask that is true for each error that the fit uses.
            noise: The previous estimate of the noise.
        """
        h = _leverages(every.J, self.inverse_root(noise))
        # The variance of an error with leverage h is 1 - h times the noise variance if the fit uses
        # the error. If the fit does not use the error, its variance is 1 + h times the noise
        # variance.
        kept = np.where(used, np.maximum(1 - h, 0), 1 + h)
        compared = kept > _ESTIMATED
        sizes = np.abs(every.e) / np.sqrt(np.where(compared, kept, 1))
        spread = robust_deviation(sizes[compared])
        return np.asarray(compared & (sizes > limit(float((1 - h)[used].sum())) * spread))

    def _most_probable_noise(self) -> float:
        """Return the noise with the maximum marginal likelihood."""
        has_prior = self.D.any(0)
        # The projection removes the part of the errors that variables without a prior can fit.
        per_tolerance = self.J[:, has_prior] / self.D[:, has_prior].sum(0)
        y = self.e - per_tolerance @ self.d
        Q = np.linalg.qr(self.J[:, ~has_prior])[0]
        y, per_tolerance = (x - Q @ (Q.T @ x) for x in (y, per_tolerance))
        surplus = len(y) - Q.shape[1]
        U, sizes, _ = np.linalg.svd(per_tolerance, full_matrices=False)
        count = max(min(surplus, len(sizes)), 0)
        along = U[:, :count].T @ y
        rest = float(max(y @ y - along @ along, 0.0))

        def improbable(log_noise: float | FloatArray) -> FloatArray:
            """Return the negative logarithm of the joint density of measurements and noise."""
            s2 = np.exp(2 * np.asarray(log_noise))[..., None]
            variance = sizes[:count] ** 2 + s2
            found = (np.log(variance) + along**2 / variance).sum(-1) / 2
            found += (surplus - count) * np.asarray(log_noise) + rest / (2 * s2[..., 0])
            return np.asarray(found + (np.asarray(log_noise) / _STRAY) ** 2 / 2)

        k = int(np.argmin(improbable(_LOG_NOISE)))
        bounds = _LOG_NOISE[max(k - 1, 0)], _LOG_NOISE[min(k + 1, len(_LOG_NOISE) - 1)]
        found = scipy.optimize.minimize_scalar(improbable, bounds=bounds, method="bounded")
        return float(np.exp(found.x))


def _leverages(J: FloatArray, inverse_root: FloatArray) -> FloatArray:
    return np.asarray(((J @ inverse_root) ** 2).sum(-1))


def robust_deviation(errors: FloatArray) -> float:
    """Return a robust standard deviation of errors, computed from their median absolute value."""
    return (
        max(float(CONSISTENT * np.median(np.abs(errors))), _MIN_DEVIATION) if len(errors) else 0.0
    )


def limit(freedoms: float) -> float:
    """Return the outlier limit in robust standard deviations.

    Args:
        freedoms: Residual number of degrees of freedom.
    """
    found = -float(scipy.special.stdtrit(max(_EFFICIENCY * freedoms, 1e-3), CHANCE))
    return found if np.isfinite(found) else math.inf


def largest_noise(freedoms: float) -> float:
    """Return the maximum plausible noise, relative to the stated standard deviations.

    If the stated standard deviations are correct, the estimated noise exceeds this maximum only
    with probability `CHANCE`.

    Args:
        freedoms: Residual number of degrees of freedom.
    """
    count = max(freedoms, 1.0)
    return float(np.sqrt(scipy.special.chdtri(count, CHANCE) / count))
