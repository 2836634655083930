from typing import Any

from numpy.typing import NDArray

def windings(
    q: NDArray[Any],
    residual: NDArray[Any],
    margin: NDArray[Any],
    valid: NDArray[Any],
    limits: tuple[NDArray[Any], ...],
    at_limit: float,
    /,
) -> tuple[Any, Any, Any, Any]: ...
def order(
    q: NDArray[Any],
    valid: NDArray[Any],
    seed: NDArray[Any],
    turn: NDArray[Any],
    unit: NDArray[Any],
    /,
) -> Any: ...
def nearest(
    q: NDArray[Any],
    valid: NDArray[Any],
    seed: NDArray[Any],
    turn: NDArray[Any],
    unit: NDArray[Any],
    /,
) -> Any: ...
def distinct(
    q: NDArray[Any],
    valid: NDArray[Any],
    turn: NDArray[Any],
    tolerance: NDArray[Any],
    whole: NDArray[Any],
    group: int,
    /,
) -> Any: ...
