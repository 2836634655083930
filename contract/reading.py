"""Reads, checks and writes `manifest.json`, the contract between compiler and runtime.

The reader checks the complete manifest, so that the runtime can use the manifest without further
checks.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .bodies import check_bodies
from .errors import ManifestError, UnknownRobotError
from .input_files import read_input
from .manifest import FORMAT, FunctionInfo, Manifest
from .records import Place, read, write
from .roles import SOLUTIONS, TASK_COMPONENTS


def manifest_entries(manifest: Manifest) -> dict[str, Any]:
    """Return the manifest as plain JSON data."""
    return write(Manifest, manifest)


def read_manifest(folder: Path) -> Manifest:
    """Read and check the manifest of a generated robot.

    Args:
        folder: The robot's folder, which contains `manifest.json`.

    Returns:
        The manifest.

    Raises:
        UnknownRobotError: The folder has no manifest.
        ManifestError: This version of chasles does not support the form of the manifest.
    """
    file = folder / "manifest.json"
    try:
        content = read_input(file)
    except (FileNotFoundError, NotADirectoryError):
        reason = "no manifest.json in it" if folder.is_dir() else "no such folder"
        raise UnknownRobotError(
            f"{folder}: expected the folder of a generated robot ({reason})"
        ) from None
    except OSError as error:
        raise ManifestError(f"{file}: cannot read the manifest ({error.strerror})") from None
    try:
        entries = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ManifestError(f"{file}: not JSON: {error}") from None
    place = Place(file)
    _check_format(entries, place)
    manifest = read(
        Manifest, entries, place, folder=folder, digest=hashlib.sha256(content).hexdigest()
    )
    _check_files(manifest, place["files"])
    _check_loops(manifest, place)
    _check_functions(manifest, place["functions"])
    if manifest.skeleton:
        variables = manifest.loops.configuration or manifest.coordinates
        check_bodies(manifest.skeleton, len(variables), place["skeleton"])
    return manifest


def _check_files(manifest: Manifest, place: Place) -> None:
    for needed in (f"{manifest.name}.c", f"{manifest.name}.h"):
        if needed not in manifest.files:
            raise ManifestError(f"{place.file}: files: missing {needed!r}")
    for name in manifest.files:
        # Compilers and `chasles build` copy the listed files into other folders under these names.
        if {"", ".", ".."} & set(name.split("/")) or set("\\:\0") & set(name):
            place.fail(name, "a path inside the folder")


def _check_format(entries: object, place: Place) -> None:
    if not isinstance(entries, dict):
        place.fail(entries, "an object")
    if "chasles" not in entries:
        raise ManifestError(f"{place.file}: the field 'chasles' is missing")
    if (found := entries["chasles"]) != FORMAT:
        raise ManifestError(
            f"{place.file}: chasles: this version of chasles reads manifests of format {FORMAT}, "
            f"got {found!r}; derive the robot again with this version"
        )


def _check_loops(manifest: Manifest, place: Place) -> None:
    loops, n, n_z = manifest.loops, len(manifest.coordinates), len(manifest.loops.configuration)
    solution, reference, moved = loops.solution, loops.reference, loops.actuated_in_z
    if solution != (expected := SOLUTIONS[manifest.kind]):
        place["solution"].fail(solution, f"{expected!r}, since the kind is {manifest.kind!r}")
    if reference and (len(reference.q), len(reference.z)) != (n, n_z):
        place["reference"].fail(reference, f"{n} values of q and {n_z} of z")
    if moved and len(moved) != n:
        place["actuated_in_z"].fail(moved, f"{n} entries, one per coordinate")
    if any(item.index >= n_z for item in moved):
        place["actuated_in_z"].fail(moved, f"indices below {n_z}, the size of the configuration")
    if any(item.index >= n_z for item in loops.limited):
        place["limited"].fail(loops.limited, f"indices below {n_z}, the size of the configuration")
    if any(len(row) != n for row in loops.coupling) or (
        loops.coupling and len(loops.coupling) != len(loops.chain)
    ):
        place["coupling"].fail(loops.coupling, f"one row per joint of the chain, of {n} numbers")
    if any(len(row) != n_z for row in loops.joint_couplings):
        place["joint_couplings"].fail(loops.joint_couplings, f"rows of {n_z} numbers")
    if solution == "newton" and not (reference and moved):
        place["solution"].fail(solution, '"closed form", or reference and actuated_in_z as well')


def _check_functions(manifest: Manifest, place: Place) -> None:
    functions = {function.name: function for function in manifest.functions}
    _check_unique([function.name for function in manifest.functions], place)
    for k, function in enumerate(manifest.functions):
        if not function.inputs or not function.outputs:
            place[k].fail(function.name, "at least one input and one output")
        # "out" and "threads" are keyword arguments of every call.
        names = [argument.name for argument in function.inputs]
        _check_unique([*names, "out", "threads"], place[k]["inputs"])
        _check_margin(function, functions.get(function.margin), place[k])
        _check_slots(function, len(manifest.coordinates), place[k])


def _check_unique(names: Sequence[str], place: Place) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ManifestError(f"{place.file}: {place.field}: {name!r} occurs twice")


def _check_margin(function: FunctionInfo, margin: FunctionInfo | None, place: Place) -> None:
    """Check the inputs of a margin function.

    Also check that each entry of its result belongs to a named loop.
    """
    first = replace(function.inputs[0], unit="", meaning="")
    if function.margin:
        inputs = [replace(a, unit="", meaning="") for a in margin.inputs] if margin else []
        if not (margin and margin.steps and inputs == [first]):
            place["margin"].fail(
                function.margin, f"a function of {first.name} alone that has steps"
            )
    if function.steps and [out.shape for out in function.outputs] != [(len(function.steps),)]:
        place["steps"].fail(list(function.steps), "one name for each entry of the only output")


def _check_slots(function: FunctionInfo, n: int, place: Place) -> None:
    """Check the order and shapes of outputs that have one row per solution."""
    role, outputs = function.role, function.outputs
    k = len(role.labels)
    if bool(k) != role.has_slots:
        place["role"].fail(role.name, "labels for an inverse or for branches only")
    if k and any(out.shape[:1] != (k,) for out in outputs):
        place["labels"].fail(list(role.labels), "as many as the first dimension of every output")
    expected = [("q", (k, n)), ("residual", (k,)), ("margin", (k,))]
    if role.is_inverse and [(out.name, out.shape) for out in outputs] != expected:
        found = [(out.name, out.shape) for out in outputs]
        place["outputs"].fail(found, f"q ({k}, {n}), residual ({k}) and margin ({k})")
    if role.is_inverse and function.margin:
        place["margin"].fail(function.margin, "none, since an inverse returns its own margin")
    for name, indices in (("fixed", role.fixed), ("free", role.free)):
        if any(index >= n for index in indices):
            place[name].fail(list(indices), f"indices below {n}, the number of coordinates")
    entries = sum(TASK_COMPONENTS[component] for component in role.components)
    if role.components and entries != math.prod(function.inputs[0].shape):
        place["components"].fail(
            list(role.components), f"components of {function.inputs[0].shape} entries"
        )
