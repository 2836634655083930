"""Defines the interface of an output language."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..derivation import Derivation
from ..program.programs import Programs

Files = Mapping[str, str]
"""The texts of the generated files, keyed by path inside the robot's folder."""


@dataclass(frozen=True)
class Emitter:
    """An output language.

    Attributes:
        language: The name of the language in the manifest.
        files: Function that returns the generated files of a robot, with the same texts on every
            machine.
        prints_equations: Whether the generated files contain equations (a LaTeX article) instead of
            program code.
    """

    language: str
    files: Callable[[Derivation, Programs], Files]
    prints_equations: bool = False
