"""Selects a letter for each kind of symbol of an inverse, unique in the article."""

from collections.abc import Collection, Sequence

from ...model.robot import SerialRobot
from ..setting import names
from ..setting.notation import Notation

KINDS = {
    "A": ("A", r"\mathcal{A}", r"\mathrm{A}"),
    "B": ("B", r"\mathcal{B}", r"\mathrm{B}"),
    "C": ("C", r"\mathcal{C}", r"\mathrm{C}"),
    "sigma": (r"\sigma", r"\varsigma", r"\epsilon"),
    "sum": (r"\theta", r"\chi", r"\vartheta"),
    "side": (r"\varepsilon", r"\eta", r"\iota"),
    "slide": (r"\xi", r"\zeta", r"\Xi"),
}
"""Letters of coefficients, signs, sums, pose sides and prismatic joints, by preference."""


class InverseLetters:
    """The letters for one robot."""

    def __init__(self, robot: SerialRobot, notation: Notation) -> None:
        """Collects the used letters: parameters, coordinates and short symbols."""
        parameters = names.distinct(parameter.name for parameter in robot.parameters)
        heads = map(names.head, (*parameters.values(), *notation.called))
        self.taken: Collection[str] = {*heads, *notation.letters.values()}

    def of(self, kind: str) -> str:
        """Returns the letter of a kind of symbol."""
        return self.free(KINDS[kind])

    def free(self, options: Sequence[str]) -> str:
        """Returns the first free letter; if all are used, the last letter, upright if Latin."""
        free = [letter for letter in options if letter not in self.taken]
        if free:
            return free[0]
        return options[-1] if options[-1].startswith("\\") else rf"\mathrm{{{options[-1]}}}"
