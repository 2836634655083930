"""Names the joints of a robot with loops.

Main-chain joints get the symbols theta_1, theta_2, ..., actuated coordinates q_1, q_2, ... and
other joints psi_1, psi_2, ... A joint name that is a symbol stays unchanged, for example ``theta8``
or ``l_HI``.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import sympy as sp

from ...loops.model.constraints import configuration_names
from ...model.mechanism import Mechanism
from ..setting import names
from ..setting.notation import LENGTH, Notation

ACTUATED = "q"
THETA = (r"\theta", r"\vartheta", r"\xi")
PSI = (r"\psi", r"\eta", r"\chi")
"""Letters for joints, in order of preference. A letter that the robot description already uses is
skipped."""
LETTERS: Mapping[str, tuple[str, ...]] = {
    "angle": (r"\varphi", r"\phi", r"\gamma"),
    "freedom": (r"\zeta", r"\sigma", r"\nu"),
    "A": ("A", "U", r"\mathrm{A}"),
    "B": ("B", "V", r"\mathrm{B}"),
    "C": ("C", "G", r"\mathrm{C}"),
    "D": ("D", "X", r"\mathrm{D}"),
    "P": ("P", "Q", r"\mathrm{P}"),
    "E": ("E", "W", r"\mathrm{E}"),
    "h": ("h", "H", r"\mathrm{h}"),
    "m": ("m", "K", r"\mathrm{m}"),
    "n": ("n", "N", r"\mathrm{n}"),
    "p": ("p", "F", r"\mathrm{p}"),
    "t": ("t", r"\tau", r"\mathrm{t}"),
    "u": ("u", r"\upsilon", r"\mathrm{u}"),
    "v": ("v", "V", r"\mathrm{v}"),
    "w": ("w", "W", r"\mathrm{w}"),
    "alpha": (r"\alpha", r"\epsilon", r"\mathrm{a}"),
    "beta": (r"\beta", r"\varepsilon", r"\mathrm{b}"),
    "delta": (r"\delta", r"\Delta", r"\mathrm{d}"),
}
"""Alternative letters for each kind of intermediate result, in order of preference."""


@dataclass(frozen=True)
class Members:
    """Symbols that the LaTeX article prints for the joints of a mechanism.

    Attributes:
        theta: LaTeX names of the main-chain joints.
        q: LaTeX names of the actuated coordinates.
        of: LaTeX symbols of all configuration entries, keyed by the name of the entry.
        struts: Names of the struts (rods and cylinders) with pin joints at their ends, keyed by the
            name of the strut angle.
    """

    theta: tuple[str, ...]
    q: tuple[str, ...]
    of: Mapping[str, str]
    struts: Mapping[str, str]

    def called(self, name: str) -> str:
        """Format the name of a joint, body or loop closure for use in a sentence."""
        if names.is_symbol(name):
            return f"${self.of.get(name, names.parameter(name))}$"
        return words(name, self.struts)

    def with_symbol(self, name: str) -> str:
        """Format a joint for use in a sentence, as its name followed by its symbol."""
        if names.is_symbol(name) or name not in self.of:
            return self.called(name)
        return f"{words(name, self.struts)} ${self.of[name]}$"


def members(mechanism: Mechanism) -> Members:
    """Return the symbols of a mechanism's joints."""
    parameters = names.distinct(parameter.name for parameter in mechanism.parameters)
    chosen = _Chosen(mechanism, set(parameters.values()))
    main = [joint.name for joint in mechanism.main_chain.moving]
    q = tuple(f"{ACTUATED}_{{{k}}}" for k in range(1, len(mechanism.coordinates) + 1))
    of = chosen.numbered(main, THETA)
    own = zip(mechanism.coordinates, q, strict=True)
    of |= {c.moves: tex for c, tex in own if c.name == c.moves and c.moves not in of}
    rest = [v.name for v in configuration_names(mechanism) if v.name not in of]
    of |= chosen.numbered(rest, PSI)
    struts = {strut.swing_name: strut.name for strut in mechanism.struts if strut.ends == "pin"}
    return Members(tuple(of[name] for name in main), q, of, struts)


class _Chosen:
    def __init__(self, mechanism: Mechanism, taken: set[str]) -> None:
        self.own: dict[str, str] = {}
        self.heads = {ACTUATED, *map(names.head, taken)}
        for variable in configuration_names(mechanism):
            tex = names.parameter(variable.name)
            is_free = tex not in taken and names.head(tex) != ACTUATED
            if names.is_symbol(variable.name) and is_free:
                self.own[variable.name] = tex
                taken.add(tex)
                self.heads.add(names.head(tex))

    def numbered(self, wanted: Iterable[str], letters: tuple[str, ...]) -> dict[str, str]:
        letter = next((one for one in letters if one not in self.heads), letters[-1])
        return {name: self.own.get(name, f"{letter}_{{{k}}}") for k, name in enumerate(wanted, 1)}


def dotted(tex: str) -> str:
    """Add a dot to a LaTeX symbol to denote a rate."""
    letter, bar, index = tex.partition("_")
    return rf"\dot{{{letter}}}{bar}{index}"


def words(name: str, struts: Mapping[str, str]) -> str:
    """Format the name of a joint or strut part for a sentence, with spaces between words.

    Args:
        name: The name of a joint or of a part of a strut.
        struts: Names of the struts with pin joints at their ends, keyed by the name of the strut
            angle.
    """
    first, dot, part = name.partition(".")
    kind = _KINDS.get(part.partition(".")[0])
    if first in struts:
        kind, first = "near end of", struts[first]
    plain = names.escape(first.replace("_", " "))
    plain = f"{kind} {plain}" if kind else plain
    # Two joints share a pin if their bodies rotate about the same point of a third body.
    is_shared = dot and part.partition(".")[0] not in _KINDS
    return f"pin between {plain} and {words(part, struts)}" if is_shared else plain


_KINDS = {"end": "far end of", "piston": "piston of", "begin": "near end of"}
"""Descriptions of a strut's joints, keyed by the suffix of the joint name."""


class Letters:
    """Letters for intermediate results, different from the letters of the robot's symbols."""

    def __init__(self, notation: Notation, symbols: Members) -> None:
        lengths = [notation.tex[s] for s, (kind, _) in notation.order.items() if kind == LENGTH]
        taken = set(map(names.head, (*lengths, *symbols.of.values())))
        used = ("cos", "sin", "term", "constant")
        taken |= {*(notation.letters[kind] for kind in used), ACTUATED}
        self.notation = notation
        self.letters: dict[str, str] = {}
        for kind, options in LETTERS.items():
            free = [letter for letter in options if letter not in taken]
            self.letters[kind] = (free or [options[-1]])[0]
        self._count: dict[str, int] = {}

    def next(self, kind: str) -> sp.Symbol:
        """Return the next numbered symbol for a kind of intermediate result."""
        number = self._count[kind] = self._count.get(kind, 0) + 1
        return self.notation.symbol(f"{self.letters[kind]}_{{{number}}}", (LENGTH, (90, number)))

    def of_step(self, kind: str, step: int, axis: str = "") -> sp.Symbol:
        """Return the symbol of an intermediate result in a numbered solution step."""
        tex = f"{self.letters.get(kind, kind)}_{{{step}{axis}}}"
        return self.notation.symbol(tex, (LENGTH, (95, step, "hnmpCEPDAB".find(kind), axis)))
