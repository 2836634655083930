import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

# Arrays are dense; all from q on are written to.
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
    smallest: float,
    damping: float,
    /,
) -> bool: ...
