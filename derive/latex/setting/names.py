"""Converts the names of joints, parameters and frames to LaTeX."""

import re
from collections.abc import Iterable, Mapping

from ...model.robot import Joint, Motor, SerialRobot

_LOWER = "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi"
_LOWER_FROM_PI = "pi rho"
_LOWER_FROM_SIGMA = "sigma tau upsilon phi chi psi omega"
_UPPER = "Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"
GREEK = frozenset(f"{_LOWER} {_LOWER_FROM_PI} {_LOWER_FROM_SIGMA} {_UPPER}".split())
LONGEST_WORD = 16
"""Maximum length of a word that is never broken across lines."""
_ESCAPES = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\ensuremath{<}",
    ">": r"\ensuremath{>}",
    "|": r"\ensuremath{|}",
    '"': r"{\char34}",
    "`": r"\textasciigrave{}",
    "-": "-{}",
    "°": r"\ensuremath{^\circ}",
    "µ": r"\ensuremath{\mu}",
    "±": r"\ensuremath{\pm}",
    "×": r"\ensuremath{\times}",  # noqa: RUF001
    "²": r"\ensuremath{^2}",
    "³": r"\ensuremath{^3}",
    "–": "--",  # noqa: RUF001
    "—": "---",
    "‘": "`",  # noqa: RUF001
    "’": "'",  # noqa: RUF001
    "“": "``",
    "”": "''",
    "…": r"\ldots{}",
    **{
        chr(start + k): rf"\ensuremath{{\{name}}}"
        for start, letters in ((0x3B1, _LOWER), (0x3C0, _LOWER_FROM_PI), (0x3C3, _LOWER_FROM_SIGMA))
        for k, name in enumerate(letters.split())
    },
}
_WORDS = ("a", "A", "I")
"""Joint names that are also English words, so that sentences print them as text and never as
symbols."""
_BREAKS = "_/"
"""Characters after which a long word may be broken."""
_PARTS = re.compile(r"[A-Za-z]+|[0-9]+")
_LATIN = frozenset(map(chr, range(0xC0, 0x180))) - frozenset("ĦħĸĿŀŉŦŧſ")
"""Accented letters that a LaTeX font with T1 encoding contains."""


def escape(text: str) -> str:
    """Escape text for a LaTeX paragraph and allow line breaks in long words.

    Letters that pdfLaTeX cannot set become codes, such as ``[U+4E2D]``.
    """
    words = text.split()
    return " ".join("".join(_escaped(word)) for word in words)


def _escaped(word: str) -> Iterable[str]:
    is_long = len(word) > LONGEST_WORD
    for k, character in enumerate(word, 1):
        yield _character(character)
        if is_long and (character in _BREAKS or (k % LONGEST_WORD == 0 and k < len(word))):
            yield r"\allowbreak{}"


def _character(character: str) -> str:
    if character in _ESCAPES:
        return _ESCAPES[character]
    if " " <= character <= "~" or character in _LATIN:
        return character
    return f"[U+{ord(character):04X}]"


def parameter(name: str) -> str:
    r"""Format a parameter name, for example ``alpha_1`` as \alpha_{1}."""
    head, *rest = _PARTS.findall(name) or [name]
    if len(head) == 2 and head not in GREEK:  # noqa: PLR2004
        head, rest = head[0], [head[1], *rest]
    if not rest:
        return _head(head)
    return f"{_head(head)}_{{{','.join(map(_index, rest))}}}"


def is_symbol(name: str) -> bool:
    """Whether a name is a letter with an optional index."""
    head = re.findall(r"[A-Za-z]+|[0-9]+", name)[0]
    return len(head) == 1 or head in GREEK


def own_symbols(robot: SerialRobot) -> tuple[str, ...]:
    """Return the joint names as LaTeX symbols, or () if a name is unsuitable.

    A suitable joint name is a Greek letter or, for a prismatic joint, a lower-case letter other
    than q. If a symbol occurs twice, the returned tuple is also empty.
    """
    joints = robot.coordinates
    found = [parameter(joint.name) for joint in joints]
    taken = [*found, *(parameter(p.name) for p in robot.parameters)]
    if len({*taken}) < len(taken) or not all(map(_is_own_symbol, joints)):
        return ()
    return tuple(found)


def _is_own_symbol(joint: Joint | Motor) -> bool:
    if not is_symbol(joint.name) or joint.name[0] == "q":
        return False
    return head(parameter(joint.name)).startswith("\\") or (
        joint.kind == "prismatic" and joint.name[0].islower()
    )


def in_words(words: str, symbols: Mapping[str, str]) -> str:
    """Escape text for a LaTeX paragraph and replace joint names by their symbols."""
    shown = escape(words)
    for name in sorted(symbols, key=len, reverse=True):
        if is_symbol(name) and name not in _WORDS:
            pattern = rf"(?<![\w$\\]){re.escape(escape(name))}(?![\w$])"
            shown = re.sub(pattern, f"${symbols[name]}$".replace("\\", r"\\"), shown)
    return shown


def head(tex: str) -> str:
    """Return the letter of a symbol without its index."""
    return tex.partition("_")[0]


def frame(name: str) -> str:
    """Format a frame name as a LaTeX index, with words in upright letters."""
    if len(name) == 1 or name.isdigit():
        return name
    return rf"\mathrm{{{_typed(name)}}}"


def _typed(name: str) -> str:
    return name.replace("_", r"\_")


def _head(word: str) -> str:
    if word in GREEK:
        return f"\\{word}"
    return word if len(word) == 1 else rf"\mathit{{{word}}}"


def _index(word: str) -> str:
    if word in GREEK:
        return f"\\{word}"
    return word if word.isdigit() or word.isupper() or len(word) == 1 else rf"\mathrm{{{word}}}"


def distinct(names: Iterable[str]) -> dict[str, str]:
    """Return the LaTeX symbol of each parameter.

    Names that would look alike are set verbatim.
    """
    found: dict[str, str] = {}
    for name in names:
        tex = parameter(name)
        if tex in found.values():
            tex = rf"\mathtt{{{_typed(name)}}}"
        found[name] = tex
    return found
