"""Robots that tests derive themselves: derived and compiled once for all workers of a run."""

import hashlib
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

import chasles
import chasles.derive
from chasles.contract import Manifest
from chasles.derive import write
from chasles.derive.emit.manifest import description_text
from chasles.derive.model.mechanism import Described
from chasles.library import cache as cache_module
from chasles.library.cache import Recipe
from tests.support.derivations import GENERATED
from tests.support.locking import locked

CALLED = ("c", "casadi", "python")
"""The languages that are called; the article is a third of the time of a derivation."""
BUILD = Path(__file__).parents[2] / "build" / "tests"
"""Derived folders and compiled libraries of all tests, by content, for all workers and runs."""
BOARD = BUILD / "board_installer"
"""A lock for `chasles.load("board_installer", parametric=True)`, which derives it for 12 s."""

QUICK, FAST = "-O0", "-O1"
"""Flags: QUICK compiles a calibrated arm in 2.5 s instead of the 11 s of users' -O3. FAST takes
5 s, and is for tests with tens of thousands of poses.
"""
COMPILER = shutil.which("clang") and "clang"
"""Clang compiles in a third of GCC's time at -O0. GCC compiles the shipped robots."""


@contextmanager
def compiled_quickly(flags: str = QUICK) -> Iterator[None]:
    """In its body, robots are compiled with some flags into a cache of the tests.

    Shipped robots are not loaded in it: tests call them as users have them.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(BUILD))
        patch.setenv("CHASLES_CFLAGS", flags)
        patch.delenv("CC", raising=False)
        if COMPILER:
            patch.setenv("CC", COMPILER)
        yield


@contextmanager
def own_robots_compiled_quickly() -> Iterator[None]:
    """In its body, robots that are not shipped are compiled as by `compiled_quickly`."""
    make_recipe = cache_module.make_recipe

    def make(manifest: Manifest) -> Recipe:
        if manifest.folder.resolve().parent == GENERATED:
            return make_recipe(manifest)
        with compiled_quickly():
            return make_recipe(manifest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cache_module, "make_recipe", make)
        yield


def compiled(
    robot: Described,
    folder: Path,
    functions: Sequence[str] | None = None,
    languages: Sequence[str] = CALLED,
    flags: str = QUICK,
) -> chasles.Robot:
    """A robot that is derived, put into a folder, compiled and loaded.

    Each robot is derived once: a test that needs it while another derives it waits.

    Args:
        robot: The description.
        folder: The robot's own folder.
        functions: The functions to derive, all by default.
        languages: The languages to write, by default the ones that are called.
        flags: The compiler's flags.
    """
    words = (description_text(robot), repr(functions), repr(sorted(languages)), _compiler_digest())
    key = hashlib.sha256("\0".join(words).encode()).hexdigest()
    home = BUILD / "folders" / key
    with locked(home):
        if not home.is_dir():
            made = home.with_suffix(".new")
            shutil.rmtree(made, ignore_errors=True)
            write(robot, made, functions=functions, languages=languages)
            made.rename(home)
    shutil.copytree(home, folder, dirs_exist_ok=True)
    return loaded(folder, flags)


def loaded(folder: Path, flags: str = QUICK) -> chasles.Robot:
    """The robot of a folder, compiled once for all tests."""
    recipe = (folder / "manifest.json").read_bytes() + f"{COMPILER} {flags}".encode()
    digest = hashlib.sha256(recipe).hexdigest()
    with compiled_quickly(flags), locked(BUILD / "libraries" / digest):
        return chasles.load(folder)


@cache
def _compiler_digest() -> str:
    """SHA-256 of the sources of the compiler: a change of it derives all robots again."""
    root = Path(chasles.derive.__file__).parent
    files = sorted(p for p in root.rglob("*") if p.suffix in (".py", ".h"))
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()
