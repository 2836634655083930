"""The list of languages: a new language is a folder or a file with ``files``, and a line here."""

from collections.abc import Iterable

from .. import latex
from ..model.errors import RobotError
from . import casadi_c, casadi_file, python_package
from .c import language as c
from .emitter import Emitter

EMITTERS = (
    Emitter("c", c.files),
    Emitter("casadi", casadi_file.files),
    Emitter("python", python_package.files),
    Emitter("latex", latex.files, prints_equations=True),
)
LANGUAGES = tuple(emitter.language for emitter in EMITTERS)
"""The names of the languages that are written by default."""
ON_DEMAND = {"casadi_c": Emitter("casadi_c", casadi_c.files)}
"""Languages that are written if they are asked for, by their names."""
DETAILS = {
    "full": EMITTERS,
    "brief": (*EMITTERS[:-1], Emitter("latex", latex.brief_files, prints_equations=True)),
    "none": EMITTERS[:-1],
}
"""The languages by how much the article tells."""


def emitters_of(languages: Iterable[str | Emitter]) -> tuple[Emitter, ...]:
    """The emitters of languages, each a name or an emitter itself.

    Raises:
        RobotError: There is no language of a name.
    """
    known = {emitter.language: emitter for emitter in EMITTERS} | ON_DEMAND
    found = []
    for language in languages:
        if isinstance(language, str) and language not in known:
            raise RobotError(f"no language {language!r}; the languages are {', '.join(known)}")
        found.append(known[language] if isinstance(language, str) else language)
    return tuple(found)
