r"""LaTeX of a derivation: what C is generated from, as a paper would print it.

:func:`fragments` gives pieces to ``\input`` in any article, :func:`document` the article itself.
Every equation exists as SymPy objects in short symbols before it is printed (:class:`Equations`),
so that numbers can be put through what the reader sees.
"""

from .document import FOLDER, document, files, fragments
from .setting.sharing import Equations, Printed, equations

__all__ = ["FOLDER", "Equations", "Printed", "document", "equations", "files", "fragments"]
