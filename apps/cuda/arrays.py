"""Arrays of CuPy, PyTorch and JAX in the memory of a GPU."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from chasles import InputValueError

REAL = {"<f4": "float", "<f8": "double"}
"""Number types of the kernels, keyed by the type code of an array."""


@dataclass(frozen=True)
class View:
    """Address, shape and number type of an array.

    Attributes:
        address: The address of the first number of the array.
        shape: The shape of the array.
        real: The number type: "float" or "double", or "" for any other type.
    """

    address: int
    shape: tuple[int, ...]
    real: str


def view(array: Any) -> View:
    """Return the address and shape of an array in GPU memory. Wait for a pending JAX computation.

    Raises:
        InputValueError: The array is not contiguous, or not in the memory of a GPU.
    """
    if is_jax(array):
        array.block_until_ready()
    memory = getattr(array, "__cuda_array_interface__", None)
    if memory is None:
        raise InputValueError(f"expected an array in GPU memory, got {type(array).__name__}")
    shape, strides = tuple(memory["shape"]), memory.get("strides")
    if strides is not None and tuple(strides) != _dense(shape, int(memory["typestr"][2:])):
        raise InputValueError("an array must be C-contiguous")
    return View(int(memory["data"][0]), shape, REAL.get(memory["typestr"], ""))


def _dense(shape: tuple[int, ...], width: int) -> tuple[int, ...]:
    """Return the strides of a C-contiguous array."""
    strides = [width]
    for size in reversed(shape[1:]):
        strides.append(strides[-1] * size)
    return tuple(reversed(strides))


def empty(shape: tuple[int, ...], like: Any, *, is_integer: bool = False) -> Any:
    """Return a new array on the device of `like`, with the dtype of `like` or int32."""
    package = import_module("jax.numpy" if is_jax(like) else _package(like))
    kind = package.int32 if is_integer else like.dtype
    own = {} if package.__name__ == "cupy" else {"device": like.device}
    return package.empty(shape, dtype=kind, **own)


def stream(like: Any) -> int:
    """Return the current stream of an array's package, or the default stream for JAX."""
    if is_jax(like):
        return 0
    package = import_module(_package(like))
    if package.__name__ == "cupy":
        return int(package.cuda.get_current_stream().ptr)
    return int(package.cuda.current_stream(like.device).cuda_stream)


def is_jax(array: Any) -> bool:
    """Whether an array belongs to JAX.

    JAX does not wait for chasles kernels to finish.
    """
    return _package(array) == "jaxlib"


def _package(array: Any) -> str:
    return type(array).__module__.partition(".")[0]
