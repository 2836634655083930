r"""Sets displays of screw axes and home pose with exact, decimal or named entries."""

from collections.abc import Iterable
from dataclasses import dataclass

import sympy as sp

from ...model.robot import SerialRobot
from ...model.tolerances import FEW_PRINTED_DIGITS, PRINTED_DIGITS
from .layout import MARGIN, Display, Equation, matrix_width, named_matrix
from .names import frame
from .printed_screws import printed_screws
from .printer import cut
from .sharing import BRACKET, PrintedEquations
from .widths import LINE, width

WIDEST = 0.4 * LINE
"""Maximum width (pt) of a constant entry: wider numbers become decimals, wider sums get a name."""


@dataclass(frozen=True)
class ScrewDisplays:
    """The product of exponentials of a robot, ready for typesetting.

    Attributes:
        terms: Shared terms of the entries, each in terms of earlier ones.
        columns: One display for each screw axis.
        home: The home pose.
        named: Named entries that are too wide to be printed inside the home pose or an axis.
    """

    terms: tuple[Equation, ...]
    columns: tuple[Display, ...]
    home: Display
    named: tuple[Equation, ...]


def screw_displays(robot: SerialRobot, equations: PrintedEquations) -> ScrewDisplays:
    """Returns screw axes and home pose of a robot in the short symbols of its equations."""
    found = printed_screws(robot, equations.notation)
    constants = _Constants(equations)
    columns = tuple(constants.screw(k + 1, found.S[:, k]) for k in range(found.S.shape[1]))
    home = constants.pose(home_name(robot), found.M)
    printer = equations.printer
    terms = tuple((printer.tex(name), printer.terms(value)) for name, value in found.definitions)
    return ScrewDisplays(terms, columns, home, tuple(constants.named))


def home_name(robot: SerialRobot) -> str:
    """Returns the name of the tool's home pose in the base frame."""
    return rf"{{}}^{{{frame(robot.base_frame)}}}M_{{{frame(robot.tool_frame)}}}"


class _Constants:
    """Sets constant vectors and matrices; too wide entries get a name.

    Attributes:
        named: The names with the terms of their entries.
    """

    def __init__(self, equations: PrintedEquations) -> None:
        self.notation, self.printer = equations.notation, equations.printer
        self.named: list[Equation] = []

    def screw(self, number: int, entries: Iterable[sp.Expr]) -> Display:
        """Formats a screw as a column."""
        names = [rf"{part}_{{{number},{axis}}}" for part in ("v", r"\omega") for axis in "xyz"]
        rows = [[self._entry(*pair, WIDEST)] for pair in zip(names, entries, strict=True)]
        return named_matrix(rf"\mathcal{{S}}_{{{number}}}", rows)

    def pose(self, name: str, M: sp.Matrix) -> Display:
        """Formats a pose as a matrix."""
        exact = named_matrix(name, [[self.printer.tex(e) for e in row] for row in M.tolist()])
        if exact.width <= LINE - MARGIN:
            return exact
        used = width(f"{name} =") + matrix_width([[""] * M.shape[1]])
        room = (LINE - 2 * MARGIN - used) / M.shape[1]
        rows = [
            [self._entry(f"M_{{{i}{j}}}", entry, room) for j, entry in enumerate(row, 1)]
            for i, row in enumerate(M.tolist(), 1)
        ]
        return named_matrix(name, rows)

    def _entry(self, name: str, entry: sp.Expr, room: float) -> str:
        """Returns an entry that fits the available width, exact or decimal, else its name."""
        exact = self.printer.tex(entry)
        if width(exact) <= room:
            return exact
        if not entry.is_number:
            self.named.append((name, self._terms(entry)))
            return name
        for decimal in (cut(entry, digits) for digits in (PRINTED_DIGITS, FEW_PRINTED_DIGITS)):
            if width(decimal) <= room:
                return decimal
        self.named.append((name, [cut(entry, PRINTED_DIGITS)]))
        return name

    def _terms(self, entry: sp.Expr) -> list[str]:
        return self.printer.terms(self._bracketed(entry))

    def _bracketed(self, entry: sp.Expr) -> sp.Expr:
        """Returns a sum with names for brackets that are too wide."""
        addends = []
        for addend in sp.Add.make_args(entry):
            factors = [
                self._bracket(factor) if factor.is_Add else factor
                for factor in sp.Mul.make_args(addend)
            ]
            addends.append(sp.Mul(*factors))
        return sp.Add(*addends)

    def _bracket(self, factor: sp.Expr) -> sp.Expr:
        inner = self._bracketed(factor)
        if width(self.printer.tex(inner)) <= BRACKET:
            return inner
        sign = -1 if self.printer.tex(inner).startswith("-") else 1
        return sign * self.notation.named(sp.expand(sign * inner))
