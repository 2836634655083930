"""Process the pieces of a sample set on threads or on a dask cluster.

The combined result of a study must not depend on the order of the pieces. Integer counts, bits,
minima and maxima can be combined in any order, but sums of floats cannot. So the result of a study
is identical, bit for bit, for any number of threads and workers. If a worker is killed, another
worker can process the same piece of the sample set again.
"""

from __future__ import annotations

import itertools
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any, Literal, Protocol, Self, TypeVar

from chasles import InputValueError, count_cores
from chasles.contract import requires

Threads = int | Literal["all"]

_PIECES_A_TASK = 64
"""Number of pieces of a sample set that a worker processes in one task. A task of this size takes a
few seconds, so workers communicate little, and little work is lost if a worker is killed."""
_TASKS_A_WORKER = 2
"""Number of queued tasks per worker. A second task in the queue lets a worker start its next task
without waiting."""
_RETRIES = 5
"""Maximum number of repetitions of a task after its worker was killed."""


class Tally(Protocol):
    """Statistics of a part of a sample set.

    The statistics of two parts of a sample set can be merged.
    """

    def merge(self, other: Self) -> None:
        """Merge the statistics of another part of the sample set into this object."""


T = TypeVar("T", bound=Tally)


class Work(Protocol[T]):
    """Interface of an object that processes the pieces of a sample set.

    Each worker of a cluster gets a copy of this object.
    """

    def empty(self) -> T:
        """Return statistics in which all counts are zero."""

    def add(self, tally: T, piece: int) -> None:
        """Process one piece of the sample set, and add the resulting counts to `tally`."""


def tallied(
    work: Work[T],
    pieces: int,
    *,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
    name: str = "study",
) -> T:
    """Process all pieces of a sample set, and return their merged statistics.

    Args:
        work: Object that processes the pieces of the sample set, one per call.
        pieces: Number of pieces of the sample set.
        threads: Number of threads of this process or of each worker, or "all" for one thread per
            core.
        client: A `dask.distributed.Client` whose workers share the work, or None for computation in
            this process.
        progress: Whether to show a progress bar. None shows the bar only if standard error is a
            terminal.
        name: Name that the progress bar shows.

    Raises:
        InputValueError: `threads` is neither a positive integer nor "all".
    """
    count = thread_count(threads)
    with progress_of(name, pieces, progress) as advance:
        if client is None:
            return _on_threads(work, range(pieces), count, advance)
        return _on_workers(work, pieces, count, client, advance)


def thread_count(threads: Threads) -> int:
    """Return `threads` as a number, where "all" means one thread per core.

    Raises:
        InputValueError: `threads` is neither a positive integer nor "all".
    """
    if threads == "all":
        return count_cores()
    if not isinstance(threads, int) or threads < 1:
        raise InputValueError(f"threads = {threads!r}: expected a positive number or 'all'")
    return threads


def _on_threads(
    work: Work[T], pieces: Sequence[int], threads: int, advance: Callable[[int], None]
) -> T:
    rest = iter(pieces)
    taken = threading.Lock()
    stopped = threading.Event()

    def done() -> T:
        tally = work.empty()
        try:
            while not stopped.is_set():
                with taken:
                    piece = next(rest, None)
                if piece is None:
                    break
                work.add(tally, piece)
                advance(1)
        except BaseException:
            stopped.set()
            raise
        return tally

    threads = max(min(threads, len(pieces)), 1)
    if threads == 1:
        return done()
    with ThreadPoolExecutor(threads) as pool:
        futures = [pool.submit(done) for _ in range(threads)]
        try:
            tallies = [future.result() for future in futures]
        finally:
            stopped.set()
    return _merged(tallies)


def _on_workers(
    work: Work[T], pieces: int, threads: int, client: Any, advance: Callable[[int], None]
) -> T:
    with requires("chasles[cluster]"):
        from distributed import as_completed  # noqa: PLC0415

    begins = range(0, pieces, _PIECES_A_TASK)
    tasks = iter([range(k, min(k + _PIECES_A_TASK, pieces)) for k in begins])

    def submitted(some: Iterator[Sequence[int]]) -> list[Any]:
        return [
            client.submit(_task, work, own, threads, pure=False, retries=_RETRIES) for own in some
        ]

    at_once = _TASKS_A_WORKER * max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
    running = as_completed(  # type: ignore[no-untyped-call]
        submitted(itertools.islice(tasks, at_once))
    )
    complete = work.empty()
    for future in running:
        tally, count = future.result()
        complete.merge(tally)
        advance(count)
        for more in submitted(itertools.islice(tasks, 1)):
            running.add(more)  # type: ignore[no-untyped-call]
    return complete


def _task(work: Work[T], pieces: Sequence[int], threads: int) -> tuple[T, int]:
    return _on_threads(work, pieces, threads, lambda _: None), len(pieces)


def _merged(tallies: list[T]) -> T:
    first, *others = tallies
    for other in others:
        first.merge(other)
    return first


@contextmanager
def progress_of(
    name: str, total: int, shown: bool | None = None
) -> Iterator[Callable[[int], None]]:
    """Show a progress bar with the remaining time.

    Args:
        name: Name of the task that the progress bar shows.
        total: Number of work items that the progress bar counts.
        shown: Whether to show the progress bar. If `shown` is None, the progress bar appears only
            if standard error is a terminal. Without the package rich, no bar is shown.

    Yields:
        A function that advances the progress bar by a number of newly completed work items.
    """
    is_drawn = sys.stderr.isatty() if shown is None else shown
    if not is_drawn or find_spec("rich") is None:
        yield lambda _: None
        return
    from rich.console import Console  # noqa: PLC0415
    from rich.progress import Progress  # noqa: PLC0415

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=total)
        yield lambda count: bar.advance(task, count)
