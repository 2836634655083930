r"""Displays that stay on the page: aligned equations broken by terms, matrices in rows.

Everything works with amsmath alone and is meant for the text, not for inside a formula.
"""

from collections.abc import Iterable, Sequence

from .widths import LINE, width

Row = Sequence[str]
INDENT = width(r"\quad\quad")
"""What a continued line loses to the alignment and its indent."""
COLUMN_GAP = 10.2
BRACKETS = 12.0
MARGIN = 6.0
"""What an estimate may be short by."""


def aligned(equations: Iterable[tuple[str, Sequence[str]]], end: str = ".") -> str:
    """Equations below each other, each ``(left side, terms of the right side)``.

    Right sides that are too long go on below, a quad in; the list may break across pages.
    """
    listed = list(equations)
    left = max(width(side) for side, _ in listed) + width("=")
    blocks = []
    for k, (side, terms) in enumerate(listed):
        mark = end if k == len(listed) - 1 else ","
        first, *rest = filled(terms, LINE - left - MARGIN)
        lines = [f"{side} &= {first}", *(rf"&\quad {{}}{line}" for line in rest)]
        blocks.append(" \\\\\n".join(lines) + mark)
    body = " \\\\\n".join(blocks)
    return f"{{\\allowdisplaybreaks\n\\begin{{align*}}\n{body}\n\\end{{align*}}}}"


def filled(terms: Sequence[str], room: float) -> list[str]:
    """Signed terms in lines of a width; the lines after the first have an indent less."""
    lines: list[str] = []
    current, used, space = "", 0.0, room
    for term in terms:
        wide = width(term)
        if current and used + wide > space:
            lines.append(current)
            current, used, space = term, wide, room - INDENT
        else:
            current, used = f"{current} {term}".strip(), used + wide
    return [*lines, current]


def matrix(rows: Sequence[Row]) -> str:
    """A matrix in square brackets; it knows no limit of columns."""
    body = " \\\\\n".join(" & ".join(row) for row in rows)
    columns = "c" * len(rows[0])
    return f"\\left[\\begin{{array}}{{@{{}}{columns}@{{}}}}\n{body}\n\\end{{array}}\\right]"


def matrix_width(rows: Sequence[Row]) -> float:
    """Estimated width of :func:`matrix` (pt)."""
    columns = [max(width(entry) for entry in column) for column in zip(*rows, strict=True)]
    return sum(columns) + COLUMN_GAP * (len(columns) - 1) + BRACKETS


def flowed(displays: Sequence[tuple[str, float]], end: str = ".") -> str:
    """Displays of known width, as many beside each other as a line holds."""
    gap = width(r"\qquad")
    rows: list[list[str]] = []
    room = 0.0
    for tex, wide in displays:
        if rows and wide + gap + width(",") <= room:
            rows[-1].append(tex)
            room -= wide + gap + width(",")
        else:
            rows.append([tex])
            room = LINE - MARGIN - wide
    lines = [",\\qquad\n".join(row) for row in rows]
    body = ",\\\\[1.5ex]\n".join(lines)
    return f"{{\\allowdisplaybreaks\n\\begin{{gather*}}\n{body}{end}\n\\end{{gather*}}}}"
