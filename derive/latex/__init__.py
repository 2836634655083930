r"""LaTeX of a derivation: equations as a paper would print them, from the objects that C comes from.

:func:`fragments` gives pieces to ``\input`` in any article, :func:`document` the article itself.
Every equation exists as SymPy objects in short symbols before it is printed (:class:`Equations`),
so that numbers can be put through what the reader sees.
"""

from .document import FOLDER, document, fragments
from .sharing import Equations, Printed, equations

__all__ = ["FOLDER", "Equations", "Printed", "document", "equations", "fragments"]
