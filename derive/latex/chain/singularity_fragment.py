r"""The fragment of singular configurations: the determinant of the Jacobian, factor by factor."""

import sympy as sp

from ..setting.layout import aligned
from ..setting.page import Page, sentence, text

WHOLE = 6
"""Joints with which the whole Jacobian is square."""
MOST_ADDENDS = 8
"""Most terms of a factor that is shown."""


def singularities(page: Page) -> str:
    """The factored determinant and how the axes stand where a factor is 0; empty without one."""
    found = page.singular
    if found is None or not found.factors:
        return ""
    sizes = (len(sp.Add.make_args(factor.expression)) for factor in found.factors)
    if max(sizes) > MOST_ADDENDS:
        return ""
    shown = sp.Mul(found.constant, *(f.expression**f.power for f in found.factors))
    square = "" if len(page.robot.moving) == WHOLE else ", without the rows that are 0"
    items = []
    for factor in found.factors:
        meaning = f": {factor.words}" if factor.words else ""
        items.append(rf"\item ${page.tex(factor.expression)} = 0${meaning}.")
    listed = "\n".join(["\\begin{itemize}", *items, "\\end{itemize}"])
    return text(
        sentence(
            f"The determinant of the Jacobian{square} is, up to its sign,",
            aligned([(r"\det J", [page.tex(shown)])], end=","),
            "and the robot is singular where one of its factors is 0:",
            listed,
        )
    )
