"""The singular configurations of an arm in short symbols, with words for each."""

import math
from dataclasses import dataclass
from itertools import cycle

import sympy as sp

from ...chain.singular.conditions import Condition, conditions
from ...chain.singular.determinant import factored_minors
from ...chain.singular.factors import Factored
from ...chain.singular.nearest import nearest_singular
from ...chain.singular.postures import words
from ...model.robot import Robot
from .notation import Notation

MOST_ADDENDS = 12
"""Most terms of a factor that is shown."""
POSTURES = 4
"""Singular postures that are shown where the factors are longer."""
ANGLES = (20, -50, 70, 30, 40, -60, 10, 25)
"""Angles (degree) of the joints of the posture from which the first one is looked for, in turn."""


@dataclass(frozen=True)
class PrintedCondition:
    """Factors that are 0 at once in singular configurations.

    Attributes:
        factors: In short symbols.
        words: How the axes stand there; empty where no words fit.
    """

    factors: tuple[sp.Expr, ...]
    words: str


@dataclass(frozen=True)
class PrintedSingularities:
    """The singular configurations of an arm.

    Attributes:
        determinant: The constant of the determinant and its factors with their powers, where the
            Jacobian is square and they are short.
        conditions: The conditions under which the arm is singular.
        postures: Singular postures (radian, metre), where there are no short conditions.
    """

    determinant: tuple[sp.Expr, tuple[tuple[sp.Expr, int], ...]] | None
    conditions: tuple[PrintedCondition, ...]
    postures: tuple[tuple[float, ...], ...] = ()


def printed_singularities(robot: Robot, notation: Notation) -> PrintedSingularities:
    """The singular configurations of a robot, as conditions, or as postures found in numbers."""
    minors = factored_minors(robot, notation.q)
    if minors is not None and all(map(_is_short, minors)):
        if len(minors) == 1:
            return _of_determinant(robot, notation, minors[0])
        values = {parameter.symbol: parameter.value for parameter in robot.parameters}
        found = conditions(minors, notation.q, values)
        if found:
            return PrintedSingularities(None, _printed(robot, notation, found))
    start = [
        math.radians(angle) if joint.unit == "rad" else 0.0
        for joint, angle in zip(robot.moving, cycle(ANGLES), strict=False)
    ]
    postures = nearest_singular(robot, start, POSTURES)
    return PrintedSingularities(None, (), tuple(tuple(map(float, q)) for q in postures))


def _is_short(minor: Factored) -> bool:
    return all(len(sp.Add.make_args(factor)) <= MOST_ADDENDS for factor, _ in minor.factors)


def _of_determinant(robot: Robot, notation: Notation, found: Factored) -> PrintedSingularities:
    constant = -found.constant if found.constant.could_extract_minus_sign() else found.constant
    factors = tuple((_short(factor, notation), power) for factor, power in found.factors)
    each = _printed(robot, notation, tuple((factor,) for factor, _ in found.factors))
    return PrintedSingularities((_short(constant, notation), factors), each)


def _printed(
    robot: Robot, notation: Notation, found: tuple[Condition, ...]
) -> tuple[PrintedCondition, ...]:
    return tuple(
        PrintedCondition(
            tuple(_short(factor, notation) for factor in condition),
            words(robot, notation.q, condition),
        )
        for condition in found
    )


def _short(factor: sp.Expr, notation: Notation) -> sp.Expr:
    functions = sorted(factor.atoms(sp.cos, sp.sin), key=str)
    return factor.xreplace({function: notation.trigonometric(function) for function in functions})
