r"""The article of a robot, and the fragments that it reads in."""

from collections.abc import Callable, Mapping

from ..derivation import Derivation
from .functions import forward_kinematics, jacobians
from .geometry import link_transforms, screws
from .given import parameters, symbols
from .names import escape
from .page import Page

FOLDER = "latex"
"""The folder beside a document that its fragments are read from."""
_FRAGMENTS: Mapping[str, tuple[str, Callable[[Page], str]]] = {
    "parameters": ("Description", parameters),
    "symbols": ("Notation", symbols),
    "screws": ("Screw axes", screws),
    "transforms": ("Link transforms", link_transforms),
    "fk": ("Forward kinematics", forward_kinematics),
    "jacobian": ("Jacobians", jacobians),
}
"""Heading and writer of each fragment, in the order of reading."""


def fragments(derivation: Derivation) -> dict[str, str]:
    r"""The parts of a robot's kinematics as LaTeX, to ``\input`` in any article.

    They need amsmath and booktabs, fit a line of 345 pt at 10 pt, and hold no headings. Shared
    terms carry on from ``fk.tex`` to ``jacobian.tex``; ``symbols.tex`` explains the short symbols
    of all.

    Args:
        derivation: A serial robot with its functions.

    Returns:
        File name and text of each: ``parameters.tex``, ``symbols.tex``, ``screws.tex``,
        ``transforms.tex``, ``fk.tex``, ``jacobian.tex``.
    """
    page = Page.of(derivation)
    # The symbols come last: they list what all others use.
    order = sorted(_FRAGMENTS, key="symbols".__eq__)
    written = {name: _FRAGMENTS[name][1](page) for name in order}
    return {f"{name}.tex": written[name] for name in _FRAGMENTS}


def document(derivation: Derivation) -> str:
    r"""An article of a robot that reads its fragments from the folder :data:`FOLDER` beside it."""
    robot = derivation.robot
    source = f"Source of the parameters: {escape(robot.source)}." if robot.source else ""
    title = f"Kinematics of the {escape(robot.title or robot.name)}"
    parts = [
        f"\\section{{{heading}}}\n\\input{{{FOLDER}/{name}}}"
        for name, (heading, _) in _FRAGMENTS.items()
    ]
    return "\n\n".join(
        [
            _PREAMBLE,
            "\\begin{document}",
            f"\\begin{{center}}\n\\LARGE {title}\n\\end{{center}}",
            *([source] if source else []),
            *parts,
            "\\end{document}\n",
        ]
    )


_PREAMBLE = r"""\documentclass[a4paper]{article}
\usepackage[utf8]{inputenc}
\usepackage[T1]{fontenc}
\usepackage{lmodern}
\usepackage{amsmath}
\usepackage{booktabs}
\usepackage[hmargin=25mm,vmargin=22mm]{geometry}
\setlength{\emergencystretch}{3em}
\AtBeginDocument{%
  \setlength{\abovedisplayskip}{6pt plus 3pt minus 3pt}%
  \setlength{\belowdisplayskip}{6pt plus 3pt minus 3pt}}
\renewcommand{\arraystretch}{0.95}
\makeatletter
\@beginparpenalty=10000 % a table stays with the words before it
\makeatother"""
