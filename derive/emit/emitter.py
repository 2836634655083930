"""The interface of a language: its name, and the files that it writes for a derivation."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..derivation import Derivation
from ..program.programs import Programs

Files = Mapping[str, str]
"""Texts by their paths inside a robot's folder."""


@dataclass(frozen=True)
class Emitter:
    """A language.

    Attributes:
        language: Its name, under which the manifest lists its files.
        files: Function from a derivation and the programs of its functions to the files; the same
            derivation gives the same texts on any machine.
        prints_equations: Whether it prints the equations themselves and takes no programs: its
            files are written while the programs are made.
    """

    language: str
    files: Callable[[Derivation, Programs], Files]
    prints_equations: bool = False
