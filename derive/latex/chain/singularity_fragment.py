r"""Prints the singular configurations of a chain."""

import math
from collections.abc import Sequence

import sympy as sp

from ...inverse.structure.words import listed as in_words
from ..setting.layout import aligned
from ..setting.page import Page, sentence, text
from ..setting.printed_singularities import PrintedCondition, PrintedSingularities
from ..setting.widths import LINE, width
from .tables import Column, tabular

WHOLE = 6
"""Number of joints of an arm with a square Jacobian."""
WIDEST = 0.8 * LINE
"""Maximum width (pt) of a determinant or condition that is printed on one line."""
PLACES = {"rad": 3, "m": 5}
"""Numbers of decimal places of printed angles (degree) and lengths (meter). Rounding errors are at
most 1e-5 rad or 1e-5 m."""


_REGULAR = "The Jacobian has full rank in every configuration: the robot has no singularity."


def singularities(page: Page) -> str:
    """Print the singular configurations of an arm.

    For an arm that is singular in every configuration, the text states the rank of the Jacobian.
    For an arm without singularities, the text states that the Jacobian has full rank.

    The returned text is empty if singular configurations may exist, but none is known.
    """
    found = page.singular
    if found.is_regular:
        return text(_REGULAR)
    if found.rank is not None:
        return text(sentence(_everywhere(page, found.rank)))
    if found.determinant and found.conditions:
        alone = len(found.conditions) == 1 and not found.conditions[0].words
        listed = "" if alone else _listed(page, found.conditions)
        special = _configurations(page, found) if found.configurations else ""
        return text(sentence(*_determinant(page, found), listed), special)
    if found.conditions:
        return text(sentence(_several(page), _listed(page, found.conditions)))
    return text(_configurations(page, found)) if found.configurations else ""


def _determinant(page: Page, found: PrintedSingularities) -> tuple[str, ...]:
    assert found.determinant is not None
    constant, factors = found.determinant
    opening = "The determinant of the Jacobian is, up to its sign,"
    free = len(page.robot.moving) - len(found.fixed)
    # A Jacobian with fewer than six columns becomes square only if its zero rows are deleted. Which
    # rows are zero depends on the axes and the reference point of the twist. The determinant of the
    # square Jacobian also depends on the reference point of the twist.
    rows = "in the axes of one of the links, at one of their origins and without its zero rows, "
    rows = "" if free == WHOLE else rows
    if found.fixed:
        names = in_words([f"${page.tex(symbol)}$" for symbol in found.fixed])
        opening = (
            f"With {names} fixed, as in the inverse, the Jacobian of the other joints has,"
            f" {rows}up to its sign, the determinant"
        )
    elif rows:
        opening = f"{rows[0].upper()}{rows[1:]}the Jacobian has, up to its sign, the determinant"
    product = sp.Mul(constant, *(factor**power for factor, power in factors))
    several = len(factors) > 1 or found.conditions[0].words
    who = "these joints are" if found.fixed else "the robot is"
    closing = f"and {who} singular if {'a factor is 0:' if several else 'it is 0.'}"
    if width(page.tex(product)) <= WIDEST:
        return opening, aligned([(r"\det J", [page.tex(product)])], end=","), closing
    powers = [rf"f_{{{k}}}" + (f"^{{{p}}}" if p > 1 else "") for k, (_, p) in _numbered(factors)]
    lead = [] if constant == 1 else [page.tex(constant)]
    terms = page.equations.printer.terms
    named = [(rf"f_{{{k}}}", terms(factor)) for k, (factor, _) in _numbered(factors)]
    return (
        opening,
        aligned([(r"\det J", [" ".join([*lead, *powers])])], end=","),
        "with",
        aligned(named, end=","),
        closing,
    )


def _numbered(
    factors: Sequence[tuple[sp.Expr, int]],
) -> list[tuple[int, tuple[sp.Expr, int]]]:
    return list(enumerate(factors, 1))


def _everywhere(page: Page, rank: int) -> str:
    return (
        f"The rank of the Jacobian is ${rank}$ at most, less than its {len(page.robot.moving)}"
        " columns: in every configuration, some joint rates do not move the tool."
    )


def _several(page: Page) -> str:
    count = len(page.robot.moving)
    if count < WHOLE:
        every = f"{count} rows of its Jacobian, in the axes of one of its links,"
    else:
        every = f"{WHOLE} of the {count} columns of its Jacobian"
    return f"The robot is singular if the determinants of every {every} are $0$, that is, if"


def _listed(page: Page, conditions: Sequence[PrintedCondition]) -> str:
    items = []
    for number, condition in enumerate(conditions, 1):
        tex = [page.tex(factor) for factor in condition.factors]
        shown = " and ".join(f"${one} = 0$" for one in tex)
        if len(tex) == 1 and width(tex[0]) > WIDEST:
            shown = f"$f_{{{number}}} = 0$"
        meaning = f": {condition.words}" if condition.words else ""
        items.append(rf"\item {shown}{meaning}.")
    return "\n".join(["\\begin{itemize}", *items, "\\end{itemize}"])


def _configurations(page: Page, found: PrintedSingularities) -> str:
    joints = page.robot.moving
    symbols = [f"${page.tex(symbol)}$" for symbol in page.equations.notation.q]
    columns: list[Column] = [("joint", symbols)]
    for number, q in enumerate(found.configurations, 1):
        cells = [_value(x, joint.unit) for x, joint in zip(q, joints, strict=True)]
        columns.append((str(number), cells))
    meters = " and displacements in meters" if any(j.unit == "m" for j in joints) else ""
    sought = r"$J^{\mathsf{T}} y = 0$ (a wrench $y$ that needs no joint torque or force)"
    if len(joints) < WHOLE:
        sought = "$J x = 0$ (joint rates $x$ that do not move the tool)"
    whose = "of six columns of the full Jacobian" if found.fixed else "of the Jacobian"
    return sentence(
        f"The determinants {whose} have no short factors. Newton's method for"
        f" {sought} found these singular configurations (angles in degrees{meters}):",
        tabular(columns, repeated=1),
    )


def _value(value: float, unit: str) -> str:
    shown = math.degrees(value) if unit == "rad" else value
    return f"${round(shown, PLACES[unit]) + 0.0:.{PLACES[unit]}f}$"
