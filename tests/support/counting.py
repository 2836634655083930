"""Counts the function calls of a piece of code.

The number of function calls does not depend on the machine or its load.
"""

import sys
from collections.abc import Callable
from typing import TypeVar

Result = TypeVar("Result")


def calls_of(work: Callable[[], object]) -> int:
    """Return the number of Python and C function calls made by ``work``.

    Tests bound the number of calls instead of the run time, because the number does not depend on
    the processor or on other processes. ``calls_of`` does not catch exceptions of ``work``.
    """
    count = 0

    def profile(_frame, event, _argument):
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(before)
    return count


class TooManyCallsError(BaseException):
    """Error for too many function calls, which no handler of ``Exception`` catches."""


def stopped_after(most: int, work: Callable[[], Result]) -> Result:
    """Return the result of ``work``, which may make at most ``most`` function calls.

    Raises:
        TooManyCallsError: ``work`` made more function calls than allowed and was stopped.
    """
    count = 0

    def profile(_frame, event, _argument):
        nonlocal count
        count += event in ("call", "c_call")
        if count > most:
            raise TooManyCallsError(f"more than {most} calls")

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        return work()
    finally:
        sys.setprofile(before)
