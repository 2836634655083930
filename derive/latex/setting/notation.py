r"""Defines the short symbols, named constants and shared terms of a LaTeX article.

A short symbol, such as a symbol for a cosine, abbreviates an expression. The SymPy name of a short
symbol is LaTeX text. Braces in this text distinguish the short symbol from a parameter.
``Notation.meanings`` contains the definition of each short symbol, for the symbol table and for
tests.
"""

from collections.abc import Collection, Mapping, Sequence
from itertools import count

import sympy as sp

from ...model.robot import Placement, Rotation, SerialRobot
from ...model.sizes import size
from ...model.tolerances import RELIABLE_DIGITS
from ...terms.terms import Terms
from . import names
from .shorter import reduced

Order = tuple[int, tuple[object, ...]]
"""Sort key of a factor in a printed product. The first entry is the kind of factor, such as
``LENGTH``."""
CONSTANT, LENGTH, TRIGONOMETRY, CONSTANT_TRIGONOMETRY, TERM, ENTRY, OTHER = range(7)

ACCENTS = ("hat", "tilde", "check", "breve")
MAX_PARTS = 12
"""Maximum number of named constants in the expression of a numerical value."""
MAX_WRITTEN = 200
"""Maximum number of symbols and numbers in the definition of a constant that is written with
parameters only."""
COMMAS_FROM = 10
"""If a robot has at least this number of coordinates, commas separate the indices of a symbol."""
LONG_RUN = 3
"""Minimum number of consecutive indices that are printed as a range, such as 1:3."""
LETTERS = {
    "cos": ("c", "C", r"\mathrm{c}"),
    "sin": ("s", "S", r"\mathrm{s}"),
    "term": ("t", "u", "w", "g", "f", r"\tau"),
    "constant": (r"\kappa", r"\lambda", r"\mu", "k"),
    "geometry": ("b", "g", "h", r"\beta", r"\mathrm{b}"),
    "rotation": ("r", r"\rho", "n", r"\mathrm{r}"),
    "position": ("p", "o", r"\varpi", r"\mathrm{p}"),
}
"""Letters for each kind of symbol, in order of preference. A letter that names a parameter is not
used."""


