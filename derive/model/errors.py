"""The exceptions that the compiler raises."""

from chasles.contract.errors import (
    ChaslesError,
    DerivationError,
    DescriptionError,
    InputTypeError,
    InputValueError,
    LoopError,
    NotInstalledError,
    UnknownRobotError,
)

__all__ = [
    "ChaslesError",
    "DerivationError",
    "DescriptionError",
    "InputTypeError",
    "InputValueError",
    "LoopError",
    "NotInstalledError",
    "UnknownRobotError",
]
