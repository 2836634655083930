"""Result of a subproblem: an angle or a displacement, its margin, and the solved equation."""

from dataclasses import dataclass

import sympy as sp

from .equations import AngleEquation, JointEquation, LengthEquation
from .turns import CosSin


@dataclass(frozen=True)
class FoundTurn:
    """An angle solved by a subproblem.

    Attributes:
        turn: Cosine and sine of the angle.
        equation: The solved equation.
        sign: Symbol (1 or -1) that selects one of two solutions, or None if the solution is unique.
        margin: The squared sine of half the angle between the two solutions. The margin is 0 for a
            double solution, and negative without a solution; the angle is then the least-squares
            solution. The margin is None if a solution always exists.
    """

    turn: CosSin
    equation: AngleEquation | JointEquation
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None


@dataclass(frozen=True)
class FoundLength:
    """The displacement of a prismatic joint, solved by a subproblem.

    Attributes:
        length: The displacement (meter).
        equation: The solved equation.
        sign: Symbol (1 or -1) that selects one of two solutions, or None if the solution is unique.
        margin: The margin is 0 for a double solution, and negative without a solution. The margin
            is relative to the squared input lengths, or None if a solution always exists.
    """

    length: sp.Expr
    equation: LengthEquation
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None
