"""Another library is timed only if it computes the same results as chasles."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from tests.support.tolerances import AGREEMENT

CONFIGURATIONS = 20
"""Number of configurations at which results are compared before they are timed."""


class DisagreementError(Exception):
    """The results of another library differ from the results of chasles."""


def require_same(name: str, found: Iterable[ArrayLike], expected: Iterable[ArrayLike]) -> None:
    """Check that another library computes the same results as chasles.

    Args:
        name: Names of the other library and of the robot or function, such as "casadi for ur5e". An
            error message contains this text.
        found: Result arrays of the other library. If chasles returns NaN, the other library must
            return NaN too.
        expected: Result arrays of chasles, with the shapes of the other library's arrays.
    """
    for own, peer in zip(map(np.asarray, expected), map(np.asarray, found), strict=True):
        if peer.shape != own.shape:
            raise DisagreementError(
                f"results of {name} have shape {peer.shape}, but expected {own.shape}"
            )
        if not np.allclose(peer, own, rtol=0, atol=AGREEMENT, equal_nan=True):
            error = np.abs(peer - own).max()
            raise DisagreementError(
                f"results of {name} are off by {error:.2g} (limit: {AGREEMENT:g}); "
                "the benchmark only times libraries that agree with chasles"
            )
