"""Derives robots from their description files on first use, and stores them in the cache.

The runtime starts `python -m chasles derive` in a separate process. The folder name contains
hashes of the description, of the files that it includes, and of the sources of chasles.derive.
"""

from __future__ import annotations

import contextlib
import functools
import glob
import hashlib
import sys
import warnings
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .. import contract
from ..contract import MAX_DESCRIPTION, UnknownRobotError, read_input
from ..errors import CacheError, DerivationError
from .cache import cache_folder

_COMPILER = "chasles.derive"
_GENERATED = ("chasles.generated", "chasles_robots")
"""Packages of generated robots."""
SUFFIXES = (".toml", ".urdf", ".xacro", ".xml", ".sdf")
"""File suffixes of robot files, URDF, xacro, MJCF and SDF."""
_DESCRIBED_BY, _SOURCES = "description.txt", "sources.txt"
"""Files next to the folder of a derived robot: the description path with the compiler options, and
the digests and paths of all files that the compiler read."""
PARAMETRIC = "--parametric"
"""The option of `chasles derive` for parametric functions."""
_WARNING = "warning: "
_FIXED = "--fixed"


def generated_folders() -> list[Path]:
    """Return the folders of the installed packages of generated robots."""
    specs = map(find_spec, _GENERATED)
    return [Path(at) for spec in specs if spec for at in spec.submodule_search_locations or ()]


def shelf() -> dict[str, Path]:
    """Return the installed descriptions of well-known arms, keyed by name."""
    return _descriptions("robots/shelf/*.toml")


def shipped() -> dict[str, Path]:
    """Return the descriptions of the installed generated robots, keyed by name."""
    return _descriptions("robots/*.toml")


def _descriptions(pattern: str) -> dict[str, Path]:
    root = _compiler_folder()
    files = sorted(root.glob(pattern)) if root else []
    return {file.stem: file for file in files}


def is_description(path: Path) -> bool:
    """Test whether a path refers to a description file rather than a folder."""
    return path.suffix.lower() in SUFFIXES and not path.is_dir()


def options_of(exact: bool, parametric: bool, **named: str | None) -> tuple[str, ...]:
    """Return the options of `chasles derive` for the keywords of `chasles.load`."""
    words = [word for key, value in named.items() if value for word in (f"--{key}", value)]
    return (*words, *["--exact"] * exact, *[PARAMETRIC] * parametric)


def options_for_fixed(names: Sequence[str], inverse: str) -> tuple[str, ...]:
    """Return the compiler options for an inverse kinematics function with fixed joints."""
    return (_FIXED, ",".join(names), "--functions", f"fk,fk_jacobian_mixed,{inverse}")


def derived_folder(description: Path, options: Sequence[str] = ()) -> Path:
    """Return the generated folder of a description, derived first if it is not in the cache.

    Raises:
        UnknownRobotError: If the description cannot be read, or describes several robots.
        DerivationError: If the compiler is not installed or rejects the description.
        CacheError: If the cache is not writable, or holds a damaged folder.
    """
    home = _found(description, options) or _derive(description, options)
    robots = sorted(manifest.parent for manifest in home.glob("*/manifest.json"))
    if not robots:
        raise CacheError(f"{home}: the robot files are missing; delete this folder")
    if len(robots) > 1:
        names = ", ".join(robot.name for robot in robots)
        raise UnknownRobotError(
            f"{description}: the file describes several robots ({names}); before "
            f"chasles.load('./robots/{robots[0].name}'), run chasles derive {description} "
            "--to robots"
        )
    return robots[0]


def description_of(folder: Path) -> tuple[Path, tuple[str, ...]] | None:
    """Return the description path and compiler options of a robot folder, or None if unknown."""
    if _homes() in folder.parents:
        note = folder.parent / _DESCRIBED_BY
        path, *options = note.read_text(encoding="utf-8").splitlines() if note.is_file() else [""]
        return (Path(path), tuple(options)) if Path(path).is_file() else None
    known = shipped() | shelf() if folder.parent in generated_folders() else {}
    return (known[folder.name], ()) if folder.name in known else None


def is_of_shelf(folder: Path) -> bool:
    """Test whether a folder is the derived folder of a well-known arm."""
    if _homes() not in folder.parents:
        return False
    description = shelf().get(folder.name)
    return description is not None and _found(description) == folder.parent


def _compiler_folder() -> Path | None:
    spec = find_spec(_COMPILER)
    roots = spec.submodule_search_locations if spec else None
    return Path(roots[0]) if roots else None


