"""Work on the pieces of a sample set: on threads, or on the workers of a dask cluster.

What a piece adds to a tally must not depend on the order of the pieces: counts, bits and extremes
do not, sums of floats would. Then the result is the same, bit for bit, for any number of threads
and workers, and a piece whose worker was killed is simply done again.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal, Protocol, Self, TypeVar

from chasles import InputValueError, count_cores

from .progress import progress_of

Threads = int | Literal["all"]

_PIECES_A_TASK = 64
"""Pieces that a worker of a cluster does between two reports: seconds of work, so that sending the
tally costs little and a killed worker loses little."""
_TASKS_A_WORKER = 2
"""Tasks that a worker has at a time, so that it need not wait for the next; more would only make
finished tallies wait in memory."""
_RETRIES = 5
"""Times that a task is done again after its worker was killed."""


class Tally(Protocol):
    """Counts that pieces add to."""

    def merge(self, other: Self) -> None:
        """Adds the counts of another tally."""


T = TypeVar("T", bound=Tally)


class Work(Protocol[T]):
    """What is done with the pieces of a sample set; it is sent to the workers of a cluster."""

    def empty(self) -> T:
        """A tally without counts."""

    def add(self, tally: T, piece: int) -> None:
        """Adds what a piece holds."""


def tallied(
    work: Work[T],
    pieces: int,
    *,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
    name: str = "study",
) -> T:
    """The tally of all pieces.

    Args:
        work: What is done with a piece.
        pieces: Number of pieces.
        threads: Threads of this process, or of each worker; "all": one per core.
        client: A `dask.distributed.Client`, whose workers share the pieces; None: this process.
        progress: Whether to draw a bar; None: where the errors go to a terminal.
        name: The name of the bar.

    Raises:
        InputValueError: threads is neither a positive number nor "all".
    """
    count = thread_count(threads)
    with progress_of(name, pieces, progress) as advance:
        if client is None:
            return _on_threads(work, range(pieces), count, advance)
        return _on_workers(work, pieces, count, client, advance)


def thread_count(threads: Threads) -> int:
    """The number of threads that an argument stands for.

    Raises:
        InputValueError: It is neither a positive number nor "all".
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
    whole = work.empty()
    for future in running:
        tally, count = future.result()
        whole.merge(tally)
        advance(count)
        for more in submitted(itertools.islice(tasks, 1)):
            running.add(more)  # type: ignore[no-untyped-call]
    return whole


def _task(work: Work[T], pieces: Sequence[int], threads: int) -> tuple[T, int]:
    return _on_threads(work, pieces, threads, lambda _: None), len(pieces)


def _merged(tallies: list[T]) -> T:
    first, *others = tallies
    for other in others:
        first.merge(other)
    return first
