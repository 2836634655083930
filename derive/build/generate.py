"""Generates the files in a robot's folder.

All generated files are created in memory and then written together.
"""

import gc
import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path

from chasles.contract import SUPPORT, as_path, check_type, is_inside, make_folder, write_files
from chasles.contract.forking import run_in_fork

from ..derivation import Derivation, derive
from ..emit.c.header import support_files
from ..emit.emitter import Emitter, Files
from ..emit.languages import EMITTERS, LANGUAGES, emitters_of
from ..emit.manifest import manifest
from ..inverse.families import FAMILIES
from ..inverse.families.family import Family
from ..model.errors import InputValueError
from ..model.mechanism import Described, Mechanism
from ..model.robot import SerialRobot
from ..program.programs import NO_PROGRAMS, Programs, programs

MANIFEST = "manifest.json"


def files(
    description: Described,
    *,
    functions: Sequence[str] | None = None,
    fixed: str | Sequence[str] = (),
    parametric: bool = False,
    families: tuple[Family, ...] = FAMILIES,
    languages: Sequence[str | Emitter] = LANGUAGES,
) -> dict[str, bytes]:
    """Derive a robot and return its generated files without writing them to disk.

    Args:
        description: The robot, from ``read`` or built in Python.
        functions: Names of the functions to derive. By default, all functions are derived.
        fixed: Names of fixed joints, whose values are inputs of ``ik``. By default, joints are
            fixed only if the robot is redundant.
        parametric: Whether to also derive functions of the robot parameters, such as ``fk_p``.
        families: The axis structures with a closed-form inverse kinematics function, in the order
            in which to try them.
        languages: "c", "casadi", "python", "latex", "casadi_c" or ``Emitter`` objects.

    Returns:
        The UTF-8 content of each file, keyed by its path in the robot's folder. The files include
        ``manifest.json``. The same robot description gives identical bytes on every machine.

    Raises:
        DescriptionError: The description is invalid.
        InputValueError: A function, joint or language is unknown, or two languages write the same
            path.
    """
    check_type("files: description", description, SerialRobot, Mechanism)
    emitters = emitters_of(languages)
    texts = _texts(description, functions, fixed, families, emitters, parametric=parametric)
    return {name: text.encode() for name, text in texts.items()}


def _texts(
    description: Described,
    functions: Sequence[str] | None,
    fixed: str | Sequence[str],
    families: tuple[Family, ...],
    emitters: Sequence[Emitter],
    *,
    parametric: bool,
) -> dict[str, str]:
    with without_garbage_collection():
        derived = derive(
            description, functions=functions, fixed=fixed, parametric=parametric, families=families
        )
        return files_of(derived, emitters)


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """Disable Python's cyclic garbage collector.

    Garbage collection would take a sixth of the derivation time and free no memory.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def files_of(derivation: Derivation, emitters: Sequence[Emitter] = EMITTERS) -> dict[str, str]:
    """Return the text of every generated file, keyed by path."""
    articles = [emitter for emitter in emitters if emitter.prints_equations]
    others = [emitter for emitter in emitters if not emitter.prints_equations]
    printing = run_in_fork(lambda: _files(articles, derivation, NO_PROGRAMS))
    with printing if articles else nullcontext(dict) as printed:
        made = programs(derivation.functions, derivation.robot.name)
        written = {**_files(others, derivation, made), **printed()}
    texts = _merged(written)
    texts[MANIFEST] = manifest(derivation, made, written)
    return dict(sorted(texts.items()))


def _files(emitters: Sequence[Emitter], derivation: Derivation, made: Programs) -> dict[str, Files]:
    return {emitter.language: emitter.files(derivation, made) for emitter in emitters}


def write(
    description: Described,
    folder: str | Path,
    *,
    functions: Sequence[str] | None = None,
    fixed: str | Sequence[str] = (),
    parametric: bool = False,
    families: tuple[Family, ...] = FAMILIES,
    languages: Sequence[str | Emitter] = LANGUAGES,
) -> list[Path]:
    """Derive a robot and write its generated files into a folder.

    ``chasles.load(folder)`` loads the robot. Obsolete files from earlier runs are removed. Files
    that chasles did not generate are kept.

    Args:
        description: The robot, from ``read`` or built in Python.
        folder: The folder of the robot. The folder is created if necessary.
        functions: Names of the functions to derive. By default, all functions are derived.
        fixed: Names of fixed joints, whose values are inputs of ``ik``. By default, joints are
            fixed only if the robot is redundant.
        parametric: Whether to also derive functions of the robot parameters, such as ``fk_p``.
        families: The axis structures with a closed-form inverse kinematics function, in the order
            in which to try them.
        languages: "c", "casadi", "python", "latex", "casadi_c" or ``Emitter`` objects. The Python
            files call the generated C.

    Returns:
        The paths of the written files.

    Raises:
        DescriptionError: The description is invalid.
        InputValueError: A function, joint or language is unknown, or two languages write the same
            path.
    """
    check_type("write: description", description, SerialRobot, Mechanism)
    target, emitters = as_path("folder", folder), emitters_of(languages)
    texts = _texts(description, functions, fixed, families, emitters, parametric=parametric)
    return put(texts, target)


def put(texts: Mapping[str, str], folder: Path, *, shares: bool = False) -> list[Path]:
    """Write all generated files of a robot into a folder.

    If an error occurs, no file is written.

    Args:
        texts: Text of each generated file, keyed by its path in the robot's folder.
        folder: The folder of the robot.
        shares: Whether the support headers are in a folder that several robots share.
    """
    paths = paths_of(texts, folder, shares=shares)
    ordered = sorted(texts, key=lambda name: name == MANIFEST)
    for name in ordered:
        make_folder(paths[name].parent)
    former = sorted(_listed(folder) | texts.keys())
    write_files({paths[name]: texts[name].encode() for name in ordered})
    for name in former:
        if paths.get(name) != folder / name:
            _remove(folder / name)
    return [paths[name] for name in ordered]


def _remove(file: Path) -> None:
    try:
        file.unlink(missing_ok=True)
    except OSError as error:
        raise InputValueError(f"{file}: cannot remove the file ({error.strerror})") from None


def paths_of(names: Iterable[str], folder: Path, *, shares: bool) -> dict[str, Path]:
    """Return the path of each generated file.

    If ``shares`` is true, the support headers are in a folder that several robots share.
    """
    shared = support_files() if shares else {}
    return {name: (folder.parent / SUPPORT if name in shared else folder) / name for name in names}


def strays(names: Collection[str], folder: Path) -> list[str]:
    """Return the files in ``folder`` that are not in ``names``.

    Files whose suffix does not occur in ``names`` are ignored.
    """
    endings = {Path(name).suffix for name in names}
    there = {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.suffix in endings and "__pycache__" not in path.parts
    }
    return sorted(there.difference(names))


def _merged(written: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    merged: dict[str, str] = {}
    for language, texts in written.items():
        if twice := sorted(merged.keys() & texts.keys()):
            raise InputValueError(
                f"{language}: another language has files with the same path: {', '.join(twice)}"
            )
        merged |= texts
    return merged


def _listed(folder: Path) -> set[str]:
    try:
        found = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        listed = found.get("files") if isinstance(found, dict) else None
        return {name for name in listed or () if is_inside(folder / name, folder)}
    except (OSError, RecursionError, TypeError, ValueError):
        # The file ``manifest.json`` is missing or damaged.
        return set()
