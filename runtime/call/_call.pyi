import inspect
from collections.abc import Callable, Mapping
from os import PathLike
from types import GenericAlias
from typing import Any, Generic, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

NEARLY_RIGID: float
RIGID_TO_ROUNDING: float

R_co = TypeVar("R_co", covariant=True)

class _Argument(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def unit(self) -> str: ...
    @property
    def meaning(self) -> str: ...

class Function(Generic[R_co]):
    """A compiled function of a robot; R is the type of its result."""

    @property
    def ufunc(self) -> np.ufunc: ...
    @property
    def inputs(self) -> tuple[_Argument, ...]: ...
    @property
    def outputs(self) -> tuple[_Argument, ...]: ...
    @property
    def operations(self) -> Mapping[str, int]: ...
    @property
    def solutions(self) -> type[Any] | None: ...
    @property
    def kernel(self) -> object: ...
    @property
    def __name__(self) -> str: ...
    @property
    def __qualname__(self) -> str: ...
    @property
    def __signature__(self) -> inspect.Signature: ...
    def __class_getitem__(cls, item: Any, /) -> GenericAlias: ...
    def __call__(
        self,
        *inputs: ArrayLike,
        out: NDArray[np.float64] | tuple[NDArray[np.float64] | None, ...] | None = None,
        threads: int | Literal["all"] | None = 1,
        fixed: Mapping[str, ArrayLike] | tuple[ArrayLike, ...] | None = ...,
        **named_inputs: ArrayLike,
    ) -> R_co: ...
    @property
    def near(self) -> float: ...
    @property
    def tolerance(self) -> float: ...

class Nearest:
    """The nearest solution of a robot's inverse."""

    def __init__(
        self,
        inverse: Function[Any],
        general: Callable[..., Any],
        result: type[Any],
        moves: tuple[NDArray[np.float64], ...],
        parameters: tuple[int, ...] | Function[Any],
        name: str,
        doc: str | None,
        signature: inspect.Signature,
        reduced: tuple[Any, ...],
    ) -> None: ...
    @property
    def __name__(self) -> str: ...
    @property
    def __qualname__(self) -> str: ...
    @property
    def __signature__(self) -> inspect.Signature: ...
    def __call__(self, *inputs: Any, **options: Any) -> Any: ...

class Library:
    """A compiled robot, open as long as one of its functions lives."""

    def function(
        self,
        name: str,
        inputs: tuple[_Argument, ...],
        outputs: tuple[_Argument, ...],
        *,
        label: str,
        doc: str,
        signature: inspect.Signature,
        operations: Mapping[str, int],
        reduced: tuple[Callable[..., Any], tuple[Any, ...]],
        guard: Callable[[tuple[NDArray[np.float64], ...]], None] | None,
        solutions: type[Any] | None,
        rescue: Callable[..., None] | None,
        poses: int,
        fk: str | None,
        unit: float,
        general: Callable[..., Any] | None,
        parameters: tuple[str, ...],
    ) -> Function[Any]: ...

def nearest_rows(
    inverse: Function[Any],
    inputs: tuple[NDArray[np.float64], ...],
    q_seed: NDArray[np.float64],
    moves: tuple[NDArray[np.float64], ...],
    results: tuple[NDArray[Any], ...],
    /,
) -> None: ...
def nearest_of_slots(
    inverse: Function[Any],
    slots: tuple[NDArray[np.float64], ...],
    q_seed: NDArray[np.float64],
    moves: tuple[NDArray[np.float64], ...],
    results: tuple[NDArray[Any], ...],
    /,
) -> None: ...
def open(path: str | PathLike[str], expected_hash: str) -> Library: ...  # noqa: A001
def rounded_residuals(T: NDArray[np.float64]) -> NDArray[np.float64]:
    """Residuals (N,) up to which solutions reach matrices (N, 4, 4) that rounding made no poses."""

def release_memory() -> int:
    """Release the memory that chasles keeps for the results of large batches.

    If a call with at least 32 MB of results frees them, up to 256 MB of memory are kept for the
    next call. Without this memory, the system would have to clear new memory for each call. Linux
    takes kept memory back if it runs short of memory.

    Returns:
        The size of the released memory [B].
    """
