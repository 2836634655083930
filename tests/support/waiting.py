"""Waits for a condition that another process or thread brings about."""

import time
from collections.abc import Callable

SECONDS = 600.0
"""The longest wait: far above what any condition takes on a busy machine."""


def until(holds: Callable[[], object], pause: float = 0.03) -> None:
    """Waits until a condition holds; fails after SECONDS."""
    end = time.monotonic() + SECONDS
    while not holds():
        assert time.monotonic() < end, f"the condition did not hold within {SECONDS:g} s"
        time.sleep(pause)
