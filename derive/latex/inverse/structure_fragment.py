"""Describes the structure of a chain's joint axes as LaTeX."""

import re
from collections.abc import Iterable

from ...inverse.classify import Attempt, Classification
from ...inverse.explanation import NEVER, missed_by, nearest
from ...inverse.structure.words import listed as in_words
from ..setting.names import escape
from ..setting.page import Page

MAX_MISSED = 3
"""Maximum number of similar axis structures that are listed for an arm without a closed form."""


def missing_structure(classification: Classification) -> str:
    """List the most similar axis structures with a closed form, and the violated conditions."""
    rows = nearest(classification)[:MAX_MISSED]
    if not rows:
        return f"There is no closed form: {escape(classification.missing)}."
    opening = "There is no closed form. The nearest structures with a closed form are"
    items = [rf"\item {escape(title)}: {_lacking(missed)}" for title, missed in rows]
    return "\n".join([opening, r"\begin{itemize}", *items, r"\end{itemize}"])


def structure(page: Page, classification: Classification, found: Attempt) -> str:
    """Describe the axis structure of a chain, and the joints that are fixed."""
    conditions = "; ".join(requirement.text for requirement in found.requirements)
    nearly = "" if classification.method == "exact" else "nearly "
    sentences = _undetermined(page, classification, found)
    sentences.append(
        rf"The structure is {nearly}\emph{{{escape(found.title)}}}: {page.words(conditions)}."
    )
    if found.title.startswith("spherical wrist"):
        sentences.append("Pieper (1968) was the first to solve such arms.")
    added = [escape(axis.name) for axis in classification.lines.added]
    if added:
        sentences.append(
            f"The steps add a joint {in_words(added)} to the arm. Its angle is 0 in every solution."
            " The axis count includes this joint; its angle has the last index."
        )
    if found.backwards:
        sentences.append(
            "The steps solve the chain from the tool to the base: the tool is fixed, and the joints"
            " move the base."
        )
    if classification.method == "snapped":
        missed = _in_degrees(page.words(missed_by(classification)))
        sentences.append(
            f"The axes deviate slightly from this structure ({missed}). The solutions below"
            f" belong to a"
            " nominal arm with the exact structure; Newton's iteration refines them to the true"
            " arm."
        )
    return " ".join(sentences)


def _undetermined(page: Page, classification: Classification, found: Attempt) -> list[str]:
    names = [page.words(classification.lines.axes[k].name) for k in found.given]
    if not names:
        return []
    if len(names) == 1:
        return [
            f"A pose leaves one joint undetermined. The value of {names[0]} is a further input; if"
            " another joint is fixed, the steps differ."
        ]
    return [
        f"A pose leaves {len(names)} joints undetermined. The values of {in_words(names)} are"
        " further inputs; if other joints are fixed, the steps differ."
    ]


def _lacking(missed: Iterable[tuple[str, str]]) -> str:
    conditions = "; ".join(
        f"{text} ({off if off == NEVER else f'off by {off}'})" for text, off in missed
    )
    return f"it requires that {_in_degrees(escape(conditions))}."


def _in_degrees(words: str) -> str:
    return re.sub(r"(?<=\d) deg\b", r"$^\\circ$", words)
