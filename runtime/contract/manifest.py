"""Reads `manifest.json`, the contract between the compiler and this package.

A manifest says what a generated robot is and which C functions it offers. It is checked
completely when read, so that the rest of the package can rely on it.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from keyword import iskeyword
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn

from ..errors import ManifestError, SourceMismatchError, UnknownRobotError

FORMAT = 1
"""The version of the contract, the value of the field `chasles`."""


@dataclass(frozen=True, slots=True)
class Coordinate:
    """One actuated coordinate: a joint, motor, slider or cylinder.

    Attributes:
        name: As in the robot's description.
        kind: "revolute" or "prismatic".
        unit: "rad" or "m".
        lower: Lower limit in that unit, None if there is none.
        upper: Upper limit in that unit, None if there is none.
    """

    name: str
    kind: str
    unit: str
    lower: float | None
    upper: float | None


@dataclass(frozen=True, slots=True)
class Variable:
    """A passive joint, or an element of a robot's configuration: its name and unit."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class Reference:
    """The configuration whose branch is meant: actuated coordinates q, and all variables z."""

    q: tuple[float, ...]
    z: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ActuatedVariable:
    """Where an actuated coordinate is in the configuration: q = z[index] / ratio."""

    index: int
    ratio: float


@dataclass(frozen=True, slots=True)
class Frames:
    """The names of the frames: the base, the tip, and the links between."""

    base: str
    tip: str
    links: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number of the robot's geometry, as a float and as the exact text it came from."""

    name: str
    value: float
    exact: str
    unit: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Argument:
    """An input or output of a function: dense row-major float64 of one shape."""

    name: str
    shape: tuple[int, ...]
    unit: str
    meaning: str


@dataclass(frozen=True, slots=True)
class FunctionInfo:
    """One generated C function.

    Attributes:
        name: As called from Python.
        symbol: As named in C.
        summary: What it computes, in one line.
        identity: The identity it satisfies, "" if none is told.
        inputs: In the order of the C arguments.
        outputs: In the order of the C arguments.
        operations: Floating-point operations of one pose, by kind, and their total.
        margin: The function of the same first input that says how far each loop is from not
            closing, "" if none needs to.
        steps: For such a function, the loop of each entry of its result.
        branches: How many branches of the inverse it computes, each in a slot of its own; 0 of a
            function that is no inverse.
    """

    name: str
    symbol: str
    summary: str
    identity: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]
    operations: Mapping[str, int]
    margin: str = ""
    steps: tuple[str, ...] = ()
    branches: int = 0


@dataclass(frozen=True, slots=True)
class Inverse:
    """What a manifest says of the inverse as a whole.

    Attributes:
        tier: "exact"; "snapped" where the generated inverse is that of a nominal arm nearby, from
            which the true one is reached by iteration; "general" where it is no closed form; "none"
            where there is none.
        missing: Why there is none, "" where there is one or nothing is told.
    """

    tier: str
    missing: str


@dataclass(frozen=True, slots=True)
class Loops:
    """What a manifest says of loops; a serial robot has none.

    Attributes:
        names: The loops.
        solution: "closed form", "newton", or "" without loops.
        chain: The joints of the main chain, in the order of `theta`.
        passive: The joints that are neither actuated nor in the main chain.
        configuration: All variables of the loops, the vector `z`.
        reference: The configuration whose branch is meant, None if none is told.
        actuated_in_z: Where each actuated coordinate is in `z`.
    """

    names: tuple[str, ...]
    solution: str
    chain: tuple[Coordinate, ...]
    passive: tuple[Variable, ...]
    configuration: tuple[Variable, ...]
    reference: Reference | None
    actuated_in_z: tuple[ActuatedVariable, ...]


@dataclass(frozen=True, slots=True)
class Manifest:
    """A generated robot, as its manifest describes it.

    Attributes:
        folder: Where it was read.
        digest: SHA-256 of the manifest, which holds those of the files.
        name: The robot's name, a C and Python identifier.
        title: The robot's name for people.
        source: Where the description comes from.
        coordinates: The actuated coordinates, in the order of `q`.
        frames: The names of the frames.
        parameters: The geometry.
        notes: What to know about it, such as where it is not what it seems.
        functions: What it offers.
        loops: Its loops.
        inverse: How its inverse was found, or why none was.
        files: SHA-256 of each generated file.
    """

    folder: Path
    digest: str
    name: str
    title: str
    source: str
    coordinates: tuple[Coordinate, ...]
    frames: Frames
    parameters: tuple[Parameter, ...]
    notes: tuple[str, ...]
    functions: tuple[FunctionInfo, ...]
    loops: Loops
    inverse: Inverse
    files: Mapping[str, str]

    @property
    def batch_file(self) -> str:
        """Name of the C file for many poses at once, which a robot may lack."""
        return f"{self.name}_batch.c"

    @property
    def wraps(self) -> tuple[bool, ...]:
        """Of which coordinates a full turn changes nothing.

        Of a motor with a gear it changes something, and of one that drives a spindle.
        """
        ratios = [item.ratio for item in self.loops.actuated_in_z] or [1.0] * len(self.coordinates)
        return tuple(
            coordinate.unit == "rad" and abs(ratio) == 1
            for coordinate, ratio in zip(self.coordinates, ratios, strict=True)
        )

    @property
    def c_files(self) -> tuple[str, ...]:
        """Names of the generated C files and headers."""
        return tuple(file for file in self.files if file.endswith((".c", ".h")))

    def read_source(self, file: str) -> bytes:
        """The bytes of a generated file, refused unless they are those of the manifest.

        Args:
            file: Its name, such as "ur5e.c".

        Raises:
            SourceMismatchError: If the file is absent or its SHA-256 is another.
        """
        path = self.folder / file
        try:
            content = path.read_bytes()
        except OSError as error:
            message = f"{path}: cannot be read ({error.strerror}); derive {self.name} again"
            raise SourceMismatchError(message) from error
        if hashlib.sha256(content).hexdigest() != self.files[file]:
            raise SourceMismatchError(
                f"{path}: changed since it was generated (its SHA-256 is not the one in "
                f"manifest.json); derive {self.name} again"
            )
        return content


