"""Fair comparisons: another library is timed only if it computes the same results as chasles."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from tests.support.tolerances import AGREEMENT

CONFIGURATIONS = 20
"""Number of configurations at which results are compared before they are timed."""


class DisagreementError(Exception):
    """The results of another library differ from the results of chasles."""


def require_same(name: str, found: Iterable[ArrayLike], expected: Iterable[ArrayLike]) -> None:
    """Raise an error that names the other library unless its results equal those of chasles.

    Args:
        name: The other library, and the robot or function that it computes.
        found: Result arrays of the other library; NaN is required in every entry in which chasles
            returns NaN.
        expected: Result arrays of chasles, with the same shapes.
    """
    for own, peer in zip(map(np.asarray, expected), map(np.asarray, found), strict=True):
        if peer.shape != own.shape:
            raise DisagreementError(f"{name}: shape {peer.shape}, but chasles has {own.shape}")
        if not np.allclose(peer, own, rtol=0, atol=AGREEMENT, equal_nan=True):
            error = np.abs(peer - own).max()
            raise DisagreementError(
                f"{name}: results differ from chasles by {error:.2g}, "
                f"which is more than {AGREEMENT:g}; the benchmark must not time it"
            )
