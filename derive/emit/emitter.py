"""What a language is to the compiler: a name, and the files that it writes of a derivation."""

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
        files: What it writes of a derivation and of the programs of its functions; the same texts
            for the same derivation, on any machine.
    """

    language: str
    files: Callable[[Derivation, Programs], Files]
