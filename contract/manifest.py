"""The manifest of a generated robot: every fact that the runtime needs, as plain data.

The compiler writes these records, and the runtime reads them; both use their annotations.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from .bodies import SkeletonFacts
from .errors import SourceMismatchError
from .records import INLINE, NOT_STORED, Digest, Name, Sizes, one_of
from .roles import Kind, Role

SUPPORT = "support"
"""The folder of the C headers that the robots next to it share."""
FORMAT = 2
"""The version of the manifest, the value of its field `chasles`."""


@dataclass(frozen=True, slots=True)
class Coordinate:
    """An actuated coordinate: a joint, motor, slider or cylinder.

    Attributes:
        name: As in the robot's description.
        kind: "revolute" or "prismatic".
        unit: "rad" or "m".
        lower: Lower limit in that unit, None if there is none.
        upper: Upper limit in that unit, None if there is none.
        assumed: Whether the limits are assumed rather than published.
    """

    name: str
    kind: str
    unit: str
    lower: float | None
    upper: float | None
    assumed: bool = False


@dataclass(frozen=True, slots=True)
class Variable:
    """A passive joint, or an element of a robot's configuration: its name and unit."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class Reference:
    """The reference configuration, which selects the branch: coordinates q, variables z."""

    q: tuple[float, ...]
    z: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ActuatedVariable:
    """The variable z[index] that an actuated coordinate moves: q = z[index] / ratio."""

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
    """A number of the robot's geometry, as a float and as the exact text it came from.

    Attributes:
        name: Its name.
        value: Its value.
        exact: Its exact value, such as "pi/2".
        unit: Its unit.
        meaning: Its meaning in a few words.
        assumed: Whether the number is assumed rather than published.
    """

    name: str
    value: float
    exact: str
    unit: str
    meaning: str
    assumed: bool = False


@dataclass(frozen=True, slots=True)
class GeometryParameter:
    """An element of the vector p of parametric functions.

    Attributes:
        name: A joint, closure or strut, "base" or "tool", and the number, such as "elbow_alpha".
        value: Its nominal value.
        unit: "m", "rad", "m/rad" of a pitch, "rad/(N m)" or "m/N" of a spring, or "1" of a gain.
        of: The joint, closure or strut, "base" or "tool".
        part: "joint": a number of the joint's own description; "offset": the one of its coordinate;
            "axis": a correction of its axis; "transmission": gain and waves of its drive;
            "compliance": its spring under gravity; "loop": ends of closures and struts, and lengths
            of struts; "base" or "tool": corrections of the frames at both ends.
        meaning: Its meaning in a few words.
    """

    name: Name
    value: float
    unit: str
    of: str
    part: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Argument:
    """An input or output of a function: dense row-major float64 of one shape."""

    name: Name
    shape: Sizes
    unit: str
    meaning: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionInfo:
    """A generated C function.

    Attributes:
        name: Its name in Python.
        symbol: Its name in C.
        summary: Its meaning, in one line.
        identity: The identity it satisfies, "" if none is stated.
        role: Its role.
        inputs: In the order of the C arguments.
        outputs: In the order of the C arguments.
        operations: Floating-point operations of one pose, by kind, and their total.
        margin: The guard: the function of the same first input whose result is the distance of
            each loop from not closing; "" if no loop can fail to close.
        steps: The loop of each entry of a guard's result.
    """

    name: Name
    symbol: Name
    summary: str
    identity: str = ""
    role: Role = field(metadata=INLINE)
    inputs: tuple[Argument, ...]
    outputs: tuple[Argument, ...]
    operations: Mapping[str, int]
    margin: str = ""
    steps: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class InverseFacts:
    """The inverse as a whole.

    Attributes:
        tier: "exact" where it is a closed form; "snapped" where it starts from the closed form of
            a nominal arm nearby and iterates; "general" where it takes the roots of a determinant;
            "none" where there is none.
        missing: Why there is none; "" where there is one or the manifest states no reason.
    """

    tier: Annotated[str, one_of(("exact", "snapped", "general", "none"))] = "exact"
    missing: str = ""


@dataclass(frozen=True, slots=True)
class CleanedNumber:
    """A number of the description that was not taken as it is written.

    Attributes:
        at: The joint, "base", "tool" or the parameter that has it.
        field: Its field there, such as "alpha" or "roll"; "" for a parameter.
        found: The number as written.
        taken: The exact number that the robot has instead, such as "pi/2".
    """

    at: str
    field: str
    found: str
    taken: str


@dataclass(frozen=True, slots=True)
class Cleaning:
    """The effect of all cleaned numbers together.

    Attributes:
        position: Bound of the distance (m) between the tool's positions as described and as
            computed, at joint values within the limits; 0.0 where no number was cleaned.
        orientation: Bound of the angle (rad) between the tool's orientations. Of a robot with
            loops, both are the largest values at random configurations; the notes state how many.
        numbers: The cleaned numbers, in order from the base.
    """

    position: float = 0.0
    orientation: float = 0.0
    numbers: tuple[CleanedNumber, ...] = ()


