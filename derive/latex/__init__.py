r"""Prints the derivation of a robot as a LaTeX article.

The function ``document`` returns the LaTeX article. The function ``fragments`` returns parts that
any LaTeX document can include with ``\input``. ``PrintedEquations`` stores each equation as a SymPy
object before printing, so that tests can evaluate the equation.
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
