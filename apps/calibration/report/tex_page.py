"""Calibration report as a LaTeX file, with plots in PDF files."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chasles.contract import write_files

from .contents import Contents, Table, contents
from .page import BLOCKS, split
from .plots import plot_parameters, plot_residuals

if TYPE_CHECKING:
    from chasles.calibration import Calibration

_SPECIAL = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_SPECIAL |= {mark: f"\\{mark}" for mark in "&%$#_{}"} | {"±": r"$\pm$", "‰": r"\textperthousand{}"}
_PREAMBLE = r"""\documentclass[9pt,a4paper]{extarticle}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{lmodern,textcomp}
\usepackage[margin=15mm]{geometry}
\usepackage{booktabs,graphicx}
\setlength{\parindent}{0pt}
\pagestyle{empty}
"""


def write_tex(found: Calibration, path: Path) -> None:
    """Write a one-page LaTeX report.

    Its plots are PDF files with the report's name as prefix.
    """
    plots = {
        path.with_name(f"{path.stem}_residuals.pdf"): _pdf(plot_residuals(found).figure),
        path.with_name(f"{path.stem}_parameters.pdf"): _pdf(plot_parameters(found).figure),
    }
    page = _page(contents(found), [plot.name for plot in plots])
    write_files({**plots, path: page.encode()})


def _pdf(figure: Any) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="pdf", metadata={"CreationDate": None})
    return stream.getvalue()


def _page(said: Contents, names: Sequence[str]) -> str:
    parts = [
        _PREAMBLE + r"\begin{document}",
        rf"{{\large\bfseries {_tex(said.title)}}}\par\medskip",
        " ".join(_tex(sentence) for sentence in said.summary) + r"\par\medskip",
        r"\hfill".join(rf"\includegraphics[width=80mm]{{{name}}}" for name in names) + r"\par",
        r"\par\medskip ".join(_table(table) for table in said.tables),
        r"\par\medskip " + r"\par ".join(_tex(note) for note in said.notes),
        r"\par\medskip " + r"\hfill ".join(_block(part) for part in split(said.parameters, BLOCKS)),
        r"\end{document}",
    ]
    return "\n".join(parts) + "\n"


def _table(table: Table) -> str:
    return rf"{{\scriptsize\begin{{tabular}}[t]{{@{{}}{_lines(table)}\end{{tabular}}}}\quad"


def _block(table: Table) -> str:
    """Return the LaTeX text of a block of the parameter table, with a fixed width."""
    width = r"\begin{tabular*}{0.48\linewidth}[t]{@{\extracolsep{\fill}}"
    return rf"{{\scriptsize{width}{_lines(table)}\end{{tabular*}}}}"


def _lines(table: Table) -> str:
    """Return the column specification and the rows of a LaTeX table."""
    columns = "l" + "r" * (len(table.heading) - 1)
    rows = [" & ".join(map(_tex, row)) + r" \\" for row in table.rows]
    head = " & ".join(map(_tex, table.heading)) + r" \\"
    lines = "\n".join([r"\toprule", head, r"\midrule", *rows, r"\bottomrule"])
    return rf"{columns}@{{}}}}{lines}"


def _tex(text: str) -> str:
    return "".join(_SPECIAL.get(mark, mark) for mark in text)
