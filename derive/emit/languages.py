"""The list of languages: a new language is a folder or a file with ``files``, and a line here."""

from .. import latex
from . import casadi_c, casadi_file, python_package
from .c import language as c
from .emitter import Emitter

EMITTERS = (
    Emitter("c", c.files),
    Emitter("casadi", casadi_file.files),
    Emitter("python", python_package.files),
    Emitter("latex", latex.files, prints_equations=True),
)
ON_DEMAND = {"casadi_c": Emitter("casadi_c", casadi_c.files)}
"""Languages that are written if they are asked for, by their names."""
DETAILS = {
    "full": EMITTERS,
    "brief": (*EMITTERS[:-1], Emitter("latex", latex.brief_files, prints_equations=True)),
    "none": EMITTERS[:-1],
}
"""The languages by how much the article tells."""