class _Entry:
    """A JSON value and where it stands, so that an error can name file and field."""

    def __init__(self, file: Path, field: str, value: object) -> None:
        self.file, self.field, self.value = file, field, value

    def fail(self, expected: str) -> NoReturn:
        raise ManifestError(f"{self.file}: {self.field}: got {self.value!r}, expected {expected}")

    def __getitem__(self, key: str) -> _Entry:
        fields = self.mapping()
        if key not in fields:
            raise ManifestError(f"{self.file}: {self.field}: has no {key!r}")
        return fields[key]

    def get(self, key: str, default: object) -> _Entry:
        return self.mapping().get(key, _Entry(self.file, key, default))

    def mapping(self) -> dict[str, _Entry]:
        if not isinstance(self.value, dict):
            self.fail("an object")
        prefix = "" if self.field == "manifest" else f"{self.field}."
        return {key: _Entry(self.file, prefix + key, value) for key, value in self.value.items()}

    def __iter__(self) -> Iterator[_Entry]:
        if not isinstance(self.value, list):
            self.fail("a list")
        for index, value in enumerate(self.value):
            yield _Entry(self.file, f"{self.field}[{index}]", value)

    def text(self) -> str:
        if not isinstance(self.value, str):
            self.fail("a string")
        return self.value

    def texts(self) -> tuple[str, ...]:
        return tuple(item.text() for item in self)

    def identifier(self) -> str:
        # Goes into generated C as it stands, so nothing but a plain name may pass.
        text = self.text()
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", text) or iskeyword(text):
            self.fail("a name of ASCII letters, digits and underscores")
        return text

    def number(self) -> float:
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            self.fail("a number")
        return float(self.value)

    def numbers(self) -> tuple[float, ...]:
        return tuple(item.number() for item in self)

    def limit(self) -> float | None:
        return None if self.value is None else self.number()

    def count(self) -> int:
        if isinstance(self.value, bool) or not isinstance(self.value, int) or self.value < 0:
            self.fail("a count")
        return self.value

    def shape(self) -> tuple[int, ...]:
        shape = tuple(size.count() for size in self)
        if 0 in shape:
            self.fail("sizes of at least 1")
        return shape

    def sha256(self) -> str:
        text = self.text()
        if not re.fullmatch(r"[0-9a-f]{64}", text):
            self.fail("a SHA-256 in lower-case hexadecimal")
        return text

    def unique(self, names: list[str]) -> None:
        for name in names:
            if names.count(name) > 1:
                raise ManifestError(f"{self.file}: {self.field}: {name!r} is there twice")


def read_manifest(folder: Path) -> Manifest:
    """Reads and checks the manifest of a generated robot.

    Args:
        folder: The robot's folder, which holds `manifest.json`.

    Returns:
        The manifest.

    Raises:
        UnknownRobotError: If there is no manifest in the folder.
        ManifestError: If it is not of the form that this version reads.
    """
    file = folder / "manifest.json"
    try:
        content = file.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        reason = "no manifest.json in it" if folder.is_dir() else "no such folder"
        raise UnknownRobotError(f"{folder}: no generated robot ({reason})") from None
    try:
        entry = _Entry(file, "manifest", json.loads(content))
    except ValueError as error:
        raise ManifestError(f"{file}: not JSON: {error}") from error
    if entry["chasles"].value != FORMAT:
        entry["chasles"].fail(f"{FORMAT}; derive the robot again with this version")
    manifest = Manifest(
        folder=folder,
        digest=hashlib.sha256(content).hexdigest(),
        name=entry["name"].identifier(),
        title=entry["title"].text(),
        source=entry["source"].text(),
        coordinates=tuple(_coordinate(item) for item in entry["coordinates"]),
        frames=_frames(entry["frames"]),
        parameters=tuple(_parameter(item) for item in entry["parameters"]),
        notes=entry.get("notes", []).texts(),
        functions=tuple(_function(item) for item in entry["functions"]),
        loops=_loops(entry),
        inverse=_inverse(entry.get("inverse", {})),
        files=MappingProxyType({key: v.sha256() for key, v in entry["files"].mapping().items()}),
    )
    entry["functions"].unique([function.name for function in manifest.functions])
    for needed in (f"{manifest.name}.c", f"{manifest.name}.h"):
        _ = entry["files"][needed]
    _check_margins(entry, manifest.functions)
    _check_branches(entry, manifest)
    return manifest


