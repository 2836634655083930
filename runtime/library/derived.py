"""Robots given by their descriptions, derived on first use into the cache.

The runtime runs `python -m chasles.derive` in a separate process. The name of the generated folder
holds the SHA-256 of the description, of the files that it names, and of the compiler's sources.
"""

from __future__ import annotations

import functools
import hashlib
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from .. import contract
from ..contract import UnknownRobotError
from ..errors import CacheError, DerivationError
from .cache import cache_folder

_COMPILER = "chasles.derive"
# A xacro file or an MJCF model may include other files, which only the compiler can find.
_SUFFIXES = (".toml", ".urdf")
_DESCRIBED_BY = "description.txt"
"""File beside a derived robot's folder that holds the path of its description."""
PARAMETRIC = ("--parametric",)
"""The options by which the folder has functions of the robot's geometry."""
_WARNING = "warning: "
"""The beginning of the lines by which the compiler warns."""
_FIXED = "--fixed"
_FUNCTIONS_OF_FIXED = ("fk", "fk_jacobian_mixed", "ik")
"""What is derived of a robot for chosen given joints: its inverse, and what refines it."""


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
    """Whether a path names a description, a robot file or a URDF, rather than a folder."""
    return path.suffix.lower() in _SUFFIXES and not path.is_dir()


def giving(names: Sequence[str]) -> tuple[str, ...]:
    """The options by which the folder has `ik` for given joints, and what that needs."""
    return (_FIXED, ",".join(names), "--functions", ",".join(_FUNCTIONS_OF_FIXED))


def derived_folder(description: Path, options: Sequence[str] = ()) -> Path:
    """The generated folder of a description, derived first if the cache has none.

    Args:
        description: A robot file (.toml), or a URDF (.urdf) of one robot.
        options: Further words for the compiler's command line, such as those of :func:`giving`.

    Returns:
        The folder in the cache.

    Raises:
        UnknownRobotError: If the description cannot be read, or describes several robots.
        DerivationError: If the compiler is not installed or refuses the description.
        CacheError: If the cache cannot be written to, or holds a damaged folder.
    """
    home = _home(description, options)
    if not home.is_dir():
        _derive(description, home, options)
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


def description_of(folder: Path) -> Path | None:
    """The description that a generated folder was derived from, None where nothing tells it.

    Args:
        folder: A folder of the cache, or of a robot that is generated along.
    """
    if _homes() in folder.parents:
        note = folder.parent / _DESCRIBED_BY
        path = Path(note.read_text(encoding="utf-8")) if note.is_file() else None
        return path if path and path.is_file() else None
    spec = find_spec("chasles.generated")
    generated = [Path(at) for at in spec.submodule_search_locations or ()] if spec else []
    return shipped().get(folder.name) if folder.parent in generated else None


def is_of_shelf(folder: Path) -> bool:
    """Whether a folder is the one that the arm of its name on the shelf is derived into."""
    if _homes() not in folder.parents:
        return False
    description = shelf().get(folder.name)
    return description is not None and _home(description) == folder.parent


def _compiler_folder() -> Path | None:
    spec = find_spec(_COMPILER)
    roots = spec.submodule_search_locations if spec else None
    return Path(roots[0]) if roots else None


def _homes() -> Path:
    return cache_folder() / "derived"


def _home(description: Path, options: Sequence[str] = ()) -> Path:
    """The folder that holds a description's generated folder, complete or not there at all."""
    # The name of a URDF is among the facts of its robot.
    named = " ".join((description.name, *options)).encode()
    parts = (named, *_contents(description), _compiler_digest())
    key = hashlib.sha256(b"".join(hashlib.sha256(part).digest() for part in parts)).hexdigest()
    return _homes() / f"{description.stem}-{key[:32]}"


def _contents(description: Path) -> list[bytes]:
    """The bytes of a description and of the files that it extends or is built from."""
    try:
        content = description.read_bytes()
    except OSError as error:
        raise UnknownRobotError(f"{description}: cannot be read ({error.strerror})") from error
    if description.suffix.lower() != ".toml":
        return [content]
    return [content, *_named_along(description, content)]


def _named_along(description: Path, content: bytes) -> list[bytes]:
    """The bytes of the files that a robot file names, and of those that they name."""
    # Robots that are generated along need no reader of TOML.
    import tomllib  # noqa: PLC0415

    seen = {description.resolve(): content}
    left = [description]
    while left:
        file = left.pop()
        try:
            table = tomllib.loads(seen[file.resolve()].decode("utf-8-sig"))
        except ValueError:
            # The compiler reports a wrong file, with the line.
            continue
        for other in _files_in(table, file.parent):
            if other.is_file() and other.resolve() not in seen:
                seen[other.resolve()] = other.read_bytes()
                left.append(other)
    return list(seen.values())[1:]


def _files_in(table: Mapping[str, object], folder: Path) -> Iterator[Path]:
    """The files that a robot file names: beside it, or of a nominal robot that is installed."""
    extended, nominal = table.get("extends"), table.get("nominal")
    if isinstance(extended, str):
        yield folder / extended
    if isinstance(nominal, str):
        yield shipped().get(nominal) or shelf().get(nominal) or folder / nominal


@functools.cache
def _compiler_digest() -> bytes:
    folders = _compiler_folder(), Path(contract.__file__).parent
    digest = hashlib.sha256()
    for folder in filter(None, folders):
        for path in sorted([*folder.rglob("*.py"), *folder.rglob("*.h")]):
            digest.update(path.read_bytes() + b"\0")
    return digest.digest()


def _derive(description: Path, home: Path, options: Sequence[str]) -> None:
    # Loading a robot that was derived before needs no temporary folder.
    import tempfile  # noqa: PLC0415

    name = f"{description.stem}{_in_words(options)}"
    print(f"chasles: deriving {name} once, a few seconds ...", file=sys.stderr, flush=True)
    try:
        home.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(
            prefix=f".{description.stem}-", dir=home.parent
        ) as temporary:
            whole = Path(temporary) / "robots"
            _run_compiler(description, whole, options)
            (whole / _DESCRIBED_BY).write_text(str(description.absolute()), encoding="utf-8")
            if _home(description, options) != home:
                raise DerivationError(f"{description}: changed while it was derived; load it again")
            _move(whole, home)
    except OSError as error:
        raise CacheError(
            f"{home.parent}: cannot keep a derived robot here ({error}); set CHASLES_CACHE to a "
            "folder that can be written to"
        ) from error


def _in_words(options: Sequence[str]) -> str:
    """The part of a message that tells how a robot is derived, by the compiler's options."""
    if _FIXED in options:
        names = options[options.index(_FIXED) + 1]
        return f" for given {names.replace(',', ', ')}"
    return " with parametric functions" if set(PARAMETRIC) <= set(options) else ""


def _run_compiler(description: Path, folder: Path, options: Sequence[str]) -> None:
    import subprocess  # noqa: PLC0415

    # -P: a module of the user's in the working directory must not take the place of an installed
    # one.
    python = [sys.executable or "python3", "-P", "-m", _COMPILER]
    # Nobody reads an article in a cache, and it takes a good part of the time.
    wanted = ["--to", str(folder), "--jobs", "1", "--detail", "none"]
    command = [*python, str(description.absolute()), *wanted, *options]
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
    """Moves a complete folder to its place at once; an equal one of another process may stay."""
    try:
        whole.rename(home)
    except OSError:
        if not home.is_dir():
            raise
