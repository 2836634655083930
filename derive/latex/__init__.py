r"""Prints a derivation as a LaTeX article.

``document`` returns the article. ``fragments`` returns parts that any article can include
with ``\input``. Each equation is stored as a SymPy object before printing
(``PrintedEquations``). Tests can evaluate the SymPy objects.
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