class Notation:
    """The short symbols for the printed expressions of one derivation.

    Attributes:
        terms: The named terms and constants of the derivation.
        q: The coordinates.
        called: LaTeX symbols of the coordinates, or () if the coordinates are called q_1, q_2, ...
        tex: LaTeX text of each coordinate, parameter and short symbol.
        order: Sort key of each printed symbol, for the order of the factors in a product.
        meanings: The full expressions that the symbols abbreviate, keyed by symbol.
        angles: Accent and index of the symbols for the cosine and sine of each angle, in order of
            first use of the angles.
        constants: The named constants, in order of first use.
        halves: Whether fractions replace decimals such as 0.5, because angles of 30 or 60 degrees
            cause square roots of 3.
    """

    def __init__(
        self,
        robot: SerialRobot,
        terms: Terms,
        q: Sequence[sp.Symbol],
        called: Sequence[str] = (),
        reserved: Collection[str] = (),
    ) -> None:
        self.terms, self.q = terms, tuple(q)
        self.called = tuple(called)
        parameters = names.distinct(parameter.name for parameter in robot.parameters)
        self.tex = {p.symbol: parameters[p.name] for p in robot.parameters}
        tex = self.called or [f"q_{{{k}}}" for k in range(1, len(self.q) + 1)]
        self.tex |= dict(zip(self.q, tex, strict=True))
        heads = map(names.head, (*parameters.values(), *self.called))
        self.letters = _letters({*heads, *reserved})
        self.order: dict[sp.Symbol, Order] = {
            symbol: (LENGTH, place) for symbol, place in _places(robot, self.q).items()
        }
        self.meanings: dict[sp.Symbol, sp.Expr] = {}
        self.angles: dict[sp.Expr, tuple[str, str]] = {}
        self.constants: list[sp.Symbol] = []
        self._reduced: dict[sp.Expr, sp.Expr] = {}
        self._constants: dict[sp.Expr, sp.Expr] = {}
        self._sums: dict[sp.Expr, sp.Expr] = {}
        self.halves = _has_thirds(robot)
        self._expanded: dict[sp.Symbol, sp.Expr] = {}
        self._sizes: dict[sp.Symbol, int] = {}
        self._terms, self._geometric = count(1), count(1)

    def trigonometric(self, expression: sp.Expr) -> sp.Expr:
        """Return the signed short symbol for the cosine or sine of a sum of coordinates."""
        (angle,) = expression.args
        angle = sp.expand(self.expanded(angle))
        lead = next((q for q in self.q if angle.has(q)), None)
        if lead is None:
            return self.constant(expression.func(angle))
        negative = angle.coeff(lead).could_extract_minus_sign()
        angle = -angle if negative else angle
        accent, index = self._angle(angle)
        kind = "cos" if expression.func is sp.cos else "sin"
        letter = self.letters[kind]
        tex = f"{accent.format(letter)}_{{{index}}}"
        joints = tuple(k for k, q in enumerate(self.q) if angle.has(q))
        symbol = self.symbol(tex, (TRIGONOMETRY, (joints, kind, accent)), expression.func(angle))
        return -symbol if negative and kind == "sin" else symbol

    def constant(self, expression: sp.Expr) -> sp.Expr:
        """Return the printed form of an expression without coordinates.

        Numbers with equal values share one name.
        """
        if is_long_number(self.terms, expression):
            return self._numeric(self.terms.value(expression))
        if is_long(self.terms, expression):
            return self._by_parts(expression)
        raw = self._short(self.expanded(expression))
        known = self._constants.get(raw)
        if known is None:
            known = self._constants[raw] = self._printed_constant(raw)
        return known

    def shortened(self, expression: sp.Expr) -> sp.Expr:
        """Return a constant expression in which short symbols replace long parts."""
        return self._shortened(self._short(expression))

    def _short(self, expression: sp.Expr) -> sp.Expr:
        if expression not in self._reduced:
            self._reduced[expression] = reduced(expression)
        return self._reduced[expression]

    def _shortened(self, expression: sp.Expr) -> sp.Expr:
        if expression.is_Atom or is_surd(expression):
            return expression
        if expression.is_number:
            return expression
        if expression.is_Function:
            return self.constant(expression)
        if expression.is_Mul:
            numbers = sp.Mul(*(factor for factor in expression.args if factor.is_number))
            rest = [factor for factor in expression.args if not factor.is_number]
            return self.constant(numbers) * sp.Mul(*map(self._shortened, rest))
        return expression.func(*map(self._shortened, expression.args))

    def expanded(self, expression: sp.Expr) -> sp.Expr:
        """Replace the named terms of an expression by their full definitions."""
        known: dict[sp.Symbol, sp.Expr] = {}
        for symbol in expression.free_symbols:
            definition = self.terms.definitions.get(symbol, self.terms.constants.get(symbol))
            if definition is not None:
                if symbol not in self._expanded:
                    self._expanded[symbol] = self.expanded(definition)
                known[symbol] = self._expanded[symbol]
        return expression.xreplace(known)

    def values(self) -> dict[sp.Symbol, sp.Expr]:
        """Return the values of the named constants at default parameters."""
        found: dict[sp.Symbol, sp.Expr] = {}
        for symbol, meaning in self.meanings.items():
            if self.order[symbol][0] in (CONSTANT, CONSTANT_TRIGONOMETRY):
                found[symbol] = self.terms.value(meaning.xreplace(found))
        return found

    def term(self) -> sp.Symbol:
        """Return the symbol of the next shared term. The caller must define this shared term."""
        number = next(self._terms)
        tex = f"{self.letters['term']}_{{{number}}}"
        return self.symbol(tex, (TERM, (number,)))

    def geometric(self) -> sp.Symbol:
        """Return the symbol of the next shared term of the screw axes."""
        number = next(self._geometric)
        tex = f"{self.letters['geometry']}_{{{number}}}"
        return self.symbol(tex, (TERM, (number,)))

    def entries(self) -> tuple[sp.Symbol | None, ...]:
        """Return the names of the entries of a pose (4, 4) in row-major order.

        The entries of the last matrix row (0, 0, 0, 1) have no names.
        """
        r, p = self.letters["rotation"], self.letters["position"]
        named: list[sp.Symbol | None] = []
        for i, axis in enumerate("xyz", 1):
            row = [f"{r}_{{{i}{j}}}" for j in (1, 2, 3)] + [f"{p}_{{{axis}}}"]
            named += [self.symbol(tex, (ENTRY, (tex,))) for tex in row]
        return (*named, *(None,) * 4)

    def symbol(self, tex: str, order: Order, meaning: sp.Expr | None = None) -> sp.Symbol:
        """Return a symbol that is printed as the given LaTeX text."""
        symbol = sp.Symbol(tex, real=True)
        self.tex[symbol], self.order[symbol] = tex, order
        if meaning is not None:
            self.meanings[symbol] = meaning
        return symbol

    def _angle(self, angle: sp.Expr) -> tuple[str, str]:
        if angle not in self.angles:
            index, plain = self._index(angle)
            used = sum(
                other == index and pattern != "{}" for pattern, other in self.angles.values()
            )
            pattern = "{}"
            if not plain:
                primes = "'" * (used // len(ACCENTS))
                pattern = rf"\{ACCENTS[used % len(ACCENTS)]}{{{{{{}}}}}}{primes}"
            self.angles[angle] = (pattern, index)
        return self.angles[angle]

    def _index(self, angle: sp.Expr) -> tuple[str, bool]:
        coefficients = {k: angle.coeff(q) for k, q in enumerate(self.q, 1) if angle.has(q)}
        plain = angle == sum(c * self.q[k - 1] for k, c in coefficients.items()) and all(
            abs(c) == 1 for c in coefficients.values()
        )
        signed = [-k if c.could_extract_minus_sign() else k for k, c in coefficients.items()]
        return _joined(signed, commas=len(self.q) >= COMMAS_FROM), plain

    def _printed_constant(self, raw: sp.Expr) -> sp.Expr:
        if raw.is_Symbol:
            return raw
        if is_surd(raw) or _is_plain_sum(raw):
            return raw
        if raw.is_number:
            return self._numeric(raw)
        if raw.is_Mul:
            return sp.Mul(*(self.constant(factor) for factor in raw.args))
        if raw.func in (sp.cos, sp.sin) and raw.args[0].is_Symbol:
            kind = "cos" if raw.func is sp.cos else "sin"
            tex = f"{self.letters[kind]}_{{{self.tex[raw.args[0]]}}}"
            return self.symbol(tex, (CONSTANT_TRIGONOMETRY, (tex,)), raw)
        return self._named_sum(raw) if raw.is_Add else self.named(raw)

    def _named_sum(self, raw: sp.Expr) -> sp.Expr:
        content, primitive = raw.primitive()
        if primitive.could_extract_minus_sign():
            content, primitive = -content, -primitive
        if primitive not in self._sums:
            self._sums[primitive] = self.named(raw) / content
        return content * self._sums[primitive]

    def _by_parts(self, expression: sp.Expr) -> sp.Expr:
        sign, symbol = expression.as_coeff_Mul()
        if symbol not in self.terms.constants:
            return self.named(self._in_names(expression))
        for part in self.terms.constants_in(symbol):
            if part not in self._constants and is_long(self.terms, part):
                self._constants[part] = self.named(self._in_names(self.terms.constants[part]))
        return sign * self._constants[symbol]

    def _in_names(self, expression: sp.Expr) -> sp.Expr:
        parts = sorted(expression.free_symbols & self.terms.constants.keys(), key=numbered)
        return expression.xreplace({part: self.constant(part) for part in parts})

    def _numeric(self, raw: sp.Expr) -> sp.Expr:
        value = self.terms.value(raw)
        sign = -1 if value < 0 else 1
        key = sp.Float(sign * value, RELIABLE_DIGITS)
        if key not in self._constants:
            self._constants[key] = self.named(sign * raw)
        return sign * self._constants[key]

    def named(self, raw: sp.Expr) -> sp.Symbol:
        """Return the name of the next constant.

        A short definition of the constant is written with parameters, and a long definition with
        earlier short symbols.
        """
        parts = size(raw, self._sizes)
        if parts <= MAX_WRITTEN:
            raw = raw.xreplace(self.meanings)
        if raw in self._constants:
            return self._constants[raw]
        number = len(self.constants) + 1
        tex = f"{self.letters['constant']}_{{{number}}}"
        symbol = self._constants[raw] = self.symbol(tex, (CONSTANT, (number,)), raw)
        self._sizes[symbol] = parts
        self.constants.append(symbol)
        return symbol


def is_long_number(terms: Terms, expression: sp.Expr) -> bool:
    """Whether a number contains more than ``MAX_PARTS`` named constants."""
    if not terms.is_number(expression):
        return False
    found: set[sp.Symbol] = set()
    waiting = [*expression.free_symbols]
    while waiting and len(found) <= MAX_PARTS:
        symbol = waiting.pop()
        if symbol in terms.constants and symbol not in found:
            found.add(symbol)
            waiting.extend(terms.constants[symbol].free_symbols)
    return len(found) > MAX_PARTS


def is_long(terms: Terms, expression: sp.Expr) -> bool:
    """Whether a constant with parameters is so long that the LaTeX article must name its parts."""
    return not terms.is_number(expression) and terms.size(expression) > MAX_WRITTEN


def numbered(symbol: sp.Symbol) -> tuple[int, str]:
    """Return the sort key of a numbered symbol."""
    return len(symbol.name), symbol.name


def _joined(indices: Sequence[int], *, commas: bool) -> str:
    shown: list[str] = []
    k = 0
    while k < len(indices):
        run = 1
        while k + run < len(indices) and indices[k + run] == indices[k] + run > 0:
            run += 1
        if commas and run >= LONG_RUN:
            shown.append(f"{indices[k]}:{indices[k + run - 1]}")
            k += run
        else:
            shown.append(str(indices[k]) if indices[k] > 0 else rf"\bar{{{-indices[k]}}}")
            k += 1
    return ("," if commas else "").join(shown)


def is_surd(expression: sp.Expr) -> bool:
    """Whether a number is rational, or a rational multiple of pi or of a square root."""
    coefficient, rest = expression.as_coeff_Mul()
    root = rest.is_Pow and rest.base.is_Rational and rest.exp == sp.Rational(1, 2)
    return bool(coefficient.is_Rational and (rest in (1, sp.pi) or root))


def _is_plain_sum(expression: sp.Expr) -> bool:
    return (
        expression.is_Add
        and len(expression.args) == 2  # noqa: PLR2004
        and all(t.is_Rational or t.as_coeff_Mul()[1].is_Symbol for t in expression.args)
    )


def _letters(taken: set[str]) -> dict[str, str]:
    pairs = list(zip(LETTERS["cos"], LETTERS["sin"], strict=True))
    free = [pair for pair in pairs if not taken & set(pair)] or pairs[-1:]
    letters = {"cos": free[0][0], "sin": free[0][1]}
    for kind in ("term", "constant", "geometry", "rotation", "position"):
        options = [letter for letter in LETTERS[kind] if letter not in taken]
        letters[kind] = (options or LETTERS[kind][-1:])[0]
    return letters


def _has_thirds(robot: SerialRobot) -> bool:
    sixths = (
        6 * motion.angle / sp.pi
        for placement in robot.placements
        for motion in placement
        if isinstance(motion, Rotation)
    )
    return any(turn.is_Integer and turn % 3 != 0 for turn in sixths)


def _places(robot: SerialRobot, q: Sequence[sp.Symbol]) -> Mapping[sp.Symbol, tuple[object, ...]]:
    places: dict[sp.Symbol, tuple[object, ...]] = {}
    declared = [parameter.symbol for parameter in robot.parameters]

    def note(expressions: Sequence[sp.Expr], joint: int, part: int) -> None:
        symbols = {symbol for e in expressions for symbol in e.free_symbols}
        for k, symbol in enumerate((*q, *declared)):
            if symbol in symbols:
                places.setdefault(symbol, (joint, part, k))

    note(_numbers(robot.base), 0, 0)
    values = iter(robot.joint_values(q))
    for k, joint in enumerate(robot.joints, 1):
        note(_numbers(joint.before), k, 0)
        if joint.kind != "fixed":
            note([joint.pitch], k, 0)
            note([next(values)], k, 1 if joint.kind == "prismatic" else -1)
        note(_numbers(joint.after), k, 2)
    note([*_numbers(robot.tool), *declared], len(robot.joints) + 1, 0)
    return places


def _numbers(placement: Placement) -> list[sp.Expr]:
    numbers: list[sp.Expr] = []
    for motion in placement:
        numbers += [motion.angle] if isinstance(motion, Rotation) else motion.vector
    return numbers
