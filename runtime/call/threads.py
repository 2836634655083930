"""Distribution of large batches over threads.

A part of a batch is a slice along a leading dimension. The ufunc writes into the slice of the
output, without the interpreter lock. The calling thread computes parts of the batch, too. A call
completes even if no other thread starts. Python handles signals after each part of a batch, so that
Ctrl-C stops a long call.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from ..errors import InputTypeError
from ._call import Function

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

_ROWS = 8
"""Part sizes are multiples of this number, which fills all SIMD lanes.

Single rows are computed by different code with different rounding. The number of threads does not
change any bit of a result.
"""
_MIN = 500_000
"""Minimum number of floating-point operations per thread (about 0.1 ms of work)."""
_MAX = 20_000_000
"""Maximum number of floating-point operations in a part of a batch. After Ctrl-C, the current part
of the batch still runs to its end, for 5 to 20 ms."""
_PARTS = 4
"""Parts per thread. Other threads can take over the parts of a slow thread."""

_pool: ThreadPoolExecutor | None = None
_pool_lock = threading.Lock()


def count_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run(
    function: Function[Any],
    inputs: tuple[FloatArray, ...],
    outs: tuple[FloatArray | None, ...] | None,
    batch: tuple[int, ...],
    threads: int,
) -> Any:
    """Call a function on checked inputs of a batch, with several threads if that is faster."""
    work = math.prod(batch) * function.operations.get("total", 1)
    threads, parts = _division(work, threads)
    outs = outs or (None,) * len(function.outputs)
    axis, cuts = _cut(batch, parts)
    if len(cuts) < 2 or _overlap(inputs, outs):  # noqa: PLR2004
        return function.ufunc(*inputs, out=outs)
    results = tuple(
        np.empty(batch + item.shape) if out is None else out
        for item, out in zip(function.outputs, outs, strict=True)
    )
    from_end = len(batch) - axis
    operands = [
        _parts(array, array.ndim - len(item.shape) - from_end, cuts)
        for array, item in zip(
            (*inputs, *results), (*function.inputs, *function.outputs), strict=True
        )
    ]
    _share(function.ufunc, iter([*zip(*operands, strict=True)]), len(inputs), threads)
    return results if len(results) > 1 else results[0]


def read_threads(label: str, threads: object) -> int:
    """Return the number of threads, or 0 for "all". Other values raise an InputTypeError."""
    if threads == "all":
        return 0
    is_number = isinstance(threads, (int, np.integer)) and not isinstance(threads, bool)
    if not is_number or threads < 1:  # type: ignore[operator]
        raise InputTypeError(
            f"{label}: threads must be a positive integer or 'all', got {threads!r}"
        )
    return int(threads)  # type: ignore[call-overload, no-any-return]


def run_rows(
    work: Callable[..., None],
    operands: Sequence[NDArray[Any]],
    results: Sequence[NDArray[Any]],
    cost: int,
    threads: int,
) -> None:
    """Call `work` on operands and results of N rows, with several threads if that is faster."""
    threads, n_parts = _division(len(results[0]) * cost, threads)
    _, cuts = _cut((len(results[0]),), n_parts)
    if len(cuts) < 2:  # noqa: PLR2004
        work(*operands, out=tuple(results))
        return
    parts = (tuple(array[cut] for array in (*operands, *results)) for cut in cuts)
    _share(work, iter([*parts]), len(operands), threads)


def call_in_parts(
    work: Callable[..., Any], operands: Sequence[FloatArray], cores: Sequence[int], cost: int
) -> Any:
    """Call a function on the parts of a batch; Ctrl-C ends the call after the current part.

    `cores` contains the number of core dimensions of each operand, and `cost` is the number of
    operations per row.
    """
    leads = [x.ndim - core for x, core in zip(operands, cores, strict=True)]
    if not any(leads):
        return work(*operands)
    batch = np.broadcast_shapes(*(x.shape[:k] for x, k in zip(operands, leads, strict=True)))
    axis, cuts = _cut(batch, math.ceil(math.prod(batch) * cost / _MAX))
    if len(cuts) < 2:  # noqa: PLR2004
        return work(*operands)
    start = axis - len(batch)
    parts = (_parts(x, k + start, cuts) for x, k in zip(operands, leads, strict=True))
    found: tuple[Any, ...] = ()
    for cut, part in zip(cuts, zip(*parts, strict=True), strict=True):
        values = work(*part)
        found = found or tuple(np.empty((*batch, *x.shape[len(batch) :]), x.dtype) for x in values)
        for whole, x in zip(found, values, strict=True):
            whole[(*(slice(None),) * axis, cut)] = x
    return found


def _division(work: int, threads: int) -> tuple[int, int]:
    cores = count_cores()
    threads = max(min(threads or cores, cores, work // _MIN), 1)
    return threads, max(threads * _PARTS if threads > 1 else 1, math.ceil(work / _MAX))


def _cut(batch: tuple[int, ...], n_parts: int) -> tuple[int, list[slice]]:
    if n_parts < 2 or not batch:  # noqa: PLR2004
        return 0, []
    enough = (axis for axis, size in enumerate(batch) if size >= n_parts * _ROWS)
    axis = next(enough, int(np.argmax(batch)))
    tiles = batch[axis] // _ROWS
    n_parts = min(n_parts, tiles)
    bounds = [tiles * k // n_parts * _ROWS for k in range(n_parts)] if n_parts else []
    return axis, [slice(*pair) for pair in itertools.pairwise([*bounds, batch[axis]])]


def _parts(array: FloatArray, axis: int, cuts: Sequence[slice]) -> Iterator[FloatArray]:
    if axis < 0 or array.shape[axis] == 1:
        return itertools.repeat(array, len(cuts))
    before = (slice(None),) * axis
    return (array[(*before, cut)] for cut in cuts)


def _overlap(inputs: Sequence[FloatArray], outs: Sequence[FloatArray | None]) -> bool:
    """Test whether the memory range of an output overlaps the range of another operand."""
    given = [out for out in outs if out is not None]
    pairs = itertools.chain(itertools.product(inputs, given), itertools.combinations(given, 2))
    return any(np.may_share_memory(a, b) for a, b in pairs)


def _share(
    ufunc: Callable[..., Any], parts: Iterator[tuple[FloatArray, ...]], n: int, threads: int
) -> None:

    def work() -> None:
        for part in parts:
            ufunc(*part[:n], out=part[n:])

    # Most programs use one thread, and this import takes 10 % of the import time of chasles.
    from concurrent.futures import wait  # noqa: PLC0415

    helpers: list[Future[None]] = []
    # If no thread can be started, the calling thread does all the work.
    with contextlib.suppress(RuntimeError):
        for _ in range(threads - 1):
            helpers.append(_get_pool().submit(work))
    try:
        work()
    except KeyboardInterrupt:
        for _ in parts:
            pass
        raise
    finally:
        # Another thread must not write after the call has returned.
        wait([helper for helper in helpers if not helper.cancel()])
    for helper in helpers:
        if not helper.cancelled():
            helper.result()


def _get_pool() -> ThreadPoolExecutor:
    from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415

    global _pool  # noqa: PLW0603
    with _pool_lock:
        if _pool is None:
            pool = ThreadPoolExecutor(count_cores(), thread_name_prefix="chasles")
            # Ctrl-C interrupts only the main thread. If Ctrl-C interrupted the start of a thread,
            # the thread would never end, and the program could not exit.
            starter = threading.Thread(target=_start_threads, args=(pool,))
            starter.start()
            starter.join()
            _pool = pool
        return _pool


def _start_threads(pool: ThreadPoolExecutor) -> None:
    are_started = threading.Event()
    with contextlib.suppress(RuntimeError):
        for _ in range(count_cores()):
            pool.submit(are_started.wait)
    are_started.set()


def _forget_pool() -> None:
    """Drop the pool in a forked child.

    After a fork, the pool of the child has no threads, and its lock may be held.
    """
    global _pool, _pool_lock
    _pool, _pool_lock = None, threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)
