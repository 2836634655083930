"""What all fragments share: a derivation, its equations, and matrices by name."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import sympy as sp

from ..derivation import Derivation
from . import transforms
from .layout import Display, matrix, matrix_width
from .names import frame
from .sharing import Equations, equations
from .widths import width


@dataclass(frozen=True)
class Page:
    """A derivation with everything that is printed of it.

    Attributes:
        derivation: The robot and its functions.
        equations: Forward kinematics and Jacobians in short symbols.
        links: The transforms between neighbouring frames in short symbols.
    """

    derivation: Derivation
    equations: Equations
    links: tuple[sp.ImmutableMatrix, ...]

    @classmethod
    def of(cls, derivation: Derivation) -> "Page":
        """The page of a derivation: once it stands, all short symbols are known."""
        found = equations(derivation)
        placements = transforms.placements(derivation.robot, found.notation.q)
        links = [transforms.matrix(placement, found.notation) for placement in placements]
        return cls(derivation, found, tuple(links))

    def tex(self, expression: sp.Expr) -> str:
        """An expression on one line."""
        return self.equations.printer.tex(expression)

    @property
    def pose(self) -> str:
        """The name of the tool's pose in the base frame."""
        robot = self.derivation.robot
        return transforms.transform(frame(robot.base_frame), frame(robot.tool_frame))

    def matrix(self, name: str, entries: sp.Matrix) -> Display:
        """An equation ``name = matrix``."""
        return named_matrix(name, [[self.tex(entry) for entry in row] for row in entries.tolist()])

    def column(self, name: str, entries: Iterable[sp.Expr]) -> Display:
        """An equation ``name = column vector``."""
        return named_matrix(name, [[self.tex(entry)] for entry in entries])


def named_matrix(name: str, rows: Sequence[Sequence[str]]) -> Display:
    """An equation ``name = matrix`` of entries in LaTeX."""
    return Display(f"{name} = {matrix(rows)}", width(f"{name} =") + matrix_width(rows))


def sentence(*blocks: str) -> str:
    """Words and displays that read on as one paragraph."""
    return "\n".join(block for block in blocks if block)


def text(*paragraphs: str) -> str:
    """A fragment: paragraphs with an empty line between."""
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph) + "\n"
