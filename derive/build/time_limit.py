"""A limit on the time of a derivation, and the place where it was when the time was over."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from ..model.errors import RobotError

ROOM = Path(__file__).resolve().parents[1]
REPEATED = 1.0
"""Seconds until the signal comes again, where a library has caught it."""


class OutOfTime(RobotError):
    """A derivation took longer than its limit; the message says where it was."""


class _Alarm(BaseException):
    """The signal of the timer; no library that catches errors of its own catches it."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Ends the work in its body when the time is over.

    Args:
        seconds: The limit; 0 is none.

    Raises:
        OutOfTime: The body took longer.

    It works in the main thread of a process, on systems that have an interval timer.
    """
    if seconds == 0:
        yield
        return
    places: list[str] = []

    def ring(_: int, frame: FrameType | None) -> None:
        places.append(_place(frame))
        raise _Alarm

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds, REPEATED)
    try:
        yield
    except _Alarm:
        raise OutOfTime(_message(seconds, places[0])) from None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _message(seconds: float, place: str) -> str:
    return (
        f"the derivation takes longer than {seconds:g} s; when it was stopped it was in {place}. "
        "Fewer named parameters or decimals of fewer digits take less time; --limit sets the limit"
    )


def _place(frame: FrameType | None) -> str:
    """The innermost function of the compiler in which a frame is."""
    while frame is not None:
        file = Path(frame.f_code.co_filename)
        if ROOM in file.parents and file.parent.name != "build":
            return f"{frame.f_code.co_name} of {file.relative_to(ROOM).as_posix()}"
        frame = frame.f_back
    return "a library"
