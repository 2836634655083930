"""The result of a subproblem: a turn or a length, its margin, and the equation that it solves."""

from dataclasses import dataclass

import sympy as sp

from .equations import AngleEquation, JointEquation, LengthEquation
from .turns import CosSin


@dataclass(frozen=True)
class FoundTurn:
    """An angle that a subproblem gives.

    Attributes:
        turn: Its cosine and sine.
        equation: The equation that it solves.
        sign: The symbol that stands for 1 or -1 and chooses among two solutions, if there are two.
        margin: sin^2 of half the angle between the two solutions: 0 where they meet, negative out
            of reach, where the turn is the least-squares answer; None where it always exists.
    """

    turn: CosSin
    equation: AngleEquation | JointEquation
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None


@dataclass(frozen=True)
class FoundLength:
    """The length of a slide that a subproblem gives.

    Attributes:
        length: Its value (metre).
        equation: The equation that it solves.
        sign: The symbol that chooses among two solutions, if there are two.
        margin: 0 where the two solutions meet, negative out of reach, relative to the squares of
            the lengths that enter; None where the length always exists.
    """

    length: sp.Expr
    equation: LengthEquation
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None
