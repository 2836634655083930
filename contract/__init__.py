"""The manifest of a generated robot: plain dataclasses with a reader and a writer."""

from .bodies import Body, BodyJoint, HeldFrames, PlacedTip, Shape, SkeletonFacts, Span
from .errors import ChaslesError, ManifestError, MismatchError, UnknownRobotError
from .extras import requires
from .input_files import MAX_TABLE, as_path, open_input, read_input
from .manifest import (
    FORMAT,
    SUPPORT,
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
from .output_files import make_folder, output_file, write_files
from .reading import manifest_entries, read_manifest
from .roles import KINDS, ROLES, TASK_COMPONENTS, VECTORS, Role, TaskComponent
from .temporary_folders import temporary_folder

__all__ = [
    "FORMAT",
    "KINDS",
    "MAX_TABLE",
    "ROLES",
    "SUPPORT",
    "TASK_COMPONENTS",
    "VECTORS",
    "ActuatedVariable",
    "Argument",
    "Body",
    "BodyJoint",
    "ChaslesError",
    "CleanedNumber",
    "Cleaning",
    "ContractTolerances",
    "Coordinate",
    "Frames",
    "FunctionInfo",
    "GeometryParameter",
    "HeldFrames",
    "InverseFacts",
    "LoopFacts",
    "Manifest",
    "ManifestError",
    "MismatchError",
    "Parameter",
    "PlacedTip",
    "Reference",
    "Role",
    "Shape",
    "SkeletonFacts",
    "Span",
    "TaskComponent",
    "UnknownRobotError",
    "Variable",
    "as_path",
    "make_folder",
    "manifest_entries",
    "open_input",
    "output_file",
    "read_input",
    "read_manifest",
    "requires",
    "temporary_folder",
    "write_files",
]
