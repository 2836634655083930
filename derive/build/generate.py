"""From a robot to its generated folder: everything is made in memory, then written at once."""

import os
from collections.abc import Sequence
from pathlib import Path

from .. import latex
from ..derivation import Derivation, derive
from ..emit import casadi_file, python_package
from ..emit.c import batch, branch_lanes, scalar
from ..emit.manifest import manifest
from ..model.mechanism import Described
from ..program.statements import bodies
from ..terms.casadi_graph import lower

MANIFEST = "manifest.json"


def artifacts(robot: Described, functions: Sequence[str] | None = None) -> dict[str, str]:
    """Every generated file of a robot: its path inside the robot's folder, and its text.

    Args:
        robot: The description.
        functions: The functions to derive, all by default.

    Returns:
        C source and header, LaTeX, CasADi functions, the Python package and the manifest; the
        same bytes for the same description on any machine.
    """
    return files_of(derive(robot, functions))


def files_of(derivation: Derivation) -> dict[str, str]:
    """Every generated file of a derivation, as :func:`artifacts`."""
    robot = derivation.robot
    lowered = lower(derivation.functions, robot.name)
    statements = bodies(lowered)
    written, every = derivation.written, (*derivation.functions, *derivation.written)
    files = {
        f"{robot.name}.c": scalar.source(robot, derivation.functions, statements, written),
        f"{robot.name}.h": scalar.header(robot, every),
        scalar.SUPPORT: scalar.support(scalar.SUPPORT),
        **scalar.written_files(robot, written),
        **branch_lanes.files(robot, derivation.functions),
        **batch.files(robot, derivation.functions, statements, written),
        **casadi_file.files(derivation),
        **python_package.files(robot, every),
        f"{robot.name}.tex": latex.document(derivation),
        **{f"{latex.FOLDER}/{n}": text for n, text in latex.fragments(derivation).items()},
    }
    files[MANIFEST] = manifest(derivation, lowered, files)
    return dict(sorted(files.items()))


def write(
    robot: Described, folder: str | Path, functions: Sequence[str] | None = None
) -> list[Path]:
    """Derives a robot and writes its folder, to be loaded by ``chasles.load(folder)``.

    Files that an earlier run left and this one does not make are removed; other files stay.

    Args:
        robot: The description.
        folder: The robot's own folder, made where it does not exist; by custom named as the robot.
        functions: The functions to derive, all by default.

    Returns:
        The files written.
    """
    files = artifacts(robot, functions)
    return put(files, Path(folder))


def put(files: dict[str, str], folder: Path) -> list[Path]:
    """Writes files into a folder, each one whole or not at all, the manifest last."""
    for stale in sorted(generated_files(folder) - files.keys()):
        (folder / stale).unlink()
    ordered = sorted(files, key=lambda name: name == MANIFEST)
    for name in ordered:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}")
        temporary.write_bytes(files[name].encode())
        temporary.replace(path)
    return [folder / name for name in ordered]


def generated_files(folder: Path) -> set[str]:
    """The files that earlier runs made in a folder, by their kinds."""
    kinds = ("*.c", "*.h", "*.casadi", "*.tex", "*/*.tex", "__init__.py*", MANIFEST)
    return {path.relative_to(folder).as_posix() for kind in kinds for path in folder.glob(kind)}
