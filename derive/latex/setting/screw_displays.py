r"""Typesets the screw axes and the home pose."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import count

import sympy as sp

from ...chain.poe import product_of_exponentials
from ...model.robot import Placement, Rotation, SerialRobot
from ...model.tolerances import FEW_PRINTED_DIGITS, PRINTED_DIGITS, ROUNDING
from ...model.values import Values, to_digits
from .layout import MARGIN, Display, Equation, matrix_width, named_matrix
from .names import frame
from .notation import Notation, is_surd
from .printer import cut
from .sharing import BRACKET, PrintedEquations
from .widths import LINE, width

MAX_TILTS = 3
"""Maximum number of rotations whose cosines and sines are printed as roots. Rotations by multiples
of 90 degrees do not count. If more rotations count, the cosines and sines of all counted rotations
are printed as decimals."""


@dataclass(frozen=True)
class Screws:
    """The product of exponentials of a robot in short symbols.

    Attributes:
        definitions: Definitions of the shared terms, each after the terms on which it depends.
        S: Screw axes as the columns of a matrix (6, moving joints).
        M: Home pose (4, 4).
    """

    definitions: tuple[tuple[sp.Symbol, sp.Expr], ...]
    S: sp.ImmutableMatrix
    M: sp.ImmutableMatrix


class _Decimal(Rotation):
    def __post_init__(self) -> None:
        """Keep the decimal angle, which a ``Rotation`` would convert to an exact angle."""


WIDEST = 0.4 * LINE
"""Maximum width (pt) of a printed number. A number whose exact form is wider is printed as a
decimal, and a wider sum gets a name."""


@dataclass(frozen=True)
class ScrewDisplays:
    """The product of exponentials of a robot, ready to be printed.

    Attributes:
        terms: Equations of the shared terms, each after the terms on which it depends.
        columns: One displayed equation for each screw axis.
        home: The home pose.
        named: Names and values of those entries of the screw axes and home pose that are too wide
            to print.
    """

    terms: tuple[Equation, ...]
    columns: tuple[Display, ...]
    home: Display
    named: tuple[Equation, ...]


def screw_displays(robot: SerialRobot, equations: PrintedEquations) -> ScrewDisplays:
    """Return the screw axes and the home pose for printing."""
    found = printed_screws(robot, equations.notation)
    constants = _Constants(equations)
    columns = tuple(constants.screw(k + 1, found.S[:, k]) for k in range(found.S.shape[1]))
    home = constants.pose(home_name(robot), found.M)
    printer = equations.printer
    terms = tuple((printer.tex(name), printer.terms(value)) for name, value in found.definitions)
    return ScrewDisplays(terms, columns, home, tuple(constants.named))


def home_name(robot: SerialRobot) -> str:
    """Return the symbol of the home pose."""
    return rf"{{}}^{{{frame(robot.base_frame)}}}M_{{{frame(robot.tool_frame)}}}"


class _Constants:
    def __init__(self, equations: PrintedEquations) -> None:
        self.notation, self.printer = equations.notation, equations.printer
        self.named: list[Equation] = []

    def screw(self, number: int, entries: Iterable[sp.Expr]) -> Display:
        names = [rf"{part}_{{{number},{axis}}}" for part in ("v", r"\omega") for axis in "xyz"]
        rows = [[self._entry(*pair, WIDEST)] for pair in zip(names, entries, strict=True)]
        return named_matrix(rf"\mathcal{{S}}_{{{number}}}", rows)

    def pose(self, name: str, M: sp.Matrix) -> Display:
        exact = named_matrix(name, [[self.printer.tex(e) for e in row] for row in M.tolist()])
        if exact.width <= LINE - MARGIN:
            return exact
        used = width(f"{name} =") + matrix_width([[""] * M.shape[1]])
        room = (LINE - 2 * MARGIN - used) / M.shape[1]
        rows = [
            [self._entry(f"M_{{{i}{j}}}", entry, room) for j, entry in enumerate(row, 1)]
            for i, row in enumerate(M.tolist(), 1)
        ]
        return named_matrix(name, rows)

    def _entry(self, name: str, entry: sp.Expr, room: float) -> str:
        exact = self.printer.tex(entry)
        if width(exact) <= room:
            return exact
        if not entry.is_number:
            self.named.append((name, self._terms(entry)))
            return name
        for decimal in (cut(entry, digits) for digits in (PRINTED_DIGITS, FEW_PRINTED_DIGITS)):
            if width(decimal) <= room:
                return decimal
        self.named.append((name, [cut(entry, PRINTED_DIGITS)]))
        return name

    def _terms(self, entry: sp.Expr) -> list[str]:
        return self.printer.terms(self._bracketed(entry))

    def _bracketed(self, entry: sp.Expr) -> sp.Expr:
        addends = []
        for addend in sp.Add.make_args(entry):
            factors = [
                self._bracket(factor) if factor.is_Add else factor
                for factor in sp.Mul.make_args(addend)
            ]
            addends.append(sp.Mul(*factors))
        return sp.Add(*addends)

    def _bracket(self, factor: sp.Expr) -> sp.Expr:
        inner = self._bracketed(factor)
        if width(self.printer.tex(inner)) <= BRACKET:
            return inner
        sign = -1 if self.printer.tex(inner).startswith("-") else 1
        return sign * self.notation.named(sp.expand(sign * inner))


def printed_screws(robot: SerialRobot, notation: Notation) -> Screws:
    """Return the screw axes and the home pose in short symbols.

    With general angles, each joint adds terms to the product of exponentials. Before the
    exponentials are multiplied, cosines and sines without an exact short form become decimals with
    40 digits.
    """
    S, M = product_of_exponentials(_with_decimals(robot))
    definitions: list[tuple[sp.Symbol, sp.Expr]] = []
    known: dict[sp.Symbol, sp.Expr] = {}
    symbols = (sp.Symbol(f"_{k}", real=True) for k in count())
    replacements, (S, M) = sp.cse([S, M], symbols=symbols, order="none")
    for symbol, expression in replacements:
        value = _short(expression.xreplace(known), notation)
        if (-value if value.could_extract_minus_sign() else value).is_Atom or not _varies(robot):
            known[symbol] = value
        else:
            known[symbol] = notation.geometric()
            definitions.append((known[symbol], value))
    S, M = (
        matrix.applyfunc(lambda entry: _short(entry.xreplace(known), notation)) for matrix in (S, M)
    )
    return Screws(tuple(definitions), S, M)


def _short(expression: sp.Expr, notation: Notation) -> sp.Expr:
    rounded = {}
    for number in expression.atoms(sp.Float):
        nearest = sp.Integer(round(number))
        if abs(number - nearest) < ROUNDING:
            rounded[number] = nearest
    return notation.shortened(expression.xreplace(rounded))


def _varies(robot: SerialRobot) -> bool:
    return any(turn.angle.free_symbols for turn in _turns(robot))


def _turns(robot: SerialRobot) -> list[Rotation]:
    return [motion for part in robot.placements for motion in part if isinstance(motion, Rotation)]


def _with_decimals(robot: SerialRobot) -> SerialRobot:
    tilted = [turn for turn in _turns(robot) if not (2 * turn.angle / sp.pi).is_Integer]
    many = len(tilted) > MAX_TILTS

    def changed(placement: Placement) -> Placement:
        return tuple(
            _Decimal(motion.axis, to_digits(Values().of(motion.angle)))
            if isinstance(motion, Rotation) and motion in tilted and _is_rough(motion, many=many)
            else motion
            for motion in placement
        )

    joints = tuple(
        replace(joint, before=changed(joint.before), after=changed(joint.after))
        for joint in robot.joints
    )
    return replace(robot, joints=joints, base=changed(robot.base), tool=changed(robot.tool))


def _is_rough(turn: Rotation, *, many: bool) -> bool:
    if turn.angle.free_symbols:
        return False
    return many or not (is_surd(sp.cos(turn.angle)) and is_surd(sp.sin(turn.angle)))
