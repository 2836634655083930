r"""LaTeX of a derivation: the equations from which C is generated, as a paper would print them.

:func:`fragments` gives pieces to ``\input`` in any article, :func:`document` the article itself.
Every equation is a SymPy object in short symbols before it is printed
(:class:`PrintedEquations`), so that tests can evaluate the printed equations.
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
