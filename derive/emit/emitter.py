"""Defines the interface of an output language: its name, and its files for a derivation."""

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
        language: The name of the language, under which the manifest lists its files.
        files: Returns the files of the language for a derivation and its programs. The same
            derivation gives the same texts on any machine.
        prints_equations: Whether the language prints equations, so that it does not need the typed
            programs. The files of a language that prints equations are written while the programs
            are built.
    """

    language: str
    files: Callable[[Derivation, Programs], Files]
    prints_equations: bool = False
