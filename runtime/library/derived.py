"""Robots given by their descriptions, derived on first use into the cache.

The runtime runs `python -m chasles.derive` in a separate process. The name of the generated folder
holds the SHA-256 of the description, of the files that it includes, and of the compiler's sources.
"""

from __future__ import annotations

import functools
import glob
import hashlib
import sys
import warnings
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from .. import contract
from ..contract import UnknownRobotError
from ..errors import CacheError, DerivationError
from .cache import cache_folder

_COMPILER = "chasles.derive"
SUFFIXES = (".toml", ".urdf", ".xacro", ".xml")
"""Suffixes of robot files, URDFs, xacro files and MJCF models."""
_DESCRIBED_BY, _SOURCES = "description.txt", "sources.txt"
"""Files beside a derived robot's folder: the path of its description and the options of the
compiler, and the digests and paths of all files that the compiler read."""
PARAMETRIC = "--parametric"
"""The option by which the folder has functions of the robot's geometry."""
_WARNING = "warning: "
_FIXED = "--fixed"


def shelf() -> dict[str, Path]:
    """The descriptions of the well-known arms that are installed with chasles, by name."""
    return _descriptions("robots/shelf/*.toml")


def shipped() -> dict[str, Path]:
    """The descriptions of the generated robots that are installed with chasles, by name."""
    return _descriptions("robots/*.toml")


def _descriptions(pattern: str) -> dict[str, Path]:
    root = _compiler_folder()
    files = sorted(root.glob(pattern)) if root else []
    return {file.stem: file for file in files}


def is_description(path: Path) -> bool:
    """Whether a path names a description rather than a folder."""
    return path.suffix.lower() in SUFFIXES and not path.is_dir()


def options_of(exact: bool, parametric: bool, **named: str | None) -> tuple[str, ...]:
    """The options of the compiler's command line for the keywords of `chasles.load`."""
    words = [word for key, value in named.items() if value for word in (f"--{key}", value)]
    return (*words, *["--exact"] * exact, *[PARAMETRIC] * parametric)


def options_for_fixed(names: Sequence[str]) -> tuple[str, ...]:
    """The options by which the folder has `ik` with joints fixed, and what that needs."""
    return (_FIXED, ",".join(names), "--functions", "fk,fk_jacobian_mixed,ik")


def derived_folder(description: Path, options: Sequence[str] = ()) -> Path:
    """The generated folder of a description, derived first if the cache has none.

    Args:
        description: A file of one robot.
        options: Further words for the compiler's command line.

    Raises:
        UnknownRobotError: If the description cannot be read, or describes several robots.
        DerivationError: If the compiler is not installed or refuses the description.
        CacheError: If the cache cannot be written to, or holds a damaged folder.
    """
    home = _found(description, options) or _derive(description, options)
    robots = sorted(manifest.parent for manifest in home.glob("*/manifest.json"))
    if not robots:
        raise CacheError(f"{home}: holds no robot any more; delete this folder")
    if len(robots) > 1:
        names = ", ".join(robot.name for robot in robots)
        raise UnknownRobotError(
            f"{description}: describes several robots ({names}); derive them into a folder, by "
            f"chasles-derive {description} --to robots, and load ./robots/{robots[0].name}"
        )
    return robots[0]


def description_of(folder: Path) -> tuple[Path, tuple[str, ...]] | None:
    """The description and the options of a folder of the cache or an installed robot, if known."""
    if _homes() in folder.parents:
        note = folder.parent / _DESCRIBED_BY
        path, *options = note.read_text(encoding="utf-8").splitlines() if note.is_file() else [""]
        return (Path(path), tuple(options)) if Path(path).is_file() else None
    spec = find_spec("chasles.generated")
    generated = [Path(at) for at in spec.submodule_search_locations or ()] if spec else []
    found = shipped().get(folder.name) if folder.parent in generated else None
    return (found, ()) if found else None


def is_of_shelf(folder: Path) -> bool:
    """Whether a folder is the one that the arm of its name on the shelf is derived into."""
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
    """The folder of a derived description, if none of its files has changed since."""
    homes = _homes().glob(f"{glob.escape(_prefix(description, options))}*")
    return next((home for home in homes if _is_current(home, description)), None)


def _prefix(description: Path, options: Sequence[str]) -> str:
    """The first part of a folder's name: the description itself, the options, the compiler."""
    try:
        content = hashlib.sha256(description.read_bytes()).hexdigest()
    except OSError as error:
        raise UnknownRobotError(f"{description}: cannot be read ({error.strerror})") from error
    # The name of a URDF is among the facts of its robot.
    return f"{description.stem}-{_key(description.name, *options, content, _compiler_digest())}-"


def _is_current(home: Path, description: Path) -> bool:
    """Whether the files that the compiler read for a folder have the same contents now."""
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
    # Loading a robot that was derived before needs no temporary folder.
    import tempfile  # noqa: PLC0415

    name, homes, prefix = description.stem, _homes(), _prefix(description, options)
    words = f"{name}{_in_words(options)}"
    print(f"chasles: deriving {words} once, a few seconds ...", file=sys.stderr, flush=True)
    try:
        homes.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{name}-", dir=homes) as temporary:
            whole = Path(temporary) / "robots"
            _run_compiler(description, whole, options)
            origin = [str(description.absolute()), *(o for o in options if o != PARAMETRIC)]
            (whole / _DESCRIBED_BY).write_text("\n".join(origin), encoding="utf-8")
            is_same = _prefix(description, options) == prefix
            if not (is_same and _is_current(whole, description)):
                raise DerivationError(f"{description}: changed while it was derived; load it again")
            home = homes / f"{prefix}{_key((whole / _SOURCES).read_text(encoding='utf-8'))}"
            _move(whole, home)
    except OSError as error:
        raise CacheError(
            f"{homes}: cannot keep a derived robot here ({error}); set CHASLES_CACHE to a "
            "folder that can be written to"
        ) from error
    return home


def _in_words(options: Sequence[str]) -> str:
    """The part of a message that tells how a robot is derived, by the compiler's options."""
    if _FIXED in options:
        names = options[options.index(_FIXED) + 1]
        return f" with {names.replace(',', ', ')} fixed"
    return " with parametric functions" if PARAMETRIC in options else ""


def _run_compiler(description: Path, folder: Path, options: Sequence[str]) -> None:
    import subprocess  # noqa: PLC0415

    # -P: a module in the working directory must not take the place of an installed one.
    python = [sys.executable or "python3", "-P", "-m", _COMPILER]
    # Nobody reads an article in a cache, and it takes a good part of the time.
    wanted = ["--to", folder, "--sources", folder / _SOURCES, "--jobs", "1", "--detail", "none"]
    command = [*python, *map(str, (description.absolute(), *wanted)), *options]
    try:
        result = subprocess.run(
            command, capture_output=True, text=True, errors="replace", check=False
        )
    except OSError as error:
        raise DerivationError(f"{description}: {python[0]} cannot be run ({error})") from error
    if result.returncode:
        # The reports of robots go to the one, the errors that stop the run to the other.
        said = "\n".join(filter(None, (result.stdout.strip(), result.stderr.strip())))
        names_it = said.startswith(f"{description.absolute()}: ")
        raise DerivationError(said if names_it else f"{description}: cannot be derived; {said}")
    for line in result.stderr.splitlines():
        if line.startswith(_WARNING):
            warnings.warn(line.removeprefix(_WARNING), stacklevel=2)


def _move(whole: Path, home: Path) -> None:
    # An equal folder of another process may stay.
    try:
        whole.rename(home)
    except OSError:
        if not home.is_dir():
            raise
