"""A time limit for a derivation, with a report that names the interrupted function."""

import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

from ..model.errors import DerivationError

ROOM = Path(__file__).resolve().parents[1]
REPEATED = 1.0
"""Seconds until the timer fires again, in case a library suppressed the exception of the first
timer signal."""


class OutOfTime(DerivationError):
    """The derivation of a robot exceeded its time limit."""


class _Alarm(BaseException):
    """An exception that the timer signal raises.

    Libraries that catch ``Exception`` do not catch ``_Alarm``.
    """


class at_most:  # noqa: N801
    """Context manager that interrupts the body of its ``with`` statement at the time limit.

    Args:
        seconds: Time limit in seconds. 0 means no time limit.

    Raises:
        OutOfTime: The body of the ``with`` statement exceeded the time limit.

    The time limit works only in the main thread and on systems with an interval timer.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._places: list[str] = []
        self._before: Any = None

    def __enter__(self) -> None:
        if self.seconds:
            self._before = signal.signal(signal.SIGALRM, self._ring)
            signal.setitimer(signal.ITIMER_REAL, self.seconds, REPEATED)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if not self.seconds:
            return
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, self._before)
        if kind is _Alarm:
            raise OutOfTime(_message(self.seconds, self._places[0])) from None

    def _ring(self, _: int, frame: FrameType | None) -> None:
        own = [way.__code__ for way in (at_most.__enter__, at_most.__exit__, at_most._ring)]
        if not any(inner.f_code in own for inner in _frames(frame)):
            self._places.append(_place(frame))
            raise _Alarm


def _frames(frame: FrameType | None) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back


def _message(seconds: float, place: str) -> str:
    return (
        f"the derivation took longer than {seconds:g} s and was stopped in {place}. Use fewer "
        "named parameters or shorter decimals, or raise --time-limit"
    )


def _place(frame: FrameType | None) -> str:
    for inner in _frames(frame):
        file = Path(inner.f_code.co_filename)
        if ROOM in file.parents and file.parent.name != "build":
            return f"{inner.f_code.co_name} of {file.relative_to(ROOM).as_posix()}"
    return "a library"
