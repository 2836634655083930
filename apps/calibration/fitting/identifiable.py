"""Identifiable parameters, selected by pivoted QR of the scaled derivative.

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
"""Minimum relative pivot of an identifiable column. A column with a smaller pivot would amplify
noise more than ten thousand times."""
VISIBLE = 1e-3
"""Minimum pivot of an identifiable column. The unit is one standard deviation of the measurements
per 1 mm or 1 mrad of the parameter."""
SHOWN = 0.01
"""Smallest coefficient that is shown in a combination of parameters."""


@dataclass(frozen=True)
class Unidentifiable:
    """A parameter or unknown whose effect can be reproduced by other parameters.

    Attributes:
        name: Name of the parameter or unknown that cannot be identified. An unidentifiable
            parameter keeps its nominal value. An unidentifiable unknown keeps its start value.
        combination: Names and coefficients of the parameters that have the same effect.
    """

    name: str
    combination: tuple[tuple[str, float], ...]

    def __str__(self) -> str:
        """Return the reason why the parameter is not identified, as a sentence."""
        if not self.combination:
            return f"{self.name} has no effect on the measurements"
        sum_ = " ".join(f"{c:+.3g} {name}" for name, c in self.combination)
        return f"{self.name} has the effect of {sum_}"


def identifiable(
    kept: FloatArray, columns: FloatArray, names: tuple[str, ...], kept_names: tuple[str, ...]
) -> tuple[NDArray[np.intp], tuple[Unidentifiable, ...]]:
    """Select the identifiable columns of a derivative.

    Args:
        kept: (M, u) derivatives with respect to the variables that are always identified. An entry
            is the change of a measurement error, in standard deviations, per 1 mm or 1 mrad.
        columns: (M, p) derivatives with respect to the other parameters.
        names: Names of the candidates.
        kept_names: Names of the variables that are always identified.

    Returns:
        A tuple (sorted indices of the identifiable candidates, one explanation per other
        candidate).
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
