"""Robots that tests derive themselves: written without an article, and compiled in little time."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

import chasles
from chasles.derive import write
from chasles.derive.emit.languages import EMITTERS
from chasles.derive.model.mechanism import Described

CALLED = ("c", "casadi", "python")
"""The languages that are called; the article is a third of the time of a derivation."""
CACHE = Path(__file__).parents[2] / "build" / "compiled"
"""Libraries of all tests, by content: each is compiled once for all workers and for later runs."""


@contextmanager
def compiled_quickly() -> Iterator[None]:
    """In its body, robots are compiled at -O1 into a cache of the tests.

    A calibrated arm takes 5 s instead of the 11 s of users' -O3. Shipped robots are no subject of
    it: tests call them as users have them.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(CACHE))
        patch.setenv("CHASLES_CFLAGS", "-O1")
        patch.delenv("CC", raising=False)
        yield


def compiled(
    robot: Described,
    folder: Path,
    functions: Sequence[str] | None = None,
    languages: Sequence[str] = CALLED,
) -> chasles.Robot:
    """A robot that is derived, written into a folder, compiled at -O1 and loaded.

    Args:
        robot: The description.
        folder: The robot's own folder.
        functions: The functions to derive, all by default.
        languages: The languages to write, those that are called by default.
    """
    write(robot, folder, functions, [own for own in EMITTERS if own.language in languages])
    return loaded(folder)


def loaded(folder: Path) -> chasles.Robot:
    """The robot of a folder, compiled at -O1."""
    with compiled_quickly():
        return chasles.load(folder)
