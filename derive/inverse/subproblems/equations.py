"""Equations of the subproblems as data: coefficients and solutions.

Each solution step stores its equation. The article prints its coefficients, relation and solution;
a test evaluates them numerically.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import sympy as sp

from ...terms.vectors import Vector

Pair = tuple[sp.Expr, sp.Expr]
Rows = tuple[Pair, Pair]


@dataclass(frozen=True)
class Linear:
    """The equation ``a cos(theta) + b sin(theta) = d``; up to two solutions."""

    a: sp.Expr
    b: sp.Expr
    d: sp.Expr

    @property
    def coefficients(self) -> tuple[sp.Expr, ...]:
        """Coefficients a, b and d."""
        return self.a, self.b, self.d

    def with_coefficients(self, values: Sequence[sp.Expr]) -> Self:
        """Returns the same type of equation with the given coefficients."""
        return type(self)(*values)

    @property
    def mirrored(self) -> Self:
        """Returns the equation of the opposite angle."""
        return type(self)(self.a, -self.b, self.d)

    def solution(self, sign: sp.Expr) -> tuple[sp.Expr, ...]:
        """Returns the terms whose sum is the angle; the sign (1 or -1) selects a solution.

        The angle is 0 if the equation does not contain it.
        """
        if self.a == self.b == 0:
            return (sp.Integer(0),)
        middle = sp.atan2(self.b, self.a, evaluate=False)
        if self.d == 0:
            return middle, sign * sp.pi / 2
        root = sp.sqrt(self.a**2 + self.b**2 - self.d**2)
        return middle, sign * sp.atan2(root, self.d, evaluate=False)


@dataclass(frozen=True)
class Direction:
    """The equation ``cos(theta) : sin(theta) = a : b``; one solution."""

    a: sp.Expr
    b: sp.Expr

    @property
    def coefficients(self) -> tuple[sp.Expr, ...]:
        """Coefficients a and b."""
        return self.a, self.b

    def with_coefficients(self, values: Sequence[sp.Expr]) -> Self:
        """Returns the same type of equations with the given coefficients."""
        return type(self)(*values)

    @property
    def mirrored(self) -> Self:
        """Returns the equation of the opposite angle."""
        return type(self)(self.a, -self.b)

    def solution(self, _: sp.Expr) -> tuple[sp.Expr, ...]:
        """Returns the angle."""
        return (sp.atan2(self.b, self.a, evaluate=False),)


@dataclass(frozen=True)
class LineAndPlane:
    """The equation ``rate t + rest = 0`` for the displacement t of a prismatic joint."""

    rate: sp.Expr
    rest: sp.Expr

    @property
    def coefficients(self) -> tuple[sp.Expr, ...]:
        """Coefficients ``rate`` and ``rest``."""
        return self.rate, self.rest

    def with_coefficients(self, values: Sequence[sp.Expr]) -> Self:
        """Returns the same type of equation with the given coefficients."""
        return type(self)(*values)

    @property
    def mirrored(self) -> Self:
        """Returns the equation of the opposite displacement."""
        return type(self)(-self.rate, self.rest)

    def solution(self, _: sp.Expr) -> tuple[sp.Expr, ...]:
        """Returns the terms whose sum is the displacement."""
        return tuple(sp.Add.make_args(-self.rest / self.rate))


@dataclass(frozen=True)
class LineAndSphere:
    """The equation ``t^2 + linear t + constant = 0`` for a prismatic displacement t."""

    linear: sp.Expr
    constant: sp.Expr

    @property
    def coefficients(self) -> tuple[sp.Expr, ...]:
        """Linear and constant coefficients."""
        return self.linear, self.constant

    def with_coefficients(self, values: Sequence[sp.Expr]) -> Self:
        """Returns the same type of equation with the given coefficients."""
        return type(self)(*values)

    @property
    def mirrored(self) -> Self:
        """Returns the equation of the opposite displacement."""
        return type(self)(-self.linear, self.constant)

    def solution(self, sign: sp.Expr) -> tuple[sp.Expr, ...]:
        """Returns the terms whose sum is the displacement; the sign selects a solution."""
        half = self.linear / 2
        root = sign * sp.sqrt(half**2 - self.constant)
        return (root,) if half == 0 else (-half, root)


@dataclass(frozen=True)
class LoopOfThree:
    """The equation ``p0 + R(k1, theta1) p1 = R(k2, theta2) (p2 + R(k3, theta3) p3)``.

    Subproblem 5 solves all three angles together.
    """

    p0: Vector
    k1: Vector
    p1: Vector
    k2: Vector
    p2: Vector
    k3: Vector
    p3: Vector

    @property
    def coefficients(self) -> tuple[sp.Expr, ...]:
        """Components of all vectors, in the order of the fields."""
        vectors = (self.p0, self.k1, self.p1, self.k2, self.p2, self.k3, self.p3)
        return tuple(component for vector in vectors for component in vector)

    def with_coefficients(self, values: Sequence[sp.Expr]) -> Self:
        """Returns the same type of equation with the given vectors."""
        vectors = [(values[k], values[k + 1], values[k + 2]) for k in range(0, len(values), 3)]
        return type(self)(*vectors)


@dataclass(frozen=True)
class TwoEllipses:
    """The equations ``A1 (sin, cos)(theta1) + A2 (sin, cos)(theta2) = b``.

    Subproblem 6 solves both angles together.

    Attributes:
        first: A1, one row per equation.
        second: A2.
        right: b.
    """

    first: Rows
    second: Rows
    right: Pair

    @property
    def coefficients(self) -> tuple[sp.Expr, ...]:
        """Entries of A1 and A2 (row by row) and b."""
        rows = (*self.first, *self.second, self.right)
        return tuple(entry for row in rows for entry in row)

    def with_coefficients(self, values: Sequence[sp.Expr]) -> Self:
        """Returns the same type of equations with the given coefficients."""
        a, b, c, d, e = ((values[k], values[k + 1]) for k in range(0, len(values), 2))
        return type(self)((a, b), (c, d), e)


AngleEquation = Linear | Direction
"""Equation for one angle."""
LengthEquation = LineAndPlane | LineAndSphere
"""Equation for the displacement of a prismatic joint."""
JointEquation = LoopOfThree | TwoEllipses
"""Equations for several angles, solved together by a quartic."""
