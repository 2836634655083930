"""Calibration report as one self-contained HTML file with SVG plots."""

from __future__ import annotations

import html
import io
from typing import TYPE_CHECKING, Any

import matplotlib

from .contents import Table, contents
from .plots import plot_parameters, plot_residuals

if TYPE_CHECKING:
    from chasles.calibration import Calibration

_STYLE = """
@page { size: A4; margin: 12mm }
body { font: 9pt/1.3 sans-serif; color: #000; margin: 1.2em auto; max-width: 58em; }
h1 { font-size: 14pt; margin: 0 0 .4em } h2 { font-size: 11pt; margin: .9em 0 .2em }
p { margin: .2em 0 } table { border-collapse: collapse; font-size: 7pt }
th, td { padding: .02em .5em; text-align: right; white-space: nowrap }
th { border-bottom: 1px solid #000; font-weight: normal } th:first-child, td:first-child
{ text-align: left } .plots { display: flex; flex-wrap: wrap; gap: 1cm }
.plots svg { width: 8cm; height: auto } .two { display: flex; flex-wrap: wrap; gap: 0 2em }
.blocks { display: grid; grid-template-columns: 1fr 1fr; gap: 0 2em; align-items: start }
.blocks table { table-layout: fixed; width: 100% } .blocks th:first-child { width: 40% }
"""
BLOCKS = 2
"""Number of blocks into which the parameter table is split. The blocks of the parameter table are
shown side by side."""


def html_page(found: Calibration) -> str:
    """Return the one-page calibration report as HTML, including its plots."""
    said = contents(found)
    parts = [
        f"<h1>{html.escape(said.title)}</h1>",
        *(f"<p>{html.escape(sentence)}</p>" for sentence in said.summary),
        f'<div class="plots">{_svg(plot_residuals(found))}{_svg(plot_parameters(found))}</div>',
        '<div class="two">',
        *(f"<div>{_heading(table)}{_table(table)}</div>" for table in said.tables),
        "</div>",
        *(f"<p>{html.escape(note)}</p>" for note in said.notes),
        _heading(said.parameters),
        '<div class="blocks">',
        *(_table(part) for part in split(said.parameters, BLOCKS)),
        "</div>",
    ]
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"/>'
        f"<title>{html.escape(said.title)}</title><style>{_STYLE}</style></head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n"
    )


def split(table: Table, count: int) -> list[Table]:
    """Split a table into at most `count` blocks of rows."""
    size = -(-len(table.rows) // count)
    starts = range(0, len(table.rows), size)
    return [Table(table.title, table.heading, table.rows[k : k + size]) for k in starts]


def _heading(table: Table) -> str:
    return f"<h2>{html.escape(table.title)}</h2>"


def _table(table: Table) -> str:
    rows = [f"<tr>{''.join(f'<td>{html.escape(c)}</td>' for c in row)}</tr>" for row in table.rows]
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in table.heading)
    return f"<table><tr>{head}</tr>{''.join(rows)}</table>"


def _svg(ax: Any) -> str:
    stream = io.StringIO()
    # The HTML page is reproducible, because it contains no date and the salt of the SVG identifiers
    # is fixed.
    with matplotlib.rc_context({"svg.hashsalt": "chasles"}):
        ax.figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    return text[text.index("<svg") :]
