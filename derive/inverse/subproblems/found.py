"""What a subproblem finds: a turn or a length, how far it is from its boundary, and why."""

from dataclasses import dataclass

import sympy as sp

from .turns import CosSin


@dataclass(frozen=True)
class Linear:
    """The equation ``a cos(theta) + b sin(theta) = d``, two angles up to a boundary."""

    a: sp.Expr
    b: sp.Expr
    d: sp.Expr


@dataclass(frozen=True)
class Direction:
    """The equations ``cos(theta) : sin(theta) = a : b``, one angle."""

    a: sp.Expr
    b: sp.Expr


@dataclass(frozen=True)
class Simultaneous:
    """Equations for several angles at once, as subproblems 5 and 6 state them.

    Attributes:
        number: 5 or 6, the subproblem.
        given: What it is given, by the names of its statement: vectors, or rows of coefficients.
    """

    number: int
    given: tuple[tuple[str, tuple[sp.Expr, ...]], ...]


@dataclass(frozen=True)
class FoundTurn:
    """An angle that a subproblem gives.

    Attributes:
        turn: Its cosine and sine.
        equation: What it solves, for the reader.
        sign: The symbol that stands for 1 or -1 and chooses among two solutions, if there are two.
        margin: sin^2 of half the angle between the two solutions: 0 where they meet, negative out
            of reach, where the turn is the least-squares answer; None where it always exists.
    """

    turn: CosSin
    equation: Linear | Direction | Simultaneous
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None


@dataclass(frozen=True)
class FoundLength:
    """The length of a slide that a subproblem gives.

    Attributes:
        length: Its value (metre).
        equation: Coefficients, highest power first, of the polynomial whose root it is.
        sign: As of a turn.
        margin: As of a turn, in relation to the lengths that enter.
    """

    length: sp.Expr
    equation: tuple[sp.Expr, ...]
    sign: sp.Symbol | None = None
    margin: sp.Expr | None = None
