"""Result of a subproblem."""

from dataclasses import dataclass

import sympy as sp

from .equations import AngleEquation, JointEquation, LengthEquation
from .turns import CosSin


@dataclass(frozen=True)
class FoundTurn:
    """An angle that a subproblem solves for.

    Attributes:
        turn: Cosine and sine of the angle.
        equation: The solved equation.
        sign: Symbol (1 or -1) that selects one of two solutions, or None if there is one solution.
        margin: The squared sine of half the angle between the two solutions, which is 0 for a
            double solution. If there is no solution, the margin is negative and the angle is the
            least-squares solution. The margin is None if a solution always exists.
    """

    turn: CosSin
    equation: AngleEquation | JointEquation
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None


@dataclass(frozen=True)
class FoundLength:
    """The solution of a subproblem for the displacement of a prismatic joint.

    Attributes:
        length: The displacement (meter).
        equation: The solved equation.
        sign: Symbol (1 or -1) that selects one of two solutions, or None if there is one solution.
        margin: The margin is 0 for a double solution, and negative if there is no solution. The
            margin is divided by the squared input lengths. The margin is None if a solution always
            exists.
    """

    length: sp.Expr
    equation: LengthEquation
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None
