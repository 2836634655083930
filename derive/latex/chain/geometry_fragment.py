r"""The fragments that follow from the description alone: screw axes and link transforms."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import sympy as sp

from ...model.tolerances import FEW_PRINTED_DIGITS, PRINTED_DIGITS
from ..setting.layout import MARGIN, Display, aligned, broken, flowed, matrix_width
from ..setting.names import frame
from ..setting.page import Page, named_matrix, sentence, text
from ..setting.printer import cut
from ..setting.sharing import BRACKET
from ..setting.widths import LINE, width
from .printed_screws import printed_screws
from .tables import has_fixed
from .transforms import factors, labels, placements, transform

WIDEST = 0.4 * LINE
"""Widest entry of a constant matrix (pt): a wider number is a decimal, a wider sum gets a name."""
MOST_WRITTEN = 4
"""Factors of a product that are all written out."""


def screws(page: Page) -> str:
    """Screw axes and home pose: the robot as a product of exponentials."""
    robot = page.robot
    found = printed_screws(robot, page.equations.notation)
    values = robot.joint_values(page.equations.notation.q)
    notation = page.equations.notation
    plain = values == notation.q
    joint_values = [notation.tex[q] for q in notation.q]
    if not plain:
        letter = r"\vartheta" if notation.called else r"\theta"
        joint_values = [f"{letter}_{{{k}}}" for k in range(1, len(values) + 1)]
    home = rf"{{}}^{{{frame(robot.base_frame)}}}M_{{{frame(robot.tool_frame)}}}"
    exponentials = [
        rf"e^{{[\mathcal{{S}}_{{{k}}}] {value}}}" for k, value in enumerate(joint_values, 1)
    ]
    product = (page.pose, [rf"{_product(exponentials)}\,{home}"])
    followers = ""
    if not plain:
        pairs = zip(joint_values, values, strict=True)
        listed = [_equation(name, page.tex(value)) for name, value in pairs]
        followers = sentence("where the joints' values are", flowed(listed))
    index = "k" if has_fixed(robot) else "i"
    axes = rf"$\mathcal{{S}}_{{{index}}} = (v_{{{index}}}; \omega_{{{index}}})$"
    constants = _Constants(page)
    columns = [constants.screw(k + 1, found.S[:, k]) for k in range(found.S.shape[1])]
    pose = constants.pose(home, found.M)
    terms = [(page.tex(name), page.equations.printer.terms(e)) for name, e in found.definitions]
    return text(
        sentence(
            "As a product of exponentials, the pose of the tool is",
            aligned([product], end="." if plain else ","),
            followers,
            sentence("With the terms", aligned(terms, end=",")) if terms else "",
            rf"{'the' if terms else 'The'} screw axes {axes} in the base frame are",
            flowed(columns, end=""),
            "and the home pose is",
            flowed([pose], end="," if constants.named else "."),
            sentence("where", aligned(constants.named)) if constants.named else "",
        )
    )


def link_transforms(page: Page) -> str:
    """Each link's pose in the one before it, and their product."""
    robot, notation = page.robot, page.equations.notation
    frames = labels(robot)
    names = [transform(*pair) for pair in pairwise(frames)]
    displays = []
    for name, T, placement in zip(names, page.links, placements(robot, notation.q), strict=True):
        display = page.matrix(name, T)
        if display.width > LINE - MARGIN:
            display = broken(name, factors(placement, page.equations.printer))
        displays.append(display)
    same = f"where frame ${frame(robot.tool_frame)}$ is frame ${frames[-1]}$, and"
    return text(
        sentence(
            "The pose of the tool is the product of the link transforms,",
            aligned([(page.pose, [_product(names)])], end=","),
            "with" if robot.tool else f"{same} with",
            flowed(displays),
        )
    )


class _Constants:
    """Constant vectors and matrices; what is too wide for them gets a name.

    Attributes:
        named: The names, and the terms of what they stand for.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.named: list[tuple[str, list[str]]] = []

    def screw(self, number: int, entries: Iterable[sp.Expr]) -> Display:
        """A screw as a column."""
        names = [rf"{part}_{{{number},{axis}}}" for part in ("v", r"\omega") for axis in "xyz"]
        rows = [[self._entry(*pair, WIDEST)] for pair in zip(names, entries, strict=True)]
        return named_matrix(rf"\mathcal{{S}}_{{{number}}}", rows)

    def pose(self, name: str, M: sp.Matrix) -> Display:
        """A pose as a matrix."""
        exact = self.page.matrix(name, M)
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
        """An entry that fits, exact or as a decimal; else its name, to be explained."""
        exact = self.page.tex(entry)
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
        return self.page.equations.printer.terms(self._bracketed(entry))

    def _bracketed(self, entry: sp.Expr) -> sp.Expr:
        """A sum with the brackets in its terms named where they are too wide."""
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
        if width(self.page.tex(inner)) <= BRACKET:
            return inner
        sign = -1 if self.page.tex(inner).startswith("-") else 1
        return sign * self.page.equations.notation.named(sp.expand(sign * inner))


def _equation(side: str, value: str) -> Display:
    return Display(f"{side} = {value}", width(f"{side} = {value}"))


def _product(factors: Sequence[str]) -> str:
    if len(factors) <= MOST_WRITTEN:
        return r"\,".join(factors)
    return rf"{factors[0]}\,{factors[1]} \cdots {factors[-1]}"
