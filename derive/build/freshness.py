"""Checks in milliseconds, without SymPy, whether a robot's generated folder is up to date.

A stamp file in each generated folder contains one hash of all sources and one hash of the generated
files. Stamp files are never committed to Git.
"""

import hashlib
import os
import re
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path

from chasles.contract import output_file, requires

from ..description.file_text import read_bytes
from ..description.shipped_files import nominal_file
from ..description.toml_lines import table_of
from ..model.errors import DescriptionError

ROOM = Path(__file__).parent.parent
GENERATED = ROOM.parent / "generated"
"""Folder with the generated files of the robots that are installed with chasles."""
STAMP = ".derived"


@dataclass(frozen=True)
class Job:
    """A robot to derive, with the options of its derivation.

    Attributes:
        file: The robot's description file.
        to: Parent folder of the robot's generated folder.
        base: Base link of a URDF or an MJCF model.
        tip: Tip link of a URDF or an MJCF model.
        functions: Names of the functions to derive, or () for all functions.
        arguments: Values of a xacro file's arguments, each as ``name:=value``.
        suffix: Suffix of the robot's name, used if one file describes several robots.
        calibration: Factory calibration file of a UR arm.
        exact: Whether to use the values in the description file exactly as written, without noise
            removal.
        fixed: Names of the fixed joints, whose values are inputs of ``ik``. If ``fixed`` is empty,
            the derivation chooses the fixed joints.
        parametric: Whether to also derive functions of the robot parameters, such as ``fk_p``.
        detail: Level of detail of the robot's LaTeX article: full, brief or none.
        time_limit: Time limit of the derivation in seconds, or 0 for no limit.
        languages: Output languages of the generated files, or () for the default languages.
        name: Name of the robot, or None to read the name from the description file.
    """

    file: Path
    to: Path
    base: str | None = None
    tip: str | None = None
    functions: tuple[str, ...] = ()
    arguments: tuple[str, ...] = ()
    suffix: str = ""
    calibration: Path | None = None
    exact: bool = False
    fixed: tuple[str, ...] = ()
    parametric: bool = False
    detail: str = "full"
    time_limit: float = 0
    languages: tuple[str, ...] = ()
    name: str | None = None


@dataclass(frozen=True)
class Report:
    """The result of a command-line job for one robot, such as its derivation."""

    good: bool
    line: str
    warning: str = ""


def is_up_to_date(job: Job) -> bool:
    """Whether a robot's generated folder is up to date and unmodified."""
    recipe = _recipe(job)
    stamped = {
        path.parent: path.read_text(encoding="ascii").splitlines()
        for path in job.to.glob(f"*/{STAMP}")
    }
    # The generated files are hashed only if the folder's stamp contains the hash of the current
    # sources.
    return any(
        lines[:1] == [recipe] and lines[1:] == [_contents(folder)]
        for folder, lines in stamped.items()
    )


def stamp(job: Job, folder: Path) -> None:
    """Write the stamp file with the hashes of a job's sources and generated files."""
    text = f"{_recipe(job)}\n{_contents(folder)}\n"
    with output_file(folder / STAMP) as target:
        target.write_text(text, encoding="ascii")


def _recipe(job: Job) -> str:
    choices = (
        job.base,
        job.tip,
        job.functions,
        job.suffix,
        job.exact,
        job.fixed,
        job.parametric,
        job.detail,
        job.languages,
        job.name,
    )
    calibration = [read_bytes(job.calibration)] if job.calibration else []
    described = [*_description(job), *calibration]
    parts = (*described, _compiler().encode(), repr(choices).encode())
    return hashlib.sha256(b"\0".join(parts)).hexdigest()


def _description(job: Job) -> list[bytes]:
    """Return the contents of a description file and of all files to which it refers."""
    file = job.file
    ending = file.suffix.lower()
    if ending == ".xacro":
        # The xacro file is expanded, because its conditions and arguments determine which files it
        # includes.
        try:
            return [_expanded(file, job)[0].encode()]
        except DescriptionError:
            # The reader of the description reports an invalid file.
            return [read_bytes(file)]
    if ending == ".xml":
        return _included(file, file.parent, {})
    return list(_named_along(file, {}).values()) if ending == ".toml" else [read_bytes(file)]


def source_files(job: Job) -> list[Path]:
    """Return the description file of a robot and all files to which this file refers.

    Raises:
        DescriptionError: The robot is described by a xacro file that cannot be expanded.
    """
    file, ending = job.file.resolve(), job.file.suffix.lower()
    if ending == ".xacro":
        return list(dict.fromkeys([file, *_expanded(file, job)[1]]))
    if ending == ".xml":
        included: dict[Path, bytes] = {}
        _included(file, file.parent, included)
        return list(included)
    return list(_named_along(file, {})) if ending == ".toml" else [file]


def _expanded(file: Path, job: Job) -> tuple[str, list[Path]]:
    from ..description.importers.chains import within_limits  # noqa: PLC0415
    from ..description.importers.xacro_file import expanded_with_files  # noqa: PLC0415

    return within_limits(file, partial(expanded_with_files, file, job.arguments))


def write_sources(job: Job, to: Path) -> None:
    """Write the hash and path of every source file of a robot.

    The runtime uses the hashes of the source files as a cache key.
    """
    folder = job.file.parent.resolve()
    lines = [
        f"{hashlib.sha256(read_bytes(file)).hexdigest()} {os.path.relpath(file, folder)}\n"
        for file in source_files(job)
    ]
    with output_file(to) as target:
        target.write_text("".join(lines), encoding="utf-8")


def _named_along(file: Path, seen: dict[Path, bytes]) -> dict[Path, bytes]:
    if not file.is_file() or file.resolve() in seen:
        return seen
    seen[file.resolve()] = content = read_bytes(file)
    try:
        table = table_of(content.decode("utf-8-sig"))
    except (ValueError, ArithmeticError, RecursionError):
        # The reader of the description reports an invalid file.
        return seen
    extended, nominal = table.get("extends"), table.get("nominal")
    if isinstance(extended, str):
        _named_along(file.parent / extended, seen)
    if isinstance(nominal, str):
        _named_along(nominal_file(file, nominal), seen)
    return seen


def _included(file: Path, folder: Path, seen: dict[Path, bytes]) -> list[bytes]:
    if file.is_file() and file not in seen:
        seen[file] = read_bytes(file)
        for name in re.findall(rb"""<include\s+file\s*=\s*["']([^"']+)["']""", seen[file]):
            _included(folder / name.decode(errors="replace"), folder, seen)
    return list(seen.values())


@cache
def _compiler() -> str:
    """Return a hash of the code in ``derive`` and of the CasADi and SymPy versions."""
    digest = hashlib.sha256()
    for path in sorted([*ROOM.rglob("*.py"), *ROOM.rglob("support/**/*.*")]):
        digest.update(path.read_bytes() + b"\0")
    with requires("chasles[derive]"):
        digest.update(repr((version("casadi"), version("sympy"))).encode())
    return digest.hexdigest()


def _contents(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != STAMP and "__pycache__" not in path.parts:
            digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
