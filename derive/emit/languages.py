"""Lists the output languages."""

from collections.abc import Iterable
from itertools import chain

from .. import latex
from ..model.errors import InputValueError
from . import casadi_c, casadi_file, python_package
from .c import language as c
from .c_float import language as c_float
from .cpp import language as cpp
from .cuda import language as cuda
from .emitter import Emitter
from .jax import language as jax
from .mex import language as mex
from .moveit import language as moveit
from .rust import language as rust

EMITTERS = (
    Emitter("c", c.files),
    Emitter("casadi", casadi_file.files),
    Emitter("python", python_package.files),
    Emitter("latex", latex.files, prints_equations=True),
)
LANGUAGES = tuple(emitter.language for emitter in EMITTERS)
"""Names of the default output languages."""
ON_DEMAND = {
    emitter.language: emitter
    for emitter in (
        Emitter("casadi_c", casadi_c.files),
        Emitter("cpp", cpp.files),
        Emitter("c_float", c_float.files),
        Emitter("rust", rust.files),
        Emitter("cuda", cuda.files),
        Emitter("jax", jax.files),
        Emitter("moveit", moveit.files),
        Emitter("mex", mex.files),
    )
}
"""Output languages that are written only on request."""
BRIEF = Emitter("latex", latex.brief_files, prints_equations=True)
"""LaTeX emitter whose article omits the derivations, screws, examples and singularities."""


def emitters_of(languages: Iterable[str | Emitter]) -> tuple[Emitter, ...]:
    """Return the emitter of each language.

    A language is given as a name or as an emitter.

    Raises:
        InputValueError: A language name is unknown.
    """
    known = {emitter.language: emitter for emitter in EMITTERS} | ON_DEMAND
    found = []
    for language in languages:
        if isinstance(language, str) and language not in known:
            raise InputValueError(
                f"unknown language {language!r}; expected one of {', '.join(known)}"
            )
        found.append(known[language] if isinstance(language, str) else language)
    return tuple(found)


def with_detail(emitters: Iterable[Emitter], detail: str) -> tuple[Emitter, ...]:
    """Return the emitters with a full, brief or omitted LaTeX article, as ``detail`` selects."""
    if detail == "full":
        return tuple(emitters)
    article = (BRIEF,) if detail == "brief" else ()
    return tuple(chain.from_iterable(article if e.prints_equations else (e,) for e in emitters))
