"""The manifest of a generated robot: every fact that the runtime needs, as plain data.

The compiler writes the records of this module to `manifest.json`, and the runtime reads the
records. The type annotation of each field determines how the field is converted to and from JSON.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, NamedTuple

from .bodies import SkeletonFacts
from .errors import MismatchError
from .gear_turns import keeps_full_turns
from .input_files import read_input
from .loop_variables import ActuatedVariable, LimitedVariable, Variable
from .records import INLINE, NOT_STORED, Digest, Name, Sizes, Vector, one_of
from .roles import TASKS, Kind, Role, TaskName

SUPPORT = "support"
"""Name of a folder with C headers."""
FORMAT = 2
"""The format version of the manifest, stored in its field `chasles`."""


@dataclass(frozen=True, slots=True)
class Coordinate:
    """An actuated coordinate: a joint, motor, slider or cylinder.

    Attributes:
        name: Name in the robot's description.
        kind: "revolute" or "prismatic".
        unit: "rad" or "m".
        lower: Lower limit (rad or m), or None if unlimited.
        upper: Upper limit (rad or m), or None if unlimited.
        assumed: Whether the limits are assumed rather than published.
    """

    name: str
    kind: str
    unit: str
    lower: float | None
    upper: float | None
    assumed: bool = False


class Redundancy(NamedTuple):
    """A redundancy parameter, whose value selects one of infinitely many inverse solutions.

    Attributes:
        name: Parameter name, the key in `fixed=`.
        index: Index of the coordinate in q, or None for a swivel angle.
        unit: Unit of the parameter.
        meaning: Description of the parameter.
    """

    name: str
    index: int | None  # type: ignore[assignment]
    unit: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Reference:
    """The reference configuration (q, z). z selects the branch of the loops."""

    q: tuple[float, ...]
    z: tuple[float, ...]


def full_turns(
    coordinates: Sequence[Coordinate], joints: Sequence[Coordinate], C: Sequence[Sequence[float]]
) -> tuple[bool, ...]:
    """Return, for each coordinate, whether a full turn leaves all joint poses unchanged."""
    return tuple(
        coordinate.unit == "rad"
        and all(
            row[k] == 0 if joint.unit == "m" else row[k] == round(row[k])
            for joint, row in zip(joints, C, strict=True)
        )
        for k, coordinate in enumerate(coordinates)
    )


@dataclass(frozen=True, slots=True)
class Frames:
    """The names of the base frame, the tip frame, and the link frames between them."""

    base: str
    tip: str
    links: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A named dimension of the robot, as a float and as its exact text.

    Attributes:
        name: Name of the parameter.
        value: Value as a float.
        exact: Exact value as text, such as "pi/2".
        unit: Unit of the value.
        meaning: Meaning of the parameter, in a few words.
        assumed: Whether the value is assumed rather than published.
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
        name: Name of the parameter in the description, or a part name followed by a quantity, such
            as "elbow_alpha". A part is a joint, closure or strut, "base" or "tool".
        value: Nominal value.
        unit: "m", "rad", "m/rad" for a pitch or a ratio, "rad/m" for a ratio, "rad/(N m)" or "m/N"
            for a compliance, or "1" for a gain or a ratio.
        joint: Name of the joint, closure or strut, "base", "tool", or "" for a parameter of the
            description.
        part: The group of the parameter. "parameter": a named dimension of the description.
            "joint": a dimension of the joint. "offset": the coordinate offset of the joint. "axis":
            a correction of the joint axis. "transmission": gain and periodic error of the joint's
            drive. "coupling": a ratio between motor and joint. "compliance": the joint deflection
            under gravity. "loop": the end position or length of a strut. "base" and "tool": a
            correction of the base or tool frame.
        meaning: Meaning of the parameter, in a few words.
    """

    name: Name
    value: float
    unit: str
    joint: str
    part: str
    meaning: str


