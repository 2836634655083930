"""Splits a large batch into parts and shares them among threads: `threads` of every function.

A part is a slice of the batch along one of its leading dimensions; NumPy's ufunc writes its result
straight into the slice of the output, without the interpreter's lock. The calling thread takes
part, so a call completes even where no other thread is free or can be started. Python handles
signals between parts, so Ctrl-C stops a long call.
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
"""Cuts lie at multiples of this number, so that only the last part has a partly filled tile of
lanes. It is also the fewest rows of a part: the result of a row depends neither on its lane nor on
its neighbours, but a single row is computed by other code, which may round differently. So results
are the same, bit by bit, for every number of threads."""
_LEAST = 500_000
"""Floating-point operations for each thread. They take a tenth of a millisecond, and starting work
on another thread takes a third of that: a smaller batch ends before another thread has begun."""
_MOST = 20_000_000
"""Floating-point operations of a part, which take 5 to 20 ms: Ctrl-C takes effect after it."""
_PARTS = 4
"""Parts for each thread, so that the others take over the share of a thread that falls behind."""

_pool: ThreadPoolExecutor | None = None
_pool_lock = threading.Lock()


def count_cores() -> int:
    """The number of cores that this process may use."""
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
    """Calls a function on checked inputs of a batch; several threads share it where that pays."""
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
    """The number of threads of a method's keyword, 0 for one per core.

    Raises:
        InputTypeError: If it is neither a positive integer nor "all".
    """
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
    """Calls work on operands and results of N rows; several threads share them where that pays."""
    threads, n_parts = _division(len(results[0]) * cost, threads)
    _, cuts = _cut((len(results[0]),), n_parts)
    if len(cuts) < 2:  # noqa: PLR2004
        work(*operands, out=tuple(results))
        return
    parts = (tuple(array[cut] for array in (*operands, *results)) for cut in cuts)
    _share(work, iter([*parts]), len(operands), threads)


def _division(work: int, threads: int) -> tuple[int, int]:
    """The numbers of threads and of parts that suit some floating-point operations."""
    cores = count_cores()
    threads = max(min(threads or cores, cores, work // _LEAST), 1)
    return threads, max(threads * _PARTS if threads > 1 else 1, math.ceil(work / _MOST))


def _cut(batch: tuple[int, ...], n_parts: int) -> tuple[int, list[slice]]:
    """The first dimension that is long enough for all parts, or else the longest, and its parts."""
    if n_parts < 2 or not batch:  # noqa: PLR2004
        return 0, []
    enough = (axis for axis, size in enumerate(batch) if size >= n_parts * _ROWS)
    axis = next(enough, int(np.argmax(batch)))
    tiles = batch[axis] // _ROWS
    n_parts = min(n_parts, tiles)
    bounds = [tiles * k // n_parts * _ROWS for k in range(n_parts)] if n_parts else []
    return axis, [slice(*pair) for pair in itertools.pairwise([*bounds, batch[axis]])]


def _parts(array: FloatArray, axis: int, cuts: Sequence[slice]) -> Iterator[FloatArray]:
    """The parts of an operand, each of them the whole operand where the axis is broadcast."""
    if axis < 0 or array.shape[axis] == 1:
        return itertools.repeat(array, len(cuts))
    before = (slice(None),) * axis
    return (array[(*before, cut)] for cut in cuts)


def _overlap(inputs: Sequence[FloatArray], outs: Sequence[FloatArray | None]) -> bool:
    """Whether one part might write into memory that another reads.

    NumPy handles overlap within one call only. Arrays with interleaved memory, such as columns of
    one table, count as overlapping.
    """
    given = [out for out in outs if out is not None]
    pairs = itertools.chain(itertools.product(inputs, given), itertools.combinations(given, 2))
    return any(np.may_share_memory(a, b) for a, b in pairs)


def _share(
    ufunc: Callable[..., Any], parts: Iterator[tuple[FloatArray, ...]], n: int, threads: int
) -> None:
    """Runs the ufunc on all parts; each thread takes the next remaining part."""

    def work() -> None:
        for part in parts:
            ufunc(*part[:n], out=part[n:])

    # Most programs use one thread, and this import takes a tenth of the time of importing chasles.
    from concurrent.futures import wait  # noqa: PLC0415

    helpers: list[Future[None]] = []
    # Where no thread can be started (the system has no more, the interpreter shuts down), the
    # calling thread does all the work.
    with contextlib.suppress(RuntimeError):
        for _ in range(threads - 1):
            helpers.append(_get_pool().submit(work))
    try:
        work()
    except KeyboardInterrupt:
        for _ in parts:
            pass  # The helpers find no part left.
        raise
    finally:
        # No helper may write after the caller has its array back. A helper that has not begun finds
        # no part left.
        wait([helper for helper in helpers if not helper.cancel()])
    for helper in helpers:
        if not helper.cancelled():
            helper.result()


def _get_pool() -> ThreadPoolExecutor:
    from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415

    global _pool  # noqa: PLW0603
    with _pool_lock:
        if _pool is None:
            _pool = ThreadPoolExecutor(count_cores(), thread_name_prefix="chasles")
        return _pool


def _forget_pool() -> None:
    """Drops the pool in a child process, which lacks the threads and may inherit a held lock."""
    global _pool, _pool_lock
    _pool, _pool_lock = None, threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)
