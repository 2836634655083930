"""Waits until another process or thread fulfills a condition."""

import time
from collections.abc import Callable

SECONDS = 600.0
"""Maximum wait (seconds), far longer than needed even on a busy machine."""


def until(holds: Callable[[], object], pause: float = 0.03) -> None:
    """Wait until a condition holds.

    After SECONDS seconds, raise an AssertionError.
    """
    end = time.monotonic() + SECONDS
    while not holds():
        assert time.monotonic() < end, f"the condition did not hold within {SECONDS:g} s"
        time.sleep(pause)