@dataclass(frozen=True, slots=True)
class LoopFacts:
    """The loops of a robot; all fields are empty for a serial one.

    Attributes:
        chain: The joints of the main chain, in the order of `theta`.
        passive: The joints that are neither actuated nor in the main chain.
        configuration: All variables of the loops, the vector `z`.
        names: Their names.
        reference: The reference configuration, None if the manifest states none.
        actuated_in_z: The variable in `z` that each actuated coordinate moves.
        solution: "closed form", "newton", or "" without loops.
    """

    chain: tuple[Coordinate, ...] = ()
    passive: tuple[Variable, ...] = ()
    configuration: tuple[Variable, ...] = ()
    names: tuple[str, ...] = field(default=(), metadata={"key": "loops"})
    reference: Reference | None = None
    actuated_in_z: tuple[ActuatedVariable, ...] = ()
    solution: Annotated[str, one_of(("closed form", "newton", ""))] = ""


@dataclass(frozen=True, slots=True)
class ContractTolerances:
    """Tolerances that belong to the generated code.

    Attributes:
        dead_point: Margin up to which a loop counts as at its dead point.
    """

    dead_point: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """A generated robot, as its manifest describes it.

    Attributes:
        name: The robot's name, a C and Python identifier.
        title: The robot's name for people.
        kind: One of :data:`chasles.contract.KINDS`.
        source: The origin of the description.
        coordinates: The actuated coordinates, in the order of `q`.
        frames: The names of the frames.
        parameters: The named numbers of its description.
        functions: Its functions.
        tolerances: Tolerances of the generated code.
        files: SHA-256 of each generated file.
        loops: Its loops.
        format: The version of the manifest.
        notes: Remarks, such as numbers that were snapped.
        cleaning: The numbers of the description that were not taken as written, and their effect.
        geometry: The vector p of its parametric functions; () without them.
        robot_file: With loops, the text of its robot file with places for the numbers of another
            geometry; for an arm with masses, the springs of that file; "" otherwise.
        inverse: The tier of its inverse, or the reason why there is none.
        skeleton: Its rigid bodies.
        description_sha256: SHA-256 of the description.
        languages: The generated files by language.
        versions: The versions of the libraries that derived it.
        folder: The folder that holds the manifest; not stored.
        digest: SHA-256 of the manifest, which holds the hashes of the files; not stored.
    """

    format: int = field(metadata={"key": "chasles"})
    name: Name
    title: str
    kind: Kind
    source: str
    coordinates: tuple[Coordinate, ...]
    frames: Frames
    parameters: tuple[Parameter, ...]
    notes: tuple[str, ...] = ()
    cleaning: Cleaning = Cleaning()
    geometry: tuple[GeometryParameter, ...] = ()
    robot_file: str = ""
    functions: tuple[FunctionInfo, ...]
    loops: LoopFacts = field(default=LoopFacts(), metadata=INLINE)
    inverse: InverseFacts = InverseFacts()
    skeleton: SkeletonFacts | None = None
    tolerances: ContractTolerances
    description_sha256: str = ""
    languages: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    files: Mapping[str, Digest]
    versions: Mapping[str, str] = field(default_factory=dict)
    folder: Path = field(default=Path(), metadata=NOT_STORED)
    digest: str = field(default="", metadata=NOT_STORED)

    @property
    def is_iterated(self) -> bool:
        """Whether the loops are solved by iteration."""
        return self.kind in ("platform", "iterated")

    def with_role(self, role: str, domain: str, codomain: str = "") -> FunctionInfo | None:
        """The function of a role.

        Args:
            role: Its role.
            domain: The vector it takes first.
            codomain: The vector it returns, of maps and branches.

        Returns:
            The first one in the manifest, None where the robot has none.
        """
        wanted = (role, domain, codomain)
        return next((f for f in self.functions if f.role.key == wanted), None)

    @property
    def batch_file(self) -> str:
        """Name of the C file for batches of poses, which a robot may lack."""
        return f"{self.name}_batch.c"

    @property
    def wraps(self) -> tuple[bool, ...]:
        """Whether a full turn of each coordinate leaves the pose unchanged.

        It does not for a motor behind a gear or one that drives a spindle.
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

    def path_of(self, file: str) -> Path:
        """The path of a generated file.

        The robots that are installed with chasles share their support headers: these lie in the
        folder `support` next to the folders of the robots.
        """
        own, shared = self.folder / file, self.folder.parent / SUPPORT / file
        return shared if shared.is_file() and not own.exists() else own

    def sources(self) -> dict[str, str]:
        """The text of every C file and header, by name; raises as `read_source`."""
        return {file: self.read_source(file).decode() for file in self.c_files}

    def read_source(self, file: str) -> bytes:
        """The bytes of a generated file, refused unless their hash is the hash in the manifest.

        Args:
            file: Its name, such as "ur5e.c".

        Raises:
            SourceMismatchError: If the file is absent or its SHA-256 differs.
        """
        path = self.path_of(file)
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
