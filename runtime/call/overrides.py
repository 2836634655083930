"""Calls with arguments that implement the ufunc protocol (`__array_ufunc__`).

If an argument is a dask array, the result is a lazy dask array. The dask protocol would call the
ufunc with arrays of size 1, which robot functions reject. This module therefore passes the shapes
of the results to dask. The ufunc handles all other types.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ..arrays import real_array
from ..errors import InputTypeError, ShapeError
from ._call import Function


def run(function: Function[Any], inputs: tuple[Any, ...], outs: tuple[Any, ...] | None) -> Any:
    """Call a function if an input or an `out` array implements the ufunc protocol.

    Raises:
        InputTypeError: If `out` is used with a dask array, or if an input does not contain real
            numbers.
        ShapeError: If an input has the wrong shape.
    """
    # No argument can be a dask array if dask was never imported.
    dask = sys.modules.get("dask.array")
    strange = [value for value in (*inputs, *(outs or ())) if _has_protocol(value)]
    if dask is None or not all(isinstance(value, dask.Array) for value in strange):
        result = function.ufunc(*inputs, **({"out": outs} if outs else {}))
        return function.solutions._judged(*result) if function.solutions else result
    if outs:
        raise InputTypeError(
            f"{function.__qualname__}: lazy dask arrays do not support out; omit this argument"
        )
    result = _apply(dask, function, [_read(dask, function, i, x) for i, x in enumerate(inputs)])
    return function.solutions(*result) if function.solutions else result


def _has_protocol(value: Any) -> bool:
    plain = np.ndarray.__array_ufunc__
    return getattr(type(value), "__array_ufunc__", plain) is not plain


def _read(dask: Any, function: Function[Any], index: int, value: Any) -> Any:
    """Return an array of real numbers; check the type now, because dask runs the call later."""
    item, label = function.inputs[index], function.__qualname__
    array = value if isinstance(value, dask.Array) else real_array(label, item.name, value)
    if array.dtype.kind not in "iuf":
        raise InputTypeError(
            f"{label}: {item.name} must hold real numbers, got dtype {array.dtype}"
        )
    if _batch(array, item.shape) + item.shape != array.shape:
        core = ", ".join(map(str, item.shape))
        raise ShapeError(
            f"{label}: {item.name} must end in {' x '.join(map(str, item.shape))} "
            f"value{'' if np.prod(item.shape) == 1 else 's'} (shape (..., {core})), "
            f"got shape {array.shape}"
        )
    return array


def _batch(array: Any, core: tuple[int, ...]) -> tuple[int, ...]:
    leading: tuple[int, ...] = array.shape[: max(array.ndim - len(core), 0)]
    return leading


def _apply(dask: Any, function: Function[Any], arrays: Sequence[Any]) -> Any:
    before: tuple[int, ...] = ()
    for array, item in zip(arrays, function.inputs, strict=True):
        own = _batch(array, item.shape)
        before = _broadcast(function, item.name, before, own)
    # The sizes of the dimensions are already checked. Each operand has its own dimension names, so
    # that dask does not compare the sizes again.
    numbers = itertools.count()
    inputs = [[f"i{next(numbers)}" for _ in item.shape] for item in function.inputs]
    shapes = [item.shape for item in function.outputs]
    types: list[type] = [float] * len(shapes)
    if function.solutions:
        # The field `valid` has the shape of the residuals.
        shapes, types = [*shapes, shapes[-1]], [*types, bool]
    outputs = [[f"o{next(numbers)}" for _ in shape] for shape in shapes]
    sizes = [size for shape in shapes for size in shape]
    return dask.apply_gufunc(
        partial(_plain, function) if function.solutions else function,
        "->".join(",".join(f"({','.join(dims)})" for dims in side) for side in (inputs, outputs)),
        *arrays,
        output_sizes=dict(zip(itertools.chain(*outputs), sizes, strict=True)),
        # Without `meta`, dask would compute a result to find the result types.
        meta=tuple(np.empty(0, dtype) for dtype in types),
        allow_rechunk=True,
    )


def _plain(function: Function[Any], *inputs: Any) -> tuple[Any, ...]:
    first, *more = inputs
    return tuple(function(first, fixed=tuple(more)) if more else function(first))


def _broadcast(
    function: Function[Any], name: str, before: tuple[int, ...], own: tuple[int, ...]
) -> tuple[int, ...]:
    """Broadcast two leading shapes.

    An unknown size (NaN in dask) matches any size.
    """
    pairs = list(itertools.zip_longest(reversed(before), reversed(own), fillvalue=1))
    if any(a != b and a == a and b == b and 1 not in (a, b) for a, b in pairs):  # noqa: PLR0124
        raise ShapeError(
            f"{function.__qualname__}: leading dimensions do not broadcast: {name} has {own}, "
            f"the inputs before it have {before}"
        )
    return tuple(b if a == 1 else a for a, b in reversed(pairs))
