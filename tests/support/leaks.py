"""Checks that calls leave no references and no allocated memory behind."""

import gc
import sys

_CALLS = 200
_ROUNDS = 3


def assert_no_leaks(calls, watched, settle=gc.collect):
    """Repeat each call, and compare reference counts and the number of allocated memory blocks.

    A leak adds at least one memory block per call in each round.
    """
    for call in calls:
        _repeat(call, 3, settle)
        references, growth = list(map(sys.getrefcount, watched)), []
        for _ in range(_ROUNDS):
            before = sys.getallocatedblocks()
            _repeat(call, _CALLS, settle)
            growth.append(sys.getallocatedblocks() - before)
        assert list(map(sys.getrefcount, watched)) == references
        assert min(growth) < _CALLS // 2


def _repeat(call, count, settle):
    """Repeat a call `count` times, and then wait until unused objects are freed."""
    for _ in range(count):
        call()
    settle()
