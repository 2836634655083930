"""Converts screw axes and home pose to short symbols: exact if short, else decimal.

With general angles, every joint adds terms to the product. If the cosine or sine of a numeric angle
is not a short root, it becomes a decimal at 40-digit precision before multiplication. Angles that
are parameters create shared terms.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

import sympy as sp

from ...chain.poe import product_of_exponentials
from ...model.robot import Placement, Rotation, SerialRobot
from ...model.tolerances import ROUNDING
from ...model.values import Values, to_digits
from .notation import Notation, is_surd

MAX_TILTS = 3
"""Maximum number of constant angles (except right angles) with cosines and sines in roots."""


@dataclass(frozen=True)
class Screws:
    """The product of exponentials of a robot in short symbols.

    Attributes:
        definitions: Shared terms of the entries, each in terms of earlier ones.
        S: Screw axes (6, moving joints).
        M: Home pose (4, 4).
    """

    definitions: tuple[tuple[sp.Symbol, sp.Expr], ...]
    S: sp.ImmutableMatrix
    M: sp.ImmutableMatrix


class _Decimal(Rotation):
    """A rotation by a decimal angle, which a description must not contain."""

    def __post_init__(self) -> None:
        """Stores the decimal, which is not an exact number."""


def printed_screws(robot: SerialRobot, notation: Notation) -> Screws:
    """Returns screw axes and home pose in short symbols."""
    S, M = product_of_exponentials(_with_decimals(robot))
    definitions: list[tuple[sp.Symbol, sp.Expr]] = []
    known: dict[sp.Symbol, sp.Expr] = {}
    replacements, (S, M) = sp.cse([S, M], symbols=_symbols(), order="none")
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


def _symbols() -> Iterator[sp.Symbol]:
    return (sp.Symbol(f"_{k}", real=True) for k in count())


def _short(expression: sp.Expr, notation: Notation) -> sp.Expr:
    """Returns an expression in short symbols, with integers for equal decimals."""
    rounded = {}
    for number in expression.atoms(sp.Float):
        nearest = sp.Integer(round(number))
        if abs(number - nearest) < ROUNDING:
            rounded[number] = nearest
    return notation.shortened(expression.xreplace(rounded))


def _varies(robot: SerialRobot) -> bool:
    """Whether some angles depend on parameters."""
    return any(turn.angle.free_symbols for turn in _turns(robot))


def _turns(robot: SerialRobot) -> list[Rotation]:
    return [motion for part in robot.placements for motion in part if isinstance(motion, Rotation)]


def _with_decimals(robot: SerialRobot) -> SerialRobot:
    """Returns the robot with decimals for angles whose cosines and sines are not short roots."""
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
