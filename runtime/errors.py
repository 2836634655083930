"""The errors of chasles."""

from .contract.errors import (
    CacheError,
    ChaslesError,
    CompileError,
    CompilerNotFoundError,
    DerivationError,
    InputError,
    InputTypeError,
    InputValueError,
    LibraryMismatchError,
    ManifestError,
    MissingFunctionError,
    OutOfReachError,
    ShapeError,
    SingularityError,
    SourceMismatchError,
    UnknownRobotError,
)

__all__ = [
    "CacheError",
    "ChaslesError",
    "CompileError",
    "CompilerNotFoundError",
    "DerivationError",
    "InputError",
    "InputTypeError",
    "InputValueError",
    "LibraryMismatchError",
    "ManifestError",
    "MissingFunctionError",
    "OutOfReachError",
    "ShapeError",
    "SingularityError",
    "SourceMismatchError",
    "UnknownRobotError",
]
