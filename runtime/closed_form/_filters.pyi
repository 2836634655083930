from typing import Any

from numpy.typing import NDArray

Array = NDArray[Any]

def windings(
    q: Array,
    residual: Array,
    margin: Array,
    valid: Array,
    limits: tuple[Array, ...],
    at_limit: float,
    /,
) -> tuple[Any, Any, Any, Any]: ...
def order(q: Array, valid: Array, seed: Array, turn: Array, unit: Array, /) -> Any: ...
def nearest(q: Array, valid: Array, seed: Array, turn: Array, unit: Array, /) -> Any: ...
def distinct(
    q: Array, valid: Array, turn: Array, tolerance: Array, whole: Array, group: int, /
) -> Any: ...
