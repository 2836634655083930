r"""Prints the screw axes and the link transforms as LaTeX."""

from collections.abc import Sequence
from itertools import pairwise

import sympy as sp

from ..setting.layout import MARGIN, Display, aligned, broken, flowed
from ..setting.names import frame
from ..setting.page import Page, sentence, text
from ..setting.screw_displays import home_name
from ..setting.transforms import factors, labels, placements, transform
from ..setting.widths import LINE, width
from .tables import counts_moving

MAX_WRITTEN = 4
"""Maximum number of factors of a product that is printed without dots."""
MAX_IN_ROW = 6
"""Maximum number of identity transforms on one line of the LaTeX article."""


def screws(page: Page) -> str:
    """Print the screw axes and the home pose."""
    robot = page.robot
    values = robot.joint_values(page.equations.notation.q)
    notation = page.equations.notation
    plain = values == notation.q
    joint_values = [notation.tex[q] for q in notation.q]
    if not plain:
        letter = r"\vartheta" if notation.called else r"\theta"
        joint_values = [f"{letter}_{{{k}}}" for k in range(1, len(values) + 1)]
    home, shown = home_name(robot), page.screws
    exponentials = [
        rf"e^{{[\mathcal{{S}}_{{{k}}}] {value}}}" for k, value in enumerate(joint_values, 1)
    ]
    product = (page.pose, [rf"{_product(exponentials)}\,{home}"])
    followers = ""
    if not plain:
        pairs = zip(joint_values, values, strict=True)
        listed = [_equation(name, page.tex(value)) for name, value in pairs]
        followers = sentence("where the joint positions are", flowed(listed))
    index = "k" if counts_moving(robot) else "i"
    axes = rf"$\mathcal{{S}}_{{{index}}} = (v_{{{index}}}; \omega_{{{index}}})$"
    return text(
        sentence(
            "As a product of exponentials (Brockett 1984), the pose of the tool is",
            aligned([product], end="." if plain else ","),
            followers,
            sentence("With the terms", aligned(shown.terms, end=",")) if shown.terms else "",
            rf"{'the' if shown.terms else 'The'} screw axes {axes} in the base frame are",
            flowed(shown.columns, end=""),
            "and the home pose is",
            flowed([shown.home], end="," if shown.named else "."),
            sentence("where", aligned(shown.named)) if shown.named else "",
        )
    )


def link_transforms(page: Page) -> str:
    """Print the pose of each link relative to its parent link."""
    robot, notation = page.robot, page.equations.notation
    frames = labels(robot)
    names = [transform(*pair) for pair in pairwise(frames)]
    displays, alike = [], []
    for name, T, placement in zip(names, page.links, placements(robot, notation.q), strict=True):
        if sp.eye(4) == T:
            alike.append(name)
            continue
        display = page.matrix(name, T)
        if display.width > LINE - MARGIN:
            display = broken(name, factors(placement, page.equations.printer))
        displays.append(display)
    for k in range(0, len(alike), MAX_IN_ROW):
        side = " = ".join(alike[k : k + MAX_IN_ROW])
        displays.append(_equation(side, "I"))
    same = f"where frame ${frame(robot.tool_frame)}$ is frame ${frames[-1]}$, and"
    return text(
        sentence(
            "The pose of the tool is the product of the link transforms,",
            aligned([(page.pose, [_product(names)])], end=","),
            "with" if robot.tool else f"{same} with",
            flowed(displays),
        )
    )


def _equation(side: str, value: str) -> Display:
    return Display(f"{side} = {value}", width(f"{side} = {value}"))


def _product(factors: Sequence[str]) -> str:
    if len(factors) <= MAX_WRITTEN:
        return r"\,".join(factors)
    return rf"{factors[0]}\,{factors[1]} \cdots {factors[-1]}"
