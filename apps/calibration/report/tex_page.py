"""The report as LaTeX, with its plots as PDF files beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..result import Calibration
from .contents import Table, contents
from .page import split
from .plots import parameter_plot, residual_plot

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


def tex_page(
    found: Calibration, file: str | Path, held_back: Mapping[str, float] | None = None
) -> None:
    """Writes a report of one page, and its plots beside it.

    Args:
        found: A calibration.
        file: The LaTeX file to write; plots are called like it.
        held_back: Median error of models on held-back configurations [m].
    """
    path, said = Path(file), contents(found, held_back)
    names = []
    for plot in (residual_plot, parameter_plot):
        names.append(f"{path.stem}_{plot.__name__}.pdf")
        plot(found).savefig(path.with_name(names[-1]), metadata={"CreationDate": None})
    parts = [
        _PREAMBLE + r"\begin{document}",
        rf"{{\large\bfseries {_tex(said.title)}}}\par\medskip",
        " ".join(_tex(sentence) for sentence in said.summary) + r"\par\medskip",
        r"\hfill".join(rf"\includegraphics[width=80mm]{{{name}}}" for name in names) + r"\par",
        r"\par\medskip ".join(_table(table) for table in said.tables),
        r"\par\medskip " + r"\par ".join(_tex(note) for note in said.notes),
        r"\par\medskip " + r"\hfill ".join(_table(part) for part in split(said.parameters, 2)),
        r"\end{document}",
    ]
    path.write_text("\n".join(parts) + "\n", encoding="utf-8")


def _table(table: Table) -> str:
    columns = "l" + "r" * (len(table.heading) - 1)
    rows = [" & ".join(map(_tex, row)) + r" \\" for row in table.rows]
    head = " & ".join(map(_tex, table.heading)) + r" \\"
    lines = "\n".join([r"\toprule", head, r"\midrule", *rows, r"\bottomrule"])
    return rf"{{\scriptsize\begin{{tabular}}[t]{{@{{}}{columns}@{{}}}}{lines}\end{{tabular}}}}\quad"


def _tex(text: str) -> str:
    return "".join(_SPECIAL.get(mark, mark) for mark in text)
