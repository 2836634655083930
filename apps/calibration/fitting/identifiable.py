"""Select the identifiable parameters by pivoted QR of the scaled measurement derivative.

Source:
    K. Schroeer, S. Albright, M. Grethlein, Complete, minimal and model-continuous kinematic models
    for robot calibration, 1997; G. H. Golub, C. F. Van Loan, Matrix Computations, 5.5.7, for the
    selection of columns by pivoted QR.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SEPARABLE = 1e-4
"""Minimum pivot of an identifiable parameter's derivative column, relative to the largest pivot. A
parameter with a smaller pivot would amplify noise more than ten thousand times."""
VISIBLE = 1e-3
"""Minimum pivot of an identifiable parameter's derivative column, in standard deviations of the
measurements per 1 mm or 1 mrad of the parameter."""
SHOWN = 0.01
"""The explanation of an unidentifiable parameter lists only the parameters whose absolute
coefficients exceed this value."""


@dataclass(frozen=True)
class Unidentifiable:
    """A parameter or unknown whose effect on the measurements can be caused by other parameters.

    Attributes:
        name: Name of the parameter or unknown that cannot be identified. An unidentifiable
            parameter keeps its nominal value. An unidentifiable unknown keeps its start value.
        combination: Names and coefficients of the linear combination of parameters that has the
            same effect on the measurements.
    """

    name: str
    combination: tuple[tuple[str, float], ...]

    def __str__(self) -> str:
        """Return a sentence that explains why the parameter or unknown is not identified."""
        if not self.combination:
            return f"{self.name} has no effect on the measurements"
        sum_ = " ".join(f"{c:+.3g} {name}" for name, c in self.combination)
        return f"{self.name} has the effect of {sum_}"


def identifiable(
    kept: FloatArray, columns: FloatArray, names: tuple[str, ...], kept_names: tuple[str, ...]
) -> tuple[NDArray[np.intp], tuple[Unidentifiable, ...]]:
    """Select the identifiable variables from the columns of the measurement derivative.

    Args:
        kept: (M, u) derivatives of the measurement errors with respect to the variables that are
            always identified. Each derivative is the change of a measurement error, in standard
            deviations, per 1 mm or 1 mrad of a variable.
        columns: (M, p) derivatives of the measurement errors with respect to the candidate
            variables.
        names: Names of the candidate variables.
        kept_names: Names of the variables that are always identified.

    Returns:
        The sorted indices of the identifiable candidate variables, and a tuple with one
        `Unidentifiable` object for each other candidate.
    """
    basis = np.linalg.qr(kept)[0] if kept.shape[1] else kept
    size = np.linalg.norm(columns, axis=0)
    left = columns - basis @ (basis.T @ columns)
    _, R, order = scipy.linalg.qr(left, mode="economic", pivoting=True)
    pivots = np.abs(np.diag(R))
    enough = pivots > max(SEPARABLE * pivots.max(initial=0.0), VISIBLE)
    chosen = np.sort(order[: len(pivots)][enough])
    others = [k for k in range(len(names)) if k not in chosen]
    sought = np.concatenate([kept, columns[:, chosen]], 1)
    message = (*kept_names, *(names[k] for k in chosen))
    redundancies = []
    for k in others:
        weights = np.linalg.lstsq(sought, columns[:, k])[0] if size[k] else np.zeros(len(message))
        combination = tuple(
            (name, float(w)) for name, w in zip(message, weights, strict=True) if abs(w) > SHOWN
        )
        redundancies.append(Unidentifiable(names[k], combination))
    return chosen, tuple(redundancies)
