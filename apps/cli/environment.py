"""The subcommands `build`, `cache` and `doctor`."""

from __future__ import annotations

import platform
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from chasles import ChaslesError, robots
from chasles.contract import TEMPORARY, Manifest, read_manifest, remove_abandoned_folders
from chasles.library import build as compile_robot
from chasles.library import cache_folder, find_compiler, find_folder, options_of

from .console import err, print_json, say
from .options import Base, Exact, Json, Tip, add, names
from .portable import write_portable

_MEGABYTE = 1e6
_PROGRAMS = {"pdflatex": "articles as PDF (chasles pdf)"}
_LIBRARY = re.compile(r"[a-z]\w*-[0-9a-f]{32}(-[0-9a-f]{16})?\.so")
_DISTRIBUTION = re.compile(r"[\w.-]+")
"""Pattern of the name at the start of a requirement, such as lxml in "lxml>=5"."""
_EXTRAS_OF = re.compile(r"chasles\[([\w,]+)\]")
"""A requirement that installs other extras of chasles, such as "chasles[derive,files]"."""
_EXTRAS = (
    *("cli", "derive", "files", "calibration", "study", "planning", "draw", "film", "view"),
    *("jax", "torch"),
)


def add_to(app: typer.Typer) -> None:
    """Add the subcommands to the command line."""
    add(app, build, "chasles build ur5e panda")
    add(app, cache, "chasles cache --clean")
    add(app, doctor, "chasles doctor")


def build(
    chosen: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[ROBOT]...",
            help="Names, folders or descriptions. Default: all generated robots.",
            autocompletion=names,
        ),
    ] = None,
    threads: Annotated[int, typer.Option(min=1, help="Number of robots at once.")] = 2,
    base: Base = None,
    tip: Tip = None,
    exact: Exact = False,
    portable: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Write folders that load on other machines of this platform, without a compiler.",
        ),
    ] = None,
) -> None:
    """Compile robots into the cache, or into portable folders."""
    words = options_of(exact, parametric=False, base=base, tip=tip)
    manifests = [read_manifest(find_folder(robot, words)) for robot in chosen or robots()]
    # The longest compilations start first, so that all threads end at nearly the same time.
    manifests.sort(key=_source_size, reverse=True)
    # Threads are sufficient, because the compiler works in separate processes.
    work = _build_one if portable is None else partial(_write_one, portable)
    with ThreadPoolExecutor(threads) as pool:
        failed = 0
        for report in pool.map(work, manifests):
            if report.failed:
                err.print(report.line, style="red", markup=False)
            else:
                say(report.line)
            failed += report.failed
    if failed:
        raise typer.Exit(1)


def _source_size(manifest: Manifest) -> int:
    paths = map(manifest.path_of, manifest.c_files)
    return sum(path.stat().st_size for path in paths if path.is_file())


@dataclass(frozen=True)
class _Report:
    line: str
    failed: bool


def _build_one(manifest: Manifest) -> _Report:
    return _timed(manifest, lambda: "compiled" if compile_robot(manifest) else "in the cache")


def _write_one(folder: Path, manifest: Manifest) -> _Report:
    return _timed(manifest, lambda: f"written to {write_portable(manifest, folder)}")


def _timed(manifest: Manifest, work: Callable[[], str]) -> _Report:
    start = time.perf_counter()
    try:
        result = work()
    except ChaslesError as error:
        return _Report(f"{manifest.name}: {error}", failed=True)
    seconds = time.perf_counter() - start
    return _Report(f"{manifest.name:<24} {result:<12} {seconds:7.3f} s", failed=False)


def cache(
    clean: Annotated[
        bool, typer.Option("--clean", help="Remove all compiled and derived robots.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show the folder of compiled and derived robots, and its size."""
    folder = cache_folder()
    derived = folder / "derived"
    entries = [path for path in sorted((*folder.glob("*"), *derived.glob("*"))) if _is_entry(path)]
    files = [path for entry in entries for path in (entry, *entry.rglob("*")) if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    for entry in entries if clean else ():
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
    if clean:
        remove_abandoned_folders(folder)
        remove_abandoned_folders(derived)
        with suppress(OSError):
            derived.rmdir()
    if as_json:
        print_json({"folder": str(folder), "files": len(files), "bytes": size, "removed": clean})
        return
    done = "removed from" if clean else "in"
    say(f"{len(files)} files, {size / _MEGABYTE:.1f} MB, {done} {folder}")


def _is_entry(path: Path) -> bool:
    """Whether a path is a compiled library or the folder of a derived robot.

    The user can set CHASLES_CACHE to a folder that also contains unrelated files.
    """
    if path.parent.name == "derived":
        return not path.name.startswith(TEMPORARY)
    return bool(_LIBRARY.fullmatch(path.name))


def doctor(as_json: Json = False) -> None:
    """Show versions, the compiler, the cache and missing packages."""
    found = {
        "chasles": version("chasles"),
        "python": f"{platform.python_version()} ({sys.executable})",
        "numpy": np.__version__,
        "system": f"{platform.system()} {platform.machine()}",
        "compiler": _compiler_state(),
        "cache": _cache_state(cache_folder()),
        **{f"chasles[{extra}]": _extra_state(extra) for extra in _EXTRAS},
        **{
            program: shutil.which(program) or f"not found; needed for {use}"
            for program, use in _PROGRAMS.items()
        },
    }
    if as_json:
        print_json(found)
        return
    for name, state in found.items():
        say(f"{name:<22} {state}")


def _compiler_state() -> str:
    """Return the C compiler with its version, or the reason why there is none."""
    try:
        command = find_compiler().command
    except ChaslesError as error:
        return str(error)
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    return f"{shlex.join(command)}: {lines[0] if lines else 'unknown version'}"


def _cache_state(folder: Path) -> str:
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    try:
        probe = existing / f".chasles-{time.time_ns()}"
        probe.touch(exist_ok=False)
        probe.unlink()
    except OSError as error:
        return f"{folder} cannot be written ({error.strerror}); set CHASLES_CACHE"
    return str(folder)


def _extra_state(extra: str) -> str:
    """Return the packages of an extra that are missing."""
    missing = [name for name in _packages(extra) if not _is_installed(name)]
    if not missing:
        return "installed"
    # The extra `all` leaves out packages that few users need.
    optional = "" if extra in _of_all() else "optional, not part of chasles[all]; "
    return f"{optional}needs {', '.join(missing)}: pip install 'chasles[{extra}]'"


def _of_all() -> set[str]:
    """Return the names of the extras that `pip install 'chasles[all]'` installs."""
    named = [_EXTRAS_OF.fullmatch(requirement) for requirement in _packages("all")]
    return {extra for match in named if match for extra in match[1].split(",")}


def _packages(extra: str) -> list[str]:
    marker = f'extra == "{extra}"'
    lines = metadata("chasles").get_all("Requires-Dist") or []
    return [line.split(";")[0].rstrip() for line in lines if marker in line.replace("'", '"')]


def _is_installed(requirement: str) -> bool:
    name = _DISTRIBUTION.match(requirement)
    assert name is not None
    try:
        version(name[0])
    except PackageNotFoundError:
        return False
    return True
