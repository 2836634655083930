"""Runs a function in a forked worker process."""

import pickle
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

Result = TypeVar("Result")


@contextmanager
def run_in_fork(work: Callable[[], Result]) -> Iterator[Callable[[], Result]]:
    """Run a function in a forked process, with a copy of this process's state.

    On systems other than Linux, or while other threads run, no process is forked. The calling
    process then runs the function when the result is requested.

    Args:
        work: The function to run. The result of the function must be plain data.

    Yields:
        A function that waits for the result of ``work`` and returns the result. If ``work`` raised
        an error, the yielded function raises this error. The process ends at the end of the
        ``with`` block.
    """
    if sys.platform != "linux" or threading.active_count() > 1:
        yield work
        return
    with forked(work) as receiver:
        yield partial(_wait, receiver)


@contextmanager
def forked(work: Callable[[], object]) -> Iterator[Connection]:
    """Run a function in a forked process.

    The process ends at the end of the ``with`` block.

    Yields:
        The connection from which ``received`` reads the result or the error.
    """
    context = get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(work, sender))
    with warnings.catch_warnings():
        # Python 3.12 warns about forks while other threads run. The warning is suppressed because
        # the caller decides whether to fork.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    try:
        yield receiver
    finally:
        process.kill()
        process.join()
        receiver.close()


def _send(work: Callable[[], object], sender: Connection) -> None:
    sender.send(outcome_of(work))


def outcome_of(work: Callable[[], object]) -> tuple[bool, object]:
    """Call a function and return (True, its result) or (False, its error)."""
    try:
        return True, work()
    except BaseException as error:
        return False, _picklable(error)


def received(receiver: Connection) -> Any:
    """Receive the result of a function in a forked process, or raise the error of the function.

    Raises:
        EOFError: The process ended without a result.
    """
    is_done, outcome = receiver.recv()
    if not is_done:
        raise outcome
    return outcome


def _picklable(error: BaseException) -> BaseException:
    """Return the error. An error that cannot be pickled becomes a RuntimeError."""
    text = "".join(traceback.format_exception(error))
    # The cause and the context of the error may be errors of lxml, which cannot be pickled. With
    # dask, pickle includes the cause and the context of an error, so both are removed.
    error.__cause__ = error.__context__ = None
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(text)
    return error


def _wait(receiver: Connection) -> Any:
    try:
        return received(receiver)
    except EOFError:
        raise RuntimeError("the operating system ended a forked worker process") from None
