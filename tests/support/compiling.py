"""Derives and compiles test robots once for all worker processes of a test run."""

import hashlib
import io
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from functools import cache
from importlib import import_module
from pathlib import Path
from subprocess import CompletedProcess

import pytest

import chasles
import chasles.derive
from chasles.cli import app
from chasles.contract import Manifest
from chasles.derive import read, write
from chasles.derive.build import generate
from chasles.derive.description.importers import chains
from chasles.derive.emit.manifest import description_text
from chasles.derive.model.mechanism import Described
from chasles.library import cache as cache_module
from chasles.library import derived
from chasles.library.cache import Recipe
from tests.support.derivations import GENERATED, description
from tests.support.locking import locked

CALLED = ("c", "casadi", "python")
"""Callable output languages."""
BUILD = Path(__file__).parents[2] / "build" / "tests"
"""Cache of generated folders and compiled libraries."""
IDENTIFICATION = ("fk", "fk_p", "jacobian_p", "identification_jacobian")
"""Names of the robot functions that a parameter identification calls."""

QUICK, FAST = "-O0", "-O1"
"""Compiler flags. Compiling a calibrated arm takes 2.5 s with QUICK, 5 s with FAST and 11 s with
-O3."""
COMPILER = shutil.which("clang") and "clang"
"""The command ``clang``, or None if Clang is not installed. At -O0, Clang compiles three times
faster than GCC. GCC compiles the shipped robots."""
TCC = shutil.which("tcc") and "tcc"
"""tcc is ten times faster than Clang at -O0, but compiles neither vector code nor the general
solver of built arms."""


@contextmanager
def compiled_quickly(flags: str = QUICK) -> Iterator[None]:
    """Context in which robots are compiled with ``flags`` into the test cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(BUILD))
        patch.setenv("CHASLES_CFLAGS", flags)
        patch.delenv("CC", raising=False)
        if chosen := (flags == QUICK and TCC) or COMPILER:
            patch.setenv("CC", chosen)
        yield


@contextmanager
def compiled_with_vectors() -> Iterator[None]:
    """Context in which ``compiled_quickly`` uses Clang, because tcc cannot compile vectors."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"{__name__}.TCC", None)
        yield


def derived_here(command: Sequence[str]) -> CompletedProcess[str]:
    """Run the compiler of chasles in the test process, which has already imported SymPy."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err), reading_here():
        code = app.run(command[command.index("derive") :])
    return CompletedProcess(command, code, out.getvalue(), err.getvalue())


@contextmanager
def reading_here() -> Iterator[None]:
    """Context in which robot files are read in the test process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chains, "isolated", lambda work, _: work())
        yield


@contextmanager
def printing_here() -> Iterator[None]:
    """Context in which LaTeX articles are printed in the test process, not in forked processes."""

    @contextmanager
    def run_later(work: Callable[[], object]) -> Iterator[Callable[[], object]]:
        yield work

    with pytest.MonkeyPatch.context() as patch:
        for module in (import_module("chasles.derive.latex.document"), generate):
            patch.setattr(module, "run_in_fork", run_later)
        yield


@contextmanager
def own_robots_compiled_quickly() -> Iterator[None]:
    """Context in which robots outside the folder `GENERATED` are compiled quickly."""
    make_recipe = cache_module.make_recipe

    def make(manifest: Manifest) -> Recipe:
        if manifest.folder.resolve().parent == GENERATED:
            return make_recipe(manifest)
        with compiled_quickly():
            return make_recipe(manifest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cache_module, "make_recipe", make)
        patch.setattr(derived, "_finished", derived_here)
        yield


@contextmanager
def deriving_only(*functions: str) -> Iterator[None]:
    """Context in which `chasles.load` derives only the named functions, without a new process.

    Robots loaded with `parametric=True` get only the functions in `IDENTIFICATION`. Robots derived
    without `parametric=True` get the functions in `functions`, or all functions if `functions` is
    empty.
    """
    load = chasles.load
    home = tempfile.TemporaryDirectory()

    def load_quickly(name: str, *, parametric: bool = False, **options) -> chasles.Robot:
        is_file = Path(name).suffix == ".toml"
        if not (parametric or is_file or name in chasles.shelf_robots()):
            return load(name, **options)
        wanted = IDENTIFICATION if parametric else functions or None
        folder = Path(tempfile.mkdtemp(dir=home.name)) / Path(name).stem
        return compiled(read(name if is_file else description(name)), folder, wanted, ["c"])

    with home, pytest.MonkeyPatch.context() as patch:
        patch.setattr(chasles, "load", load_quickly)
        yield


def compiled(
    robot: Described,
    folder: Path,
    functions: Sequence[str] | None = None,
    languages: Sequence[str] = CALLED,
    flags: str = QUICK,
) -> chasles.Robot:
    """Derive, compile and load a robot.

    Concurrent tests of the same robot wait until its first derivation ends.

    Args:
        robot: The description.
        folder: Output folder of the derived robot.
        functions: Names of the functions to derive, or None for all functions.
        languages: Output languages of the derivation. By default, these are the callable languages.
        flags: Compiler flags.
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
    """Load the robot of a folder, compiled once for all tests."""
    recipe = (folder / "manifest.json").read_bytes() + f"{COMPILER} {flags}".encode()
    digest = hashlib.sha256(recipe).hexdigest()
    with compiled_quickly(flags), locked(BUILD / "libraries" / digest):
        return chasles.load(folder)


@cache
def _compiler_digest() -> str:
    """Return the SHA-256 hash of the compiler sources.

    A changed hash forces new derivations.
    """
    root = Path(chasles.derive.__file__).parent
    files = sorted(p for p in root.rglob("*") if p.suffix in (".py", ".h"))
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()
