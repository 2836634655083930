import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

BORDER: float
"""The singular value below which a direction is damped."""
DAMPING: float
"""The least damping of a singular value of 0."""

# Arrays are dense. The first row of q is read, all else of q and the arrays after it is written.
def follow(
    kernel: object,
    poses: _Floats,
    lower: _Floats,
    upper: _Floats,
    rate: _Floats,
    unit: _Floats,
    q: _Floats,
    qd: _Floats,
    error: _Floats,
    sigma: _Floats,
    touched: NDArray[np.uint8],
    length: float,
    dt: float,
    gain: float,
    border: float,
    damping: float,
    /,
) -> bool: ...
