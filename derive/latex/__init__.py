r"""Prints a derivation as LaTeX: an article with the equations of the generated C.

:func:`fragments` returns LaTeX fragments to ``\input`` in any article; :func:`document` returns the
article. Before printing, every equation is a SymPy object in the printed symbols
(:class:`PrintedEquations`), which tests can evaluate.
"""

from .chain.model_fragment import model_quality
from .document import FOLDER, brief_files, document, files, fragments
from .setting.sharing import Printed, PrintedEquations, equations

__all__ = [
    "FOLDER",
    "Printed",
    "PrintedEquations",
    "brief_files",
    "document",
    "equations",
    "files",
    "fragments",
    "model_quality",
]
