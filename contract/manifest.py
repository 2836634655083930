"""Reads `manifest.json`, the contract between the compiler and the runtime.

A manifest states the facts of a generated robot and its C functions, all of them in fields. It is
checked completely when read, so that the rest of the runtime can rely on it.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from types import MappingProxyType

from .errors import ManifestError, UnknownRobotError
from .facts import (
    AIMS,
    ActuatedVariable,
    Argument,
    CleanedNumber,
    Cleaning,
    ContractTolerances,
    Coordinate,
    Frames,
    FunctionInfo,
    GeometryParameter,
    InverseFacts,
    LoopFacts,
    Manifest,
    Parameter,
    Reference,
    Variable,
)
from .json_entry import Entry
from .skeleton_facts import SkeletonFacts, skeleton_facts

FORMAT = 2
"""The version of the contract, the value of the field `chasles`."""
_KINDS = ("serial", "hybrid", "platform", "iterated")
_SOLUTIONS = {
    "serial": "",
    "hybrid": "closed form",
    "platform": "newton",
    "iterated": "newton",
}
"""The method that solves the loops, by the kind of the robot."""
_LAST_DIRECTION = 5
_WITH_SLOTS = ("inverse", "branches")


def read_manifest(folder: Path) -> Manifest:
    """Reads and checks the manifest of a generated robot.

    Args:
        folder: The robot's folder, which holds `manifest.json`.

    Returns:
        The manifest.

    Raises:
        UnknownRobotError: If there is no manifest in the folder.
        ManifestError: If it does not have the form that this version reads.
    """
    file = folder / "manifest.json"
    try:
        content = file.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        reason = "no manifest.json in it" if folder.is_dir() else "no such folder"
        raise UnknownRobotError(f"{folder}: no generated robot ({reason})") from None
    try:
        entry = Entry(file, "manifest", json.loads(content))
    except ValueError as error:
        raise ManifestError(f"{file}: not JSON: {error}") from error
    if entry["chasles"].value != FORMAT:
        found = entry["chasles"].value
        raise ManifestError(
            f"{file}: chasles: the robot was generated in format {found!r} of the contract, and "
            f"this version reads format {FORMAT}; derive the robot again with this version"
        )
    manifest = Manifest(
        folder=folder,
        digest=hashlib.sha256(content).hexdigest(),
        name=entry["name"].identifier(),
        title=entry["title"].text(),
        kind=entry["kind"].one_of(_KINDS),
        source=entry["source"].text(),
        coordinates=tuple(_coordinate(item) for item in entry["coordinates"]),
        frames=_frames(entry["frames"]),
        parameters=tuple(_parameter(item) for item in entry["parameters"]),
        geometry=tuple(_geometry(item) for item in entry.get("geometry", [])),
        robot_file=entry.get("robot_file", "").text(),
        notes=entry.get("notes", []).texts(),
        cleaning=_cleaning(entry["cleaning"]) if "cleaning" in entry.fields() else Cleaning(),
        functions=tuple(_function(item) for item in entry["functions"]),
        loops=_loops(entry),
        inverse=_inverse(entry.get("inverse", {})),
        tolerances=_tolerances(entry["tolerances"]),
        skeleton=_skeleton(entry) if "skeleton" in entry.fields() else None,
        files=MappingProxyType({key: v.sha256() for key, v in entry["files"].mapping().items()}),
    )
    entry["functions"].unique([function.name for function in manifest.functions])
    for needed in (f"{manifest.name}.c", f"{manifest.name}.h"):
        _ = entry["files"][needed]
    _check_margins(entry, manifest.functions)
    _check_slots(entry, manifest)
    return manifest


def _geometry(entry: Entry) -> GeometryParameter:
    unit, of, part, meaning = (entry[name].text() for name in ("unit", "of", "part", "meaning"))
    value = entry["value"].number()
    return GeometryParameter(entry["name"].identifier(), value, unit, of, part, meaning)


def _inverse(entry: Entry) -> InverseFacts:
    tier = entry.get("tier", "exact").one_of(("exact", "snapped", "general", "none"))
    return InverseFacts(tier, entry.get("missing", "").text())


def _cleaning(entry: Entry) -> Cleaning:
    numbers = (
        CleanedNumber(*(item[field].text() for field in ("at", "field", "found", "taken")))
        for item in entry["numbers"]
    )
    return Cleaning(entry["position"].number(), entry["orientation"].number(), tuple(numbers))


def _tolerances(entry: Entry) -> ContractTolerances:
    return ContractTolerances(entry["dead_point"].number())


def _skeleton(entry: Entry) -> SkeletonFacts:
    variables = "configuration" if "configuration" in entry.fields() else "coordinates"
    return skeleton_facts(entry["skeleton"], len(list(entry[variables])))


def _check_slots(entry: Entry, manifest: Manifest) -> None:
    """Checks the slots of inverses and branches, which Solutions reads by order and shape."""
    n = len(manifest.coordinates)
    for function, item in zip(manifest.functions, entry["functions"], strict=True):
        k = len(function.labels)
        if bool(k) != (function.role in _WITH_SLOTS):
            item["role"].fail("labels of an inverse or of branches, and of no other function")
        if k and any(out.shape[:1] != (k,) for out in function.outputs):
            item["labels"].fail("as many as the first dimension of every output")
        expected = [("q", (k, n)), ("residual", (k,)), ("margin", (k,))]
        if function.is_inverse and [(out.name, out.shape) for out in function.outputs] != expected:
            item["outputs"].fail(f"q ({k}, {n}), residual ({k}) and margin ({k})")
        if function.is_inverse and function.margin:
            item["margin"].fail("none, since an inverse returns its own margin")
        for field, indices in (("given", function.given), ("held", function.held)):
            if any(index >= n for index in indices):
                item[field].fail(f"indices below {n}, the number of coordinates")
        entries = sum(AIMS[aim] for aim in function.aims)
        if function.aims and (entries,) != function.inputs[0].shape:
            item["aims"].fail(f"parts with {function.inputs[0].shape} entries in all")


def _loops(entry: Entry) -> LoopFacts:
    solution = entry.get("solution", "")
    expected = _SOLUTIONS[entry["kind"].one_of(_KINDS)]
    if solution.value != expected:
        solution.fail(f"{expected!r}, since the kind is {entry['kind'].value!r}")
    configuration = tuple(_variable(item) for item in entry.get("configuration", []))
    reference = entry.get("reference", None)
    loops = LoopFacts(
        names=entry.get("loops", []).texts(),
        solution=solution.text(),
        chain=tuple(_coordinate(item) for item in entry.get("chain", [])),
        passive=tuple(_variable(item) for item in entry.get("passive", [])),
        configuration=configuration,
        reference=None
        if reference.value is None
        else Reference(reference["q"].numbers(), reference["z"].numbers()),
        actuated_in_z=tuple(_actuated(item) for item in entry.get("actuated_in_z", [])),
    )
    _check_sizes(entry, loops)
    return loops


def _check_sizes(entry: Entry, loops: LoopFacts) -> None:
    n, n_z = len(list(entry["coordinates"])), len(loops.configuration)
    if loops.reference and (len(loops.reference.q), len(loops.reference.z)) != (n, n_z):
        entry["reference"].fail(f"{n} values of q and {n_z} of z")
    if loops.actuated_in_z and len(loops.actuated_in_z) != n:
        entry["actuated_in_z"].fail(f"{n} entries, one a coordinate")
    if any(item.index >= n_z for item in loops.actuated_in_z):
        entry["actuated_in_z"].fail(f"indices below {n_z}, the size of the configuration")
    if loops.solution == "newton" and not (loops.reference and loops.actuated_in_z):
        entry["solution"].fail('"closed form", or reference and actuated_in_z beside it')


def _check_margins(entry: Entry, functions: tuple[FunctionInfo, ...]) -> None:
    """Checks that each guard takes the same input and has a loop for each entry."""
    by_name = {function.name: function for function in functions}
    for function, item in zip(functions, entry["functions"], strict=True):
        margin, first = by_name.get(function.margin), function.inputs[0]
        if function.margin and not (
            margin
            and margin.steps
            and [(a.name, a.shape) for a in margin.inputs] == [(first.name, first.shape)]
        ):
            item["margin"].fail(f"a function of {first.name} alone that has steps")
    for function, item in zip(functions, entry["functions"], strict=True):
        if function.steps and [out.shape for out in function.outputs] != [(len(function.steps),)]:
            item["steps"].fail("one name for each entry of the only output")


def _variable(entry: Entry) -> Variable:
    return Variable(entry["name"].text(), entry["unit"].text())


def _actuated(entry: Entry) -> ActuatedVariable:
    return ActuatedVariable(entry["index"].count(), entry["ratio"].number())


def _coordinate(entry: Entry) -> Coordinate:
    return Coordinate(
        entry["name"].text(),
        entry["kind"].text(),
        entry["unit"].text(),
        entry["lower"].limit(),
        entry["upper"].limit(),
    )


def _frames(entry: Entry) -> Frames:
    return Frames(entry["base"].text(), entry["tip"].text(), entry["links"].texts())


def _parameter(entry: Entry) -> Parameter:
    return Parameter(
        entry["name"].text(),
        entry["value"].number(),
        entry["exact"].text(),
        entry["unit"].text(),
        entry["meaning"].text(),
    )


def _function(entry: Entry) -> FunctionInfo:
    inputs = tuple(_argument(item) for item in entry["inputs"])
    outputs = tuple(_argument(item) for item in entry["outputs"])
    if not inputs or not outputs:
        entry.fail("at least one input and one output")
    # "out" and "threads" are keywords of every call.
    entry["inputs"].unique([*(argument.name for argument in inputs), "out", "threads"])
    operations = {kind: count.count() for kind, count in entry["operations"].mapping().items()}
    directions = entry.get("directions", [])
    if any(index.count() > _LAST_DIRECTION for index in directions):
        directions.fail("components of a twist, 0 to 5")
    return FunctionInfo(
        entry["name"].identifier(),
        entry["symbol"].identifier(),
        entry["summary"].text(),
        entry.get("identity", "").text(),
        inputs,
        outputs,
        MappingProxyType(operations),
        role=entry["role"].text(),
        domain=entry.get("domain", "").text(),
        codomain=entry.get("codomain", "").text(),
        margin=entry.get("margin", "").text(),
        steps=entry.get("steps", []).texts(),
        given=tuple(index.count() for index in entry.get("given", [])),
        labels=entry.get("labels", []).texts(),
        directions=tuple(index.count() for index in directions),
        aims=tuple(aim.one_of(tuple(AIMS)) for aim in entry.get("aims", [])),
        held=tuple(index.count() for index in entry.get("held", [])),
        searches=entry.get("searches", False).flag(),
    )


def _argument(entry: Entry) -> Argument:
    return Argument(
        entry["name"].identifier(),
        entry["shape"].shape(),
        entry["unit"].text(),
        entry["meaning"].text(),
    )
