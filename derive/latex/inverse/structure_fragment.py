r"""The structure of the axes in words, or the structures that they come nearest to."""

from collections.abc import Iterable

from ...inverse.classify import Attempt, Classification
from ...inverse.explanation import NEVER, nearest
from ...inverse.explanation import listed as in_words
from ..setting.names import escape

MOST_MISSED = 3
"""Structures that are named where none holds."""


def missing_structure(classification: Classification) -> str:
    """Which structures come near, and what they lack."""
    rows = nearest(classification)[:MOST_MISSED]
    if not rows:
        return f"There is no closed form: {escape(classification.missing)}."
    opening = "There is no closed form. Of the structures that have one, the nearest are"
    items = [rf"\item {escape(title)}: {_lacking(missed)}" for title, missed in rows]
    return "\n".join([opening, r"\begin{itemize}", *items, r"\end{itemize}"])


def structure(classification: Classification, found: Attempt) -> str:
    """What the axes are like."""
    conditions = "; ".join(requirement.text for requirement in found.requirements)
    sentences = [rf"The structure is \emph{{{escape(found.title)}}}: {escape(conditions)}."]
    names = [escape(classification.lines.axes[k].name) for k in found.given]
    if names:
        more = "one joint more" if len(names) == 1 else f"{len(names)} joints more"
        verb = "is" if len(names) == 1 else "are"
        sentences.append(
            f"There {verb} {more} than a pose determines: {in_words(names)} {verb} given."
        )
    if found.backwards:
        sentences.append(
            "The chain is read from the tool, which is held: it has to bring the base to its place."
        )
    if classification.tier == "snapped":
        sentences.append(
            "The axes lie so but for small errors; the solutions of the arm without these start"
            " an iteration on the true one."
        )
    return " ".join(sentences)


def _lacking(missed: Iterable[tuple[str, str]]) -> str:
    conditions = "; ".join(
        f"{what} ({off if off == NEVER else f'off by {off}'})" for what, off in missed
    )
    return f"it asks that {escape(conditions)}."