@dataclass(frozen=True, slots=True)
class Argument:
    """An input or output of a function: a dense row-major float64 array."""

    name: Name
    shape: Sizes
    unit: str
    meaning: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionInfo:
    """A generated C function.

    Attributes:
        name: Name in Python.
        symbol: Name in C.
        summary: One line that describes the result.
        identity: The identity that the function satisfies, or "" if none is stated.
        role: What the function computes, such as the pose or an inverse kinematics function.
        inputs: The inputs in the order of the C arguments.
        outputs: The outputs in the order of the C arguments.
        operations: Floating-point operations per pose, by kind and in total.
        margin: Name of the margin function, or "" if every loop always closes. The margin function
            takes only the first input of the C function. For each loop, the margin function returns
            a measure of the distance from the boundary beyond which the loop cannot close.
        steps: For a margin function, the names of the loops to which the entries of the result
            belong.
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
    """The status of the robot's inverse kinematics.

    Attributes:
        method: "exact" (closed form), "snapped" (iteration from the closed form of a nearby nominal
            arm), "general" (roots of a determinant) or "none" (no inverse kinematics function).
        missing: The reason why the robot has no inverse kinematics function, or "" if no reason is
            stated.
    """

    method: Annotated[str, one_of(("exact", "snapped", "general", "none"))] = "exact"
    missing: str = ""


@dataclass(frozen=True, slots=True)
class CleanedNumber:
    """A value of the description that was replaced by an exact value.

    Attributes:
        at: Name of the joint or parameter that has the value. For a value of the base or tool
            frame, the name is "base" or "tool".
        field: Name of the field with the value, such as "alpha" or "roll", or "" for a parameter.
        found: The value as written in the description.
        taken: The exact value that the robot uses, such as "pi/2".
    """

    at: str
    field: str
    found: str
    taken: str


@dataclass(frozen=True, slots=True)
class Cleaning:
    """Noisy values that were replaced by exact values, and bounds of the resulting tool motion.

    Attributes:
        position: Upper bound (m) of the tool displacement that the replaced values cause within the
            joint limits. The bound is 0.0 if no value was cleaned.
        orientation: Upper bound (rad) of the tool rotation that the replaced values cause. For a
            robot with loops, the position and orientation bounds are maxima over random
            configurations. The notes of the manifest state the number of configurations.
        numbers: The cleaned values, in order from the base to the tool.
    """

    position: float = 0.0
    orientation: float = 0.0
    numbers: tuple[CleanedNumber, ...] = ()


@dataclass(frozen=True, slots=True)
class LoopFacts:
    """The loops of a robot. All fields are empty for a serial robot without couplings.

    Attributes:
        chain: The joints of the main chain, in the order of `theta`.
        passive: The passive joints outside the main chain, which are variables of `z`.
        configuration: All variables of the loops, in the order of the vector `z`.
        names: Names of the loops.
        reference: The reference configuration, or None if the manifest states no reference.
        actuated_in_z: The variable of `z` that each actuated coordinate moves, in the order of the
            coordinates.
        solution: "closed form", "newton", or "" without loops.
        coupling: The matrix C in theta = C q + c, or () without couplings. Here theta are the joint
            values of a coupled serial robot, and q are its coordinates.
        joint_couplings: Factors of the variables `z` in each coupling of a robot with loops. In
            each coupling, the sum of factor * variable is constant.
        limited: The variables of `z` that have limits and are not actuated.
    """

    chain: tuple[Coordinate, ...] = ()
    passive: tuple[Variable, ...] = ()
    configuration: tuple[Variable, ...] = ()
    names: tuple[str, ...] = field(default=(), metadata={"key": "loops"})
    reference: Reference | None = None
    actuated_in_z: tuple[ActuatedVariable, ...] = ()
    solution: Annotated[str, one_of(("closed form", "newton", ""))] = ""
    coupling: tuple[tuple[float, ...], ...] = ()
    joint_couplings: tuple[tuple[float, ...], ...] = ()
    limited: tuple[LimitedVariable, ...] = ()


@dataclass(frozen=True, slots=True)
class LinkMass:
    """A point mass of the description.

    Attributes:
        link: Name of a body: a link, or a section of a strut.
        mass: Mass [kg].
        at: Position in the frame of the body [m].
    """

    link: str
    mass: float
    at: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Load:
    """The masses of the description, and the gravity vector in the base frame [m/s^2]."""

    masses: tuple[LinkMass, ...] = ()
    gravity: Vector = (0.0, 0.0, -9.81)


@dataclass(frozen=True, slots=True)
class ContractTolerances:
    """Tolerances that the manifest of a generated robot contains.

    Attributes:
        dead_point: A loop is at a dead point if its margin function returns at most this value.
    """

    dead_point: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """A generated robot, as its manifest describes it.

    Attributes:
        name: The robot's name, a C and Python identifier.
        title: The display name of the robot.
        kind: One of ``chasles.contract.KINDS``.
        source: The source of the description.
        coordinates: The actuated coordinates, in the order of `q`.
        frames: The names of the frames.
        parameters: The named dimensions of the description.
        functions: The generated functions.
        tolerances: Tolerances of the generated code.
        files: SHA-256 of each generated file.
        loops: Facts about the loops of the robot.
        format: The format version of the manifest.
        notes: Remarks on the robot, such as values that were replaced by exact values.
        cleaning: The values of the robot file that were replaced, and the effect on the tool pose.
        geometry: The elements of the vector p, an input of the parametric functions. The tuple is
            empty if the robot has no parametric functions.
        robot_file: For a robot with loops: the text of a robot file with a placeholder for each
            dimension. For an arm with masses, `robot_file` contains the masses and springs of a
            robot file. Otherwise "".
        inverse: Solution method of the inverse kinematics function, or the reason for a missing
            inverse kinematics function.
        skeleton: The rigid bodies.
        load: The masses and the gravity of the description.
        description_sha256: SHA-256 of the description.
        languages: The generated files of each language.
        versions: The versions of the libraries with which the robot was derived.
        folder: The folder of the manifest. The manifest file does not contain this folder.
        digest: SHA-256 of the manifest. The manifest contains the hashes of all files. This SHA-256
            is not stored in the manifest.
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
    load: Load = Load()
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
        """Return the first function with a specified role, domain and codomain.

        Args:
            role: Name of the function's role, such as "pose".
            domain: Name of the coordinate vector that is the first input.
            codomain: Name of the coordinate vector that the function returns, or "" for a function
                that does not return coordinates.

        Returns:
            The first match in the manifest, or None if no function matches.
        """
        wanted = (role, domain, codomain)
        return next((f for f in self.functions if f.role.key == wanted), None)

    @property
    def redundancy(self) -> tuple[Redundancy, ...]:
        """The redundancy parameters, or () without `ik` or without redundancy."""
        own = self.with_role("inverse", "pose")
        found = []
        for k, item in enumerate(own.inputs[1:] if own else ()):
            index = own.role.fixed[k] if own and own.role.fixed else None
            of_joint = index is not None and not self.loops.chain
            name = self.coordinates[index].name if index is not None and of_joint else item.name
            found.append(Redundancy(name, index, item.unit, item.meaning))
        return tuple(found)

    @property
    def direct_parameters(self) -> tuple[str, ...]:
        """The names of the redundancy parameters that a direct call of the C IK function may set.

        The tuple is empty if a redundancy parameter of a serial robot is the value of a joint
        between other joints. Some values of this joint may make the inverse kinematics function
        degenerate.
        """
        fixed = {item.index for item in self.redundancy}
        free = [k for k in range(len(self.coordinates)) if k not in fixed]
        is_outer = None in fixed or len(free) == free[-1] - free[0] + 1
        names = tuple(item.name for item in self.redundancy)
        return names if is_outer or self.loops.chain else ()

    @property
    def free_coordinates(self) -> dict[str, tuple[str, ...]]:
        """The names of the coordinates that the inverse of a task sets to 0, keyed by task."""
        found = {i.name.removeprefix("ik_"): i.role.free for i in self.functions if i.role.free}
        names = [coordinate.name for coordinate in self.coordinates]
        return {task: tuple(names[k] for k in found[task]) for task in found}

    @property
    def inverses(self) -> dict[TaskName, FunctionInfo]:
        """The inverse kinematics functions, keyed by task."""
        found: dict[TaskName, FunctionInfo] = {}
        for task, components in TASKS.items():
            for info in self.functions:
                role = info.role
                is_of_task = role.is_inverse and role.components == components
                if is_of_task and (components or role.domain == "pose"):
                    found.setdefault(task, info)
        return found

    @property
    def batch_file(self) -> str:
        """Name of the optional C file for pose batches."""
        return f"{self.name}_batch.c"

    @property
    def wraps(self) -> tuple[bool, ...]:
        """Whether a full turn of each coordinate leaves the pose unchanged.

        The value is False for the motor of a gearbox or of a spindle. The value is also False if a
        full turn of the coordinate moves a prismatic joint, or rotates a coupled joint by a
        non-integer number of turns.
        """
        if self.loops.coupling:
            return full_turns(self.coordinates, self.loops.chain, self.loops.coupling)
        if not self.loops.actuated_in_z:
            return tuple(coordinate.unit == "rad" for coordinate in self.coordinates)
        is_angle = [variable.unit == "rad" for variable in self.loops.configuration]
        rows = self.loops.joint_couplings
        return tuple(
            coordinate.unit == "rad"
            and abs(moved.ratio) == 1
            and keeps_full_turns(moved.index, rows, is_angle)
            for coordinate, moved in zip(self.coordinates, self.loops.actuated_in_z, strict=True)
        )

    @property
    def c_files(self) -> tuple[str, ...]:
        """Names of the generated C files and headers."""
        return tuple(file for file in self.files if file.endswith((".c", ".h")))

    def path_of(self, file: str) -> Path:
        """Return the path of a generated file.

        Robots installed with chasles share their support headers in the folder `support`.
        """
        own, shared = self.folder / file, self.folder.parent / SUPPORT / file
        return shared if shared.is_file() and not own.exists() else own

    def sources(self) -> dict[str, str]:
        """Return the text of every C file and header, keyed by name."""
        return {file: self.read_source(file).decode() for file in self.c_files}

    def read_source(self, file: str) -> bytes:
        """Return the bytes of a generated file after checking its hash against the manifest.

        Args:
            file: File name, such as "ur5e.c".

        Raises:
            MismatchError: The file is absent or its SHA-256 differs.
        """
        path = self.path_of(file)
        try:
            content = read_input(path)
        except OSError as error:
            message = f"{path}: cannot be read ({error.strerror}); derive {self.name} again"
            raise MismatchError(message) from None
        if hashlib.sha256(content).hexdigest() != self.files[file]:
            raise MismatchError(
                f"{path}: the file has changed since it was generated (its SHA-256 differs from "
                f"manifest.json); derive {self.name} again"
            )
        return content