def _inverse(entry: _Entry) -> Inverse:
    tier = entry.get("tier", "exact")
    if tier.value not in ("exact", "snapped", "general", "none"):
        tier.fail('"exact", "snapped", "general" or "none"')
    return Inverse(tier.text(), entry.get("missing", "").text())


def _check_branches(entry: _Entry, manifest: Manifest) -> None:
    """The outputs of an inverse are known by their order and shapes, as Solutions have them."""
    for function, item in zip(manifest.functions, entry["functions"], strict=True):
        k, n = function.branches, len(manifest.coordinates)
        expected = [("q", (k, n)), ("residual", (k,)), ("margin", (k,))]
        if k and [(out.name, out.shape) for out in function.outputs] != expected:
            item["outputs"].fail(f"q ({k}, {n}), residual ({k}) and margin ({k})")
        if k and function.margin:
            item["margin"].fail("none of a function with branches, which tells its own")
    names = [function.name for function in manifest.functions]
    if manifest.inverse.tier == "snapped" and "ik" in names and "fk_jacobian_mixed" not in names:
        entry["inverse"]["tier"].fail('"exact", or a function fk_jacobian_mixed to iterate with')


def _loops(entry: _Entry) -> Loops:
    solution = entry.get("solution", "")
    if solution.value not in ("", "closed form", "newton"):
        solution.fail('"closed form" or "newton"')
    configuration = tuple(_variable(item) for item in entry.get("configuration", []))
    reference = entry.get("reference", None)
    loops = Loops(
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


def _check_sizes(entry: _Entry, loops: Loops) -> None:
    n, n_z = len(list(entry["coordinates"])), len(loops.configuration)
    if loops.reference and (len(loops.reference.q), len(loops.reference.z)) != (n, n_z):
        entry["reference"].fail(f"{n} values of q and {n_z} of z")
    if loops.actuated_in_z and len(loops.actuated_in_z) != n:
        entry["actuated_in_z"].fail(f"{n} entries, one a coordinate")
    if any(item.index >= n_z for item in loops.actuated_in_z):
        entry["actuated_in_z"].fail(f"indices below {n_z}, the size of the configuration")
    if loops.solution == "newton" and not (loops.reference and loops.actuated_in_z):
        entry["solution"].fail('"closed form", or reference and actuated_in_z beside it')


def _check_margins(entry: _Entry, functions: tuple[FunctionInfo, ...]) -> None:
    """What a function calls its margin must be one: of the same input, with a loop an entry."""
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


def _variable(entry: _Entry) -> Variable:
    return Variable(entry["name"].text(), entry["unit"].text())


def _actuated(entry: _Entry) -> ActuatedVariable:
    return ActuatedVariable(entry["index"].count(), entry["ratio"].number())


def _coordinate(entry: _Entry) -> Coordinate:
    return Coordinate(
        entry["name"].text(),
        entry["kind"].text(),
        entry["unit"].text(),
        entry["lower"].limit(),
        entry["upper"].limit(),
    )


def _frames(entry: _Entry) -> Frames:
    return Frames(entry["base"].text(), entry["tip"].text(), entry["links"].texts())


def _parameter(entry: _Entry) -> Parameter:
    return Parameter(
        entry["name"].text(),
        entry["value"].number(),
        entry["exact"].text(),
        entry["unit"].text(),
        entry["meaning"].text(),
    )


def _function(entry: _Entry) -> FunctionInfo:
    inputs = tuple(_argument(item) for item in entry["inputs"])
    outputs = tuple(_argument(item) for item in entry["outputs"])
    if not inputs or not outputs:
        entry.fail("at least one input and one output")
    # "out" and "threads" are keywords of every call.
    entry["inputs"].unique([*(argument.name for argument in inputs), "out", "threads"])
    operations = {kind: count.count() for kind, count in entry["operations"].mapping().items()}
    branches = entry.get("branches", 0)
    if branches.count() and any(out.shape[:1] != (branches.count(),) for out in outputs):
        branches.fail("the first dimension of every output")
    return FunctionInfo(
        entry["name"].identifier(),
        entry["symbol"].identifier(),
        entry["summary"].text(),
        entry.get("identity", "").text(),
        inputs,
        outputs,
        MappingProxyType(operations),
        entry.get("margin", "").text(),
        entry.get("steps", []).texts(),
        branches.count(),
    )


def _argument(entry: _Entry) -> Argument:
    return Argument(
        entry["name"].identifier(),
        entry["shape"].shape(),
        entry["unit"].text(),
        entry["meaning"].text(),
    )
