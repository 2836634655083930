"""What all fragments share: a chain, its equations, and matrices by name."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from ...derivation import Derivation
from ...inverse.families import FAMILIES
from ...inverse.families.family import Family
from ...inverse.serial_inverse import Inverses, inverses
from ...model.robot import Robot
from ..chain import transforms
from .layout import Display, matrix, matrix_width
from .names import frame
from .sharing import Equations, equations
from .widths import width


@dataclass(frozen=True)
class Page:
    """A serial chain with everything that is printed of it.

    Attributes:
        robot: The chain.
        equations: Forward kinematics and Jacobians in short symbols.
        links: The transforms between neighbouring frames in short symbols.
        derived: The inverse, where it was derived over the terms of the equations.
        coordinates: How many coordinates move it, where it is the main chain of a robot with loops.
        families: The families of inverses that are tried on it.
    """

    robot: Robot
    equations: Equations
    links: tuple[sp.ImmutableMatrix, ...]
    derived: Inverses | None = None
    coordinates: int | None = None
    families: tuple[Family, ...] = FAMILIES

    @classmethod
    def of(
        cls,
        derivation: Derivation,
        called: Sequence[str] = (),
        coordinates: int | None = None,
    ) -> "Page":
        """The page of a serial robot: once it stands, all short symbols are known."""
        robot = derivation.robot
        assert isinstance(robot, Robot)
        found = equations(derivation, called)
        placements = transforms.placements(robot, found.notation.q)
        links = [transforms.matrix(placement, found.notation) for placement in placements]
        derived = derivation.inverse if derivation.terms is found.notation.terms else None
        return cls(robot, found, tuple(links), derived, coordinates, derivation.families)

    @cached_property
    def inverse(self) -> Inverses:
        """All that is known of the inverse, in the terms of the equations."""
        terms = self.equations.notation.terms
        return self.derived or inverses(self.robot, terms, self.coordinates, self.families)

    def tex(self, expression: sp.Expr) -> str:
        """An expression on one line."""
        return self.equations.printer.tex(expression)

    @property
    def pose(self) -> str:
        """The name of the tool's pose in the base frame."""
        frames = self.robot.base_frame, self.robot.tool_frame
        return transforms.transform(*map(frame, frames))

    def matrix(self, name: str, entries: sp.Matrix) -> Display:
        """An equation ``name = matrix``."""
        return named_matrix(name, [[self.tex(entry) for entry in row] for row in entries.tolist()])

    def column(self, name: str, entries: Iterable[sp.Expr]) -> Display:
        """An equation ``name = column vector``."""
        return named_matrix(name, [[self.tex(entry)] for entry in entries])


def named_matrix(name: str, rows: Sequence[Sequence[str]]) -> Display:
    """An equation ``name = matrix`` of entries in LaTeX."""
    return Display(f"{name} = {matrix(rows)}", width(f"{name} =") + matrix_width(rows))


def listed(formulas: Iterable[str]) -> str:
    """Formulas in a sentence that may be broken between any two."""
    return ", ".join(f"${tex}$" for tex in formulas)


def sentence(*blocks: str) -> str:
    """Words and displays that read on as one paragraph."""
    return "\n".join(block for block in blocks if block)


def text(*paragraphs: str) -> str:
    """A fragment: paragraphs with an empty line between."""
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph) + "\n"
