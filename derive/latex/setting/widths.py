r"""Estimates the width of a formula for line breaks.

The widths are for Computer Modern at 10 pt. Lines are 345 pt wide, as in the LaTeX document class
``article``.
"""

import re
from string import ascii_lowercase, ascii_uppercase

LINE = 345.0
"""Width of a line (pt)."""
SCRIPT = 0.72
"""Size of an index relative to its letter."""
_LOWER = "5.3 4.3 4.4 5.6 4.7 4.9 5.0 5.8 3.4 4.1 5.3 3.0 8.8 6.0 5.0 5.6 5.3 4.6 4.7 3.9 5.7 5.3 7.2 5.7 5.3 4.7"  # noqa: E501
_UPPER = "7.5 7.6 7.2 8.3 7.4 6.5 7.9 8.9 4.7 6.1 8.8 6.8 10.8 8.9 7.8 7.2 7.9 7.7 6.4 7.2 7.5 7.5 10.8 8.5 7.5 7.2"  # noqa: E501
_LETTERS = {
    letter: float(wide)
    for letters, widths in ((ascii_lowercase, _LOWER), (ascii_uppercase, _UPPER))
    for letter, wide in zip(letters, widths.split(), strict=True)
}
_SIGNS = {"+": 12.3, "-": 12.3, "=": 13.4, ",": 4.5, ".": 2.8, " ": 0.0, "(": 3.9, ")": 3.9}
_MINUS = 7.8
"""Width of a leading minus sign, which has no space around it."""
_OTHER = 5.2
_COMMANDS = {
    "quad": 10.0, "qquad": 20.0, "cos": 17.3, "sin": 15.7, "tan": 17.7, "arctan": 31.0,
    "max": 20.6, "min": 18.4,
    "ldots": 13.4, "cdots": 16.7, "approx": 13.4, "pm": 7.8, "circ": 5.0, "cdot": 7.2,
    "omega": 6.2, "alpha": 6.4, "theta": 4.7, "sqrt": 8.4,
}  # fmt: skip
_ALTERATIONS = "hat tilde check breve bar mathrm mathit mathtt mathcal operatorname"
_SILENT = "left right allowbreak ensuremath"
_TRANSPARENT = frozenset(f"{_ALTERATIONS} {_SILENT}".split())
_TOKEN = re.compile(r"\\[A-Za-z]+|\\.|.", re.DOTALL)


def width(tex: str) -> float:
    """Estimate the width (pt) of a formula on one line."""
    return _Measure(_TOKEN.findall(tex)).group(1.0)


class _Measure:
    def __init__(self, tokens: list[str]) -> None:
        self.tokens, self.position = tokens, 0

    def group(self, scale: float) -> float:
        total = 0.0
        while self.position < len(self.tokens) and self.tokens[self.position] != "}":
            total += self._item(scale)
        self.position += 1
        return total

    def _item(self, scale: float) -> float:
        token = self.tokens[self.position]
        self.position += 1
        if token == "{":
            return self.group(scale)
        if token in ("_", "^"):
            return self._item(scale * SCRIPT) + 0.5
        if token in (r"\frac", r"\tfrac"):
            small = scale * (SCRIPT if token == r"\tfrac" else 1.0)
            return max(self._item(small), self._item(small)) + 2.4
        if token.startswith("\\"):
            name = token[1:]
            return 0.0 if name in _TRANSPARENT else _COMMANDS.get(name, 6.0) * scale
        if token == "-" and self.tokens[self.position : self.position + 1] != [" "]:
            return _MINUS * scale
        return _SIGNS.get(token, _LETTERS.get(token, _OTHER)) * scale
