r"""Formats equations and matrices in LaTeX so that they fit the width of the page.

The formatted equations need only the LaTeX package amsmath. The formatted equations must be placed
in LaTeX text, not inside a formula.
"""

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

from .widths import LINE, width

Row = Sequence[str]
Equation = tuple[str, Sequence[str]]
"""Left-hand side of an equation and signed terms of its right-hand side."""


class Display(NamedTuple):
    """A formula and its estimated width (pt)."""

    tex: str
    width: float


INDENT = width(r"\quad\quad")
"""Indentation (pt) of all lines of an equation after its first line."""
COLUMN_GAP = 10.2
BRACKETS = 15.0
MARGIN = 6.0
"""Maximum error of an estimated width (pt)."""
BREAKS = r"\allowdisplaybreaks"
NO_BREAK = r"\interdisplaylinepenalty=10000\postdisplaypenalty=10000"
"""LaTeX commands that keep a displayed equation and the text after it on the same page."""
SHORTEST_RUN = 4
"""Minimum number of consecutive short equations that are set in two columns."""


def aligned(equations: Sequence[Equation], end: str = ".") -> str:
    """Print aligned equations.

    Consecutive short equations are set in two columns.

    A long right-hand side continues on an indented line. The list of equations may break across
    pages.
    """
    runs = _runs(equations)
    displays = []
    for k, (paired, run) in enumerate(runs):
        goes_on = k < len(runs) - 1
        last = "," if goes_on else end
        body = _pairs(run, last) if paired else _single(run, last)
        above = r"\setlength{\abovedisplayskip}{0pt}" if k else ""
        below = r"\setlength{\belowdisplayskip}{0pt}" if goes_on else ""
        breaks = NO_BREAK if goes_on and len(run) == 1 else BREAKS
        displays.append(_display("align*", body, breaks + above + below))
    return "\n".join(displays)


def read_down(equations: Sequence[Equation]) -> list[Equation]:
    """Reorder equations so that a display with two columns is read column by column."""
    if not all(_is_short(equation) for equation in equations):
        return list(equations)
    half = -(-len(equations) // 2)
    order = [k + side * half for k in range(half) for side in (0, 1)]
    return [equations[k] for k in order if k < len(equations)]


def _runs(equations: Sequence[Equation]) -> list[tuple[bool, list[Equation]]]:
    runs: list[tuple[bool, list[Equation]]] = []
    for short, group in groupby(equations, key=_is_short):
        run = list(group)
        paired = short and len(run) >= SHORTEST_RUN
        if runs and not paired and not runs[-1][0]:
            runs[-1][1].extend(run)
        else:
            runs.append((paired, run))
    return runs


def _is_short(equation: Equation) -> bool:
    side, terms = equation
    return width(f"{side} = {' '.join(terms)},") < LINE / 2 - 2 * MARGIN


def _pairs(equations: Sequence[Equation], end: str) -> str:
    shown = [f"{side} &= {' '.join(terms)}" for side, terms in equations]
    rows = [", & ".join(shown[k : k + 2]) for k in range(0, len(shown), 2)]
    return _stacked(rows, ", ", "") + end


def _single(equations: Sequence[Equation], end: str) -> str:
    left = max(width(side) for side, _ in equations) + width("=")
    blocks = []
    for side, terms in equations:
        first, *rest = filled(terms, LINE - left - MARGIN)
        lines = [f"{side} &= {first}", *(rf"&\quad {{}}{line}" for line in rest)]
        blocks.append(" \\\\\n".join(lines))
    return _stacked(blocks, ", ", "") + end


def _display(environment: str, body: str, settings: str = BREAKS) -> str:
    begin, finish = f"\\begin{{{environment}}}", f"\\end{{{environment}}}"
    return f"{{{settings}\n{begin}\n{body}\n{finish}}}%"


def filled(terms: Sequence[str], room: float) -> list[str]:
    """Break signed terms into lines of limited width."""
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
    """Format a matrix in square brackets."""
    high = any("frac" in entry for row in rows for entry in row)
    newline = " \\\\[0.5ex]\n" if high else " \\\\\n"
    body = newline.join(" & ".join(row) for row in rows)
    columns = "c" * len(rows[0])
    return f"\\left[\\begin{{array}}{{@{{}}{columns}@{{}}}}\n{body}\n\\end{{array}}\\right]"


def matrix_width(rows: Sequence[Row]) -> float:
    """Estimate the width (pt) of a formatted matrix."""
    columns = [max(width(entry) for entry in column) for column in zip(*rows, strict=True)]
    return sum(columns) + COLUMN_GAP * (len(columns) - 1) + BRACKETS


def named_matrix(name: str, rows: Sequence[Sequence[str]]) -> Display:
    """Format an equation ``name = matrix`` from LaTeX entries."""
    return Display(f"{name} = {matrix(rows)}", width(f"{name} =") + matrix_width(rows))


def flowed(displays: Sequence[Display], end: str = ".", *, kept: bool = False) -> str:
    """Print displayed equations side by side.

    If ``kept`` is True, the text after the equations stays on the same page.
    """
    gap = width(r",\qquad")
    rows: list[list[str]] = []
    room = 0.0
    for display in displays:
        if rows and gap + display.width <= room:
            rows[-1].append(display.tex)
            room -= gap + display.width
        else:
            rows.append([display.tex])
            room = LINE - MARGIN - display.width
    lines = [",\\qquad\n".join(row) for row in rows]
    return _display("gather*", _stacked(lines, ",", "[1ex]") + end, NO_BREAK if kept else BREAKS)


def _stacked(rows: Sequence[str], end: str, skip: str) -> str:
    body = rows[0]
    for k, row in enumerate(rows[1:], 1):
        star = "*" if k in (1, len(rows) - 1) else ""
        body += f"{end}\\\\{star}{skip}\n{row}"
    return body


def chain(name: str, sides: Sequence[str], end: str = ".") -> str:
    """Format an equation with several right-hand sides, one per line."""
    body = " \\\\*[1ex]\n&= ".join(sides)
    return _display("align*", f"{name} &= {body}{end}")


def broken(name: str, factors: Sequence[str]) -> Display:
    """Format an equation ``name = product`` on one or more lines."""
    first, *rest = filled(factors, LINE - MARGIN - width(f"{name} ="))
    lines = [f"{name} &= {first}", *(rf"&\quad {line}" for line in rest)]
    body = " \\\\\n".join(lines)
    wide = width(f"{name} =") + (width(first) if not rest else LINE)
    return Display(f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}", wide)
