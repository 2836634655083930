"""Collects everything that a LaTeX article prints about a serial chain."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import sympy as sp

from ...derivation import Derivation
from ...inverse.serial_inverse import METHODS, Inverses, Method, inverses
from ...model.geometry import Geometry
from ...model.robot import SerialRobot
from . import transforms
from .layout import Display, named_matrix
from .names import escape, frame, in_words, own_symbols
from .printed_singularities import PrintedSingularities, printed_singularities
from .screw_displays import ScrewDisplays, screw_displays
from .sharing import PrintedEquations, equations

__all__ = ["Page", "listed", "named_matrix", "sentence", "text"]


@dataclass(frozen=True)
class Page:
    """A serial chain and the data of its LaTeX article.

    This class creates all printed expressions in a fixed order.

    Attributes:
        robot: The chain.
        equations: Forward kinematics and Jacobians, printed with short symbols.
        links: Transforms between adjacent frames, printed with short symbols.
        screws: Screw axes and home pose, printed with short symbols.
        inverse: The inverse kinematics functions, printed with the same named terms as the forward
            kinematics and Jacobians.
        singular: The singular configurations, printed with short symbols.
        geometry: The robot's parametric functions, or None if they were not derived.
    """

    robot: SerialRobot
    equations: PrintedEquations
    links: tuple[sp.ImmutableMatrix, ...]
    screws: ScrewDisplays
    inverse: Inverses
    singular: PrintedSingularities
    geometry: Geometry | None = None

    @classmethod
    def of(
        cls,
        derivation: Derivation,
        called: Sequence[str] = (),
        coordinates: int | None = None,
        methods: Sequence[Method] = METHODS,
        reserved: Collection[str] = (),
    ) -> "Page":
        """Collect the printed expressions of a serial robot.

        Args:
            derivation: Derivation of a serial robot's functions.
            called: LaTeX symbols of the coordinates. By default, the symbols are the joint names if
                all names are suitable, otherwise q_1, q_2, ...
            coordinates: Number of coordinates that move the main chain of a robot with loops.
            methods: Solution methods for the inverse kinematics that the LaTeX article may show.
            reserved: Letters that have another meaning in the LaTeX article, so that no short
                symbol may use them.
        """
        robot = derivation.robot
        assert isinstance(robot, SerialRobot)
        found = equations(derivation, called or own_symbols(robot), reserved)
        placements = transforms.placements(robot, found.notation.q)
        links = [transforms.matrix(placement, found.notation) for placement in placements]
        screws = screw_displays(robot, found)
        terms = found.notation.terms
        derived = derivation.inverse if derivation.terms is terms else None
        inverse = derived or inverses(
            robot, terms, coordinates, derivation.families, methods=methods
        )
        geometry = derivation.geometry if isinstance(derivation.geometry, Geometry) else None
        given = inverse.solved["ik"].function.role.fixed if "ik" in inverse.solved else ()
        singular = printed_singularities(robot, found.notation, given)
        return cls(robot, found, tuple(links), screws, inverse, singular, geometry)

    def tex(self, expression: sp.Expr) -> str:
        """Format an expression as LaTeX on one line."""
        return self.equations.printer.tex(expression)

    def words(self, text: str) -> str:
        """Format a sentence in LaTeX, with symbols instead of joint names where possible."""
        notation = self.equations.notation
        if not notation.called:
            return escape(text)
        joints = zip(self.robot.coordinates, notation.q, strict=True)
        return in_words(text, {joint.name: notation.tex[q] for joint, q in joints})

    @property
    def pose(self) -> str:
        """Return the LaTeX symbol of the tool pose in the base frame."""
        frames = self.robot.base_frame, self.robot.tool_frame
        return transforms.transform(*map(frame, frames))

    def matrix(self, name: str, entries: sp.Matrix) -> Display:
        """Format an equation with a matrix on the right-hand side."""
        return named_matrix(name, [[self.tex(entry) for entry in row] for row in entries.tolist()])

    def column(self, name: str, entries: Iterable[sp.Expr]) -> Display:
        """Format an equation with a column vector on the right-hand side."""
        return named_matrix(name, [[self.tex(entry)] for entry in entries])


def listed(formulas: Iterable[str]) -> str:
    """Join formulas with commas, for use in a sentence.

    LaTeX may break lines between these formulas.
    """
    return ", ".join(f"${tex}$" for tex in formulas)


def sentence(*blocks: str) -> str:
    """Join texts and displayed equations into a single paragraph."""
    return "\n".join(block for block in blocks if block)


def text(*paragraphs: str) -> str:
    """Join paragraphs into a fragment of a LaTeX article."""
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph) + "\n"
