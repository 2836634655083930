"""Noise of measurements and detection of outliers, with linearized errors.

Near the solution, a change dx of the scaled variables changes the errors from e to e + J dx.
Parameters with known standard deviations contribute additional errors d + D dx. With the noise s,
the matrix H combines the measurement errors and the parameter errors:

    H = J^T J + s^2 D^T D

The inverse of H gives the covariance s^2 H^-1 and the leverages h = diag(J H^-1 J^T). Each
measurement error also shifts the fit, so the variance of a residual is only 1 - h times the
variance of the error. The sum of 1 - h is the number of residual degrees of freedom.

Without known standard deviations, s^2 = sum e^2 / (M - k) for M errors and k variables. With known
standard deviations, s maximizes the marginal likelihood of the measurements. An error along a
singular vector of J D^-1 has the variance lambda + s^2, where lambda is the squared singular value.
If there are few measurements, s is uncertain. A wide prior of log s about the stated noise
regularizes the estimate. With thirty residual degrees of freedom, the measurements affect the
estimate more than the prior.

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
"""Outlier limit for a large number of residual degrees of freedom. The unit is one robust standard
deviation."""
CONSISTENT = 1.4826
"""Ratio of standard deviation to median absolute deviation of a normal distribution."""
MIN_NOISE = 1e-3
"""Minimum noise relative to the stated standard deviations. The noise of real measuring devices is
larger."""
_MIN_DEVIATION = 0.01
"""Minimum robust standard deviation of a row, as a fraction of its stated standard deviation. If
measurements are exact, residuals below this value come from rounding and do not indicate outliers.
"""
CHANCE = float(scipy.special.ndtr(-OUTLYING))
"""Probability that the error of a correct measurement is beyond the outlier limit. Only one side of
the distribution is counted."""
_EFFICIENCY = 0.37
"""Statistical efficiency of the median absolute deviation for a normal distribution."""
_ESTIMATED = 0.1
"""An error is tested as an outlier only if its relative variance exceeds this value. Let h be the
leverage of an error that the fit uses. The relative variance of this error is 1 - h."""
_STRAY = math.log(10)
"""Prior standard deviation of log s: a factor of ten in the noise s."""
_LOG_NOISE = np.linspace(math.log(MIN_NOISE), math.log(1e6), 200)
"""Search grid for the logarithm of the noise, log s."""
_FULL = 1e-13
"""Minimum ratio of the smallest to the largest diagonal entry of the QR factor R. If the ratio is
below this value, the measurements do not determine all variables."""


class Undetermined(Exception):
    """Measurements and parameter_std do not determine all variables."""


@dataclass(frozen=True)
class Linearized:
    """Linearized errors and parameter deviations near a solution.

    Attributes:
        e: (M,) errors, in standard deviations.
        J: (M, k) derivative of e with respect to the scaled variables.
        d: (t,) deviations of parameters from nominal, relative to parameter_std.
        D: (t, k) derivative of d with respect to the scaled variables. Each row has one nonzero
            entry.
    """

    e: FloatArray
    J: FloatArray
    d: FloatArray
    D: FloatArray

    def inverse_root(self, noise: float) -> FloatArray:
        """Return the (k, k) matrix A with A A^T = H^-1.

        Raises:
            Undetermined: H is singular.
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

        The noise is 0 if `D` has no rows and the number of errors is at most the number of
        variables.
        """
        if len(self.D):
            return self._most_probable_noise()
        surplus = self.J.shape[0] - self.J.shape[1]
        return float(np.sqrt(self.e @ self.e / surplus)) if surplus > 0 else 0.0

    def contradicting(self, every: Linearized, used: BoolArray, noise: float) -> BoolArray:
        """Return a mask (M,) that is true if an error is an outlier.

        Args:
            every: The M linearized errors to test.
            used: (M,) mask that is true if the fit uses the error.
            noise: The previous estimate of the noise.
        """
        h = _leverages(every.J, self.inverse_root(noise))
        # Let h be the leverage of an error. If the fit uses the error, the variance of the error
        # after the fit is 1 - h times the noise variance. Otherwise, the variance is 1 + h times
        # the noise variance.
        kept = np.where(used, np.maximum(1 - h, 0), 1 + h)
        compared = kept > _ESTIMATED
        sizes = np.abs(every.e) / np.sqrt(np.where(compared, kept, 1))
        spread = robust_deviation(sizes[compared])
        return np.asarray(compared & (sizes > limit(float((1 - h)[used].sum())) * spread))

    def _most_probable_noise(self) -> float:
        """Return the noise with the maximum marginal likelihood."""
        has_prior = self.D.any(0)
        # The projection removes the part of the errors that free variables (without a prior) can
        # fit.
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
            """Return the negative log density of the measurements and the noise."""
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
    """Return the standard deviation of errors, estimated robustly from their median."""
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
