"""The determinant of an arm's Jacobian in short symbols, with words for each of its factors."""

from dataclasses import dataclass

import sympy as sp

from ...chain.singular.determinant import determinant
from ...chain.singular.postures import words
from ...model.robot import Robot
from .notation import Notation


@dataclass(frozen=True)
class PrintedFactor:
    """A factor of the determinant.

    Attributes:
        expression: In short symbols.
        power: Its power in the determinant.
        words: How the axes stand where it is 0; empty where no words fit.
    """

    expression: sp.Expr
    power: int
    words: str


@dataclass(frozen=True)
class PrintedDeterminant:
    """A determinant, up to its sign, as a constant and factors that depend on the coordinates."""

    constant: sp.Expr
    factors: tuple[PrintedFactor, ...]


def printed_determinant(robot: Robot, notation: Notation) -> PrintedDeterminant | None:
    """The factored determinant of a robot's Jacobian; None where it does not factor."""
    found = determinant(robot, notation.q)
    if found is None:
        return None
    factors = tuple(
        PrintedFactor(_short(factor, notation), power, words(robot, notation.q, factor))
        for factor, power in found.factors
    )
    constant = -found.constant if found.constant.could_extract_minus_sign() else found.constant
    return PrintedDeterminant(constant, factors)


def _short(factor: sp.Expr, notation: Notation) -> sp.Expr:
    functions = sorted(factor.atoms(sp.cos, sp.sin), key=str)
    return factor.xreplace({function: notation.trigonometric(function) for function in functions})
