"""Work in a process of its own, beside the work of this process."""

import pickle
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

Result = TypeVar("Result")


@contextmanager
def beside(work: Callable[[], Result]) -> Iterator[Callable[[], Result]]:
    """Begins work in a forked process, which has all that this process has made so far.

    The work is done here, when its result is asked for, where the system is not Linux, or another
    thread runs: the fork might catch a lock of that thread, which nobody would release.

    Args:
        work: Computes the result, which is plain data.

    Yields:
        A function that waits for the result; the error of the work is raised by it. The process
        ends with the body.
    """
    if sys.platform != "linux" or threading.active_count() > 1:
        yield work
        return
    context = get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=send, args=(work, sender))
    process.start()
    sender.close()
    try:
        yield partial(_wait, receiver)
    finally:
        process.kill()
        process.join()
        receiver.close()


def send(work: Callable[[], object], sender: Connection) -> None:
    """Does work and sends its outcome."""
    sender.send(outcome_of(work))


def outcome_of(work: Callable[[], object]) -> tuple[bool, object]:
    """Whether work ends without an error; its result, or else the error."""
    try:
        return True, work()
    except BaseException as error:
        return False, _picklable(error)


def received(receiver: Connection) -> Any:
    """The result that a process sends; an error of its work is raised.

    Raises:
        EOFError: The process ended before.
    """
    is_done, outcome = receiver.recv()
    if not is_done:
        raise outcome
    return outcome


def _picklable(error: BaseException) -> BaseException:
    """The error itself, or one that says the same where it cannot be sent."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError("".join(traceback.format_exception(error)))
    return error


def _wait(receiver: Connection) -> Any:
    try:
        return received(receiver)
    except EOFError:
        raise RuntimeError("a process beside this one was ended by the system") from None
