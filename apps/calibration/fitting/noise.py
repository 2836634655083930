"""The noise of measurements, and the rows that contradict the others, from linearized errors.

Errors near the solution are e + J dx, with dx in scaled variables. Known standard deviations of
parameters add d + D dx, the scaled deviations from nominal. With s the noise, the matrix

    H = J^T J + s^2 D^T D

gives the covariance s^2 H^-1 and the leverages h = diag(J H^-1 J^T): an error keeps the part 1 - h
of its variance, since the variables follow it. sum(1 - h) measured numbers are surplus.

Without them s^2 = sum e^2 / (M - k). With them, s makes the measurements most probable,
whatever the parameters are: in the axes of J D^-1, an error y has the variance lambda + s^2. Few
measurements and many parameters leave s open; a density of log s about the stated noise decides
then, so wide that thirty surplus numbers outweigh it.

Source:
    D. J. C. MacKay, Bayesian interpolation, Neural Computation 4 (1992), for the noise next to
    known standard deviations; R. D. Cook, S. Weisberg, Residuals and Influence in Regression, 1982,
    for leverages and the test of rows by Student's distribution.
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
"""Errors of a row, in robust standard deviations, from which on the row counts as an outlier, if
many measured numbers are surplus. Few surplus numbers estimate the standard deviation poorly, and
Student's distribution gives the limit of the same probability."""
CONSISTENT = 1.4826
"""Median absolute deviation to standard deviation of a normal distribution."""
LEAST_NOISE = 1e-3
"""Noise relative to the stated standard deviations, smaller than the noise of any device."""
_LEAST_DEVIATION = 0.01
"""Least deviation with which rows are compared, in standard deviations that were stated. Exact
measurements leave rounding errors and small effects of parameters that are held at nominal, which
say nothing of the rows."""
CHANCE = float(scipy.special.ndtr(-OUTLYING))
"""Probability of an error beyond that limit, to one side."""
_EFFICIENCY = 0.37
"""Surplus numbers of a standard deviation as good as a median of one surplus number."""
_ESTIMATED = 0.1
"""Part of its variance that an error must keep for its row to be compared with the others."""
_STRAY = math.log(10)
"""Standard deviation of the logarithm of the noise about the stated one, where measurements leave
the noise open: devices are ten times better or worse than stated."""
_LOG_NOISE = np.linspace(math.log(LEAST_NOISE), math.log(1e6), 200)
"""Logarithms of the noise between which the most probable one is sought."""
_FULL = 1e-13
"""Diagonal entry of the triangular factor, in parts of the largest, at which variables are not
determined."""


class Undetermined(Exception):
    """Rows and parameter_std do not determine all variables."""


@dataclass(frozen=True)
class Linearized:
    """Errors and parameter_std near a solution.

    Attributes:
        e: (M,) errors, in standard deviations.
        J: (M, k) their derivative by the scaled variables.
        d: (t,) deviations from nominal, in parts of the parameter_std.
        D: (t, k) their derivative; each row has one entry.
    """

    e: FloatArray
    J: FloatArray
    d: FloatArray
    D: FloatArray

    def inverse_root(self, noise: float) -> FloatArray:
        """(k, k) the matrix A with A A^T = H^-1.

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
        """Number of surplus measured numbers.

        A parameter that its tolerance alone determines costs none.
        """
        if not len(self.D):
            return float(self.J.shape[0] - self.J.shape[1])
        return float((1 - _leverages(self.J, self.inverse_root(noise))).sum())

    def noise(self) -> float:
        """Factor by which errors exceed their standard deviations; 0 if no number is surplus."""
        if len(self.D):
            return self._most_probable_noise()
        surplus = self.J.shape[0] - self.J.shape[1]
        return float(np.sqrt(self.e @ self.e / surplus)) if surplus > 0 else 0.0

    def contradicting(self, every: Linearized, used: BoolArray, noise: float) -> BoolArray:
        """(M,) whether each error is too large compared with the errors of the rows in use.

        Args:
            every: The same of all rows.
            used: (M,) which of these are in use.
            noise: The noise before.
        """
        h = _leverages(every.J, self.inverse_root(noise))
        # Variables do not follow an error that is not in use: it has the variance 1 + h.
        kept = np.where(used, np.maximum(1 - h, 0), 1 + h)
        compared = kept > _ESTIMATED
        sizes = np.abs(every.e) / np.sqrt(np.where(compared, kept, 1))
        spread = robust_deviation(sizes[compared])
        return np.asarray(compared & (sizes > limit(float((1 - h)[used].sum())) * spread))

    def _most_probable_noise(self) -> float:
        """The noise that makes measurements most probable, whatever the parameters are."""
        drawn = self.D.any(0)
        # Errors at the nominal parameters, per tolerance, without what free variables can take.
        per_tolerance = self.J[:, drawn] / self.D[:, drawn].sum(0)
        y = self.e - per_tolerance @ self.d
        Q = np.linalg.qr(self.J[:, ~drawn])[0]
        y, per_tolerance = (x - Q @ (Q.T @ x) for x in (y, per_tolerance))
        surplus = len(y) - Q.shape[1]
        U, sizes, _ = np.linalg.svd(per_tolerance, full_matrices=False)
        count = max(min(surplus, len(sizes)), 0)
        along = U[:, :count].T @ y
        rest = float(max(y @ y - along @ along, 0.0))

        def improbable(log_noise: float | FloatArray) -> FloatArray:
            """Negative logarithm of the probability density of the measurements and the noise."""
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
    """A standard deviation of errors that outliers do not govern."""
    return (
        max(float(CONSISTENT * np.median(np.abs(errors))), _LEAST_DEVIATION) if len(errors) else 0.0
    )


def limit(freedoms: float) -> float:
    """Robust standard deviations beyond which an error is no chance, with so many surplus numbers.

    Args:
        freedoms: Number of surplus measured numbers.
    """
    found = -float(scipy.special.stdtrit(max(_EFFICIENCY * freedoms, 1e-3), CHANCE))
    return found if np.isfinite(found) else math.inf


def largest_noise(freedoms: float) -> float:
    """Noise, in standard deviations that were stated, beyond which it is no chance.

    Args:
        freedoms: Number of surplus measured numbers.
    """
    count = max(freedoms, 1.0)
    return float(np.sqrt(scipy.special.chdtri(count, CHANCE) / count))