def _homes() -> Path:
    return cache_folder() / "derived"


def _found(description: Path, options: Sequence[str] = ()) -> Path | None:
    homes = _homes().glob(f"{glob.escape(_prefix(description, options))}*")
    return next((home for home in homes if _is_current(home, description)), None)


def _prefix(description: Path, options: Sequence[str]) -> str:
    try:
        content = hashlib.sha256(read_input(description, MAX_DESCRIPTION)).hexdigest()
    except OSError as error:
        raise UnknownRobotError(f"{description}: cannot read the file ({error.strerror})") from None
    # The file name of a URDF is part of the robot data.
    return f"{description.stem}-{_key(description.name, *options, content, _compiler_digest())}-"


def _is_current(home: Path, description: Path) -> bool:
    note, folder = home / _SOURCES, description.parent.resolve()
    lines = note.read_text(encoding="utf-8").splitlines() if note.is_file() else [""]
    return all(_digest(folder / line[65:]) == line[:64] for line in lines)


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else "missing"


def _key(*words: str) -> str:
    return hashlib.sha256("\0".join(words).encode()).hexdigest()[:24]


@functools.cache
def _compiler_digest() -> str:
    folders = _compiler_folder(), Path(contract.__file__).parent
    digest = hashlib.sha256()
    for folder in filter(None, folders):
        for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.h")]):
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()


def _derive(description: Path, options: Sequence[str]) -> Path:
    name, homes, prefix = description.stem, _homes(), _prefix(description, options)
    words = f"{name}{_in_words(options)}"
    with contextlib.suppress(OSError):  # Standard error may be a file on a full disk.
        print(f"chasles: deriving {words} once, a few seconds ...", file=sys.stderr, flush=True)
    try:
        homes.mkdir(mode=0o700, parents=True, exist_ok=True)
        with contract.temporary_folder(homes, name) as temporary:
            derived = temporary / "robots"
            _run_compiler(description, derived, options)
            origin = [str(description.absolute()), *(o for o in options if o != PARAMETRIC)]
            (derived / _DESCRIBED_BY).write_text("\n".join(origin), encoding="utf-8")
            is_same = _prefix(description, options) == prefix
            if not (is_same and _is_current(derived, description)):
                raise DerivationError(
                    f"{description}: the file changed while chasles derived the robot; "
                    "load it again"
                )
            home = homes / f"{prefix}{_key((derived / _SOURCES).read_text(encoding='utf-8'))}"
            _move(derived, home)
    except OSError as error:
        raise CacheError(
            f"{homes}: cannot write a derived robot ({error}); set CHASLES_CACHE to a writable "
            "folder"
        ) from error
    return home


def _in_words(options: Sequence[str]) -> str:
    if _FIXED in options:
        names = options[options.index(_FIXED) + 1]
        return f" with {names.replace(',', ', ')} fixed"
    return " with parametric functions" if PARAMETRIC in options else ""


def _run_compiler(description: Path, folder: Path, options: Sequence[str]) -> None:
    # The flag -P prevents modules in the working directory from replacing installed modules.
    python = [sys.executable or "python3", "-P", "-m", "chasles", "derive"]
    # The LaTeX article takes a large share of the derivation time and is not needed in the cache.
    wanted = ["--to", folder, "--sources", folder / _SOURCES, "--jobs", "1", "--detail", "none"]
    command = [*python, *map(str, (description.absolute(), *wanted)), *options]
    try:
        result = _finished(command)
    except OSError as error:
        raise DerivationError(f"{description}: cannot run {python[0]} ({error})") from None
    if result.returncode:
        # The compiler prints errors of a single robot to stdout, and fatal errors to stderr.
        stderr = result.stderr.strip().removeprefix("chasles: ")
        said = "\n".join(filter(None, (result.stdout.strip(), stderr)))
        names_it = said.startswith(f"{description.absolute()}:")
        raise DerivationError(
            said if names_it else f"{description}: cannot derive the robot; {said}"
        )
    for line in result.stderr.splitlines():
        if line.startswith(_WARNING):
            warnings.warn(line.removeprefix(_WARNING), stacklevel=2)


def _finished(command: list[str]) -> Any:
    import subprocess  # noqa: PLC0415

    return subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)


def _move(derived: Path, home: Path) -> None:
    # Another process may have created the same folder.
    try:
        derived.rename(home)
    except OSError:
        if not home.is_dir():
            raise
