"""Equations of the subproblems, with coefficients and solutions.

Each solution step stores its equation. The LaTeX article prints this equation, and a test evaluates
the equation numerically.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import sympy as sp

from ...terms.vectors import Vector

Pair = tuple[sp.Expr, sp.Expr]
Rows = tuple[Pair, Pair]


@dataclass(frozen=True)
class Equation:
    """Base class of equations.

    The fields of each subclass are the coefficients of the equation: numbers, vectors or matrix
    rows.
    """

    @property
    def coefficients(self) -> tuple[sp.Expr, ...]:
        """The coefficients of the equation, in the order of the dataclass fields.

        The tuple lists the coefficients of vectors and matrix rows entry by entry.
        """
        return tuple(sp.flatten(getattr(self, field.name) for field in fields(self)))

    def with_coefficients(self, values: Sequence[sp.Expr]) -> Self:
        """Return an equation of the same type with other coefficients."""
        left = iter(values)
        return type(self)(*(_filled(getattr(self, field.name), left) for field in fields(self)))


def _filled(shape: Any, left: Iterator[sp.Expr]) -> Any:
    return tuple(_filled(part, left) for part in shape) if isinstance(shape, tuple) else next(left)


@dataclass(frozen=True)
class Linear(Equation):
    """The equation ``a cos(theta) + b sin(theta) = d``, which has up to two solutions."""

    a: sp.Expr
    b: sp.Expr
    d: sp.Expr

    @property
    def mirrored(self) -> Self:
        """Return the equation of the opposite angle."""
        return type(self)(self.a, -self.b, self.d)

    def solution(self, sign: sp.Expr) -> tuple[sp.Expr, ...]:
        """Return the terms whose sum is the angle.

        The sign (1 or -1) selects one of two angles.

        If the coefficients a and b are both 0, the returned angle is 0.
        """
        if self.a == self.b == 0:
            return (sp.Integer(0),)
        middle = sp.atan2(self.b, self.a, evaluate=False)
        if self.d == 0:
            return middle, sign * sp.pi / 2
        root = sp.sqrt(self.a**2 + self.b**2 - self.d**2)
        return middle, sign * sp.atan2(root, self.d, evaluate=False)


@dataclass(frozen=True)
class Direction(Equation):
    """The equation ``(cos(theta), sin(theta)) = (a, b) / sqrt(a^2 + b^2)``, with one solution."""

    a: sp.Expr
    b: sp.Expr

    @property
    def mirrored(self) -> Self:
        """Return the equation of the opposite angle."""
        return type(self)(self.a, -self.b)

    def solution(self, _: sp.Expr) -> tuple[sp.Expr, ...]:
        """Return the angle."""
        return (sp.atan2(self.b, self.a, evaluate=False),)


@dataclass(frozen=True)
class LineAndPlane(Equation):
    """The equation ``rate t + rest = 0`` for the displacement t of a prismatic joint."""

    rate: sp.Expr
    rest: sp.Expr

    @property
    def mirrored(self) -> Self:
        """Return the equation whose unknown is the opposite displacement -t."""
        return type(self)(-self.rate, self.rest)

    def solution(self, _: sp.Expr) -> tuple[sp.Expr, ...]:
        """Return the displacement as the terms of a sum."""
        return tuple(sp.Add.make_args(-self.rest / self.rate))


@dataclass(frozen=True)
class LineAndSphere(Equation):
    """The equation ``t^2 + linear t + constant = 0`` for a prismatic displacement t."""

    linear: sp.Expr
    constant: sp.Expr

    @property
    def mirrored(self) -> Self:
        """Return the equation whose unknown is the opposite displacement -t."""
        return type(self)(-self.linear, self.constant)

    def solution(self, sign: sp.Expr) -> tuple[sp.Expr, ...]:
        """Return the displacement as the terms of a sum.

        The sign (1 or -1) selects one of the two displacements.
        """
        half = self.linear / 2
        root = sign * sp.sqrt(half**2 - self.constant)
        return (root,) if half == 0 else (-half, root)


@dataclass(frozen=True)
class LoopOfThree(Equation):
    """The vector equation ``p0 + R(k1, theta1) p1 = R(k2, theta2) (p2 + R(k3, theta3) p3)``.

    Subproblem 5 solves this equation for all three angles together.
    """

    p0: Vector
    k1: Vector
    p1: Vector
    k2: Vector
    p2: Vector
    k3: Vector
    p3: Vector


@dataclass(frozen=True)
class TwoEllipses(Equation):
    """The two equations ``A1 (sin, cos)(theta1) + A2 (sin, cos)(theta2) = b``.

    Subproblem 6 solves both equations for the two angles together.

    Attributes:
        first: The matrix A1, with one row per equation.
        second: The matrix A2, with one row per equation.
        right: The right-hand sides b.
    """

    first: Rows
    second: Rows
    right: Pair


AngleEquation = Linear | Direction
"""Equation for one angle of a revolute joint."""
LengthEquation = LineAndPlane | LineAndSphere
"""Equation for the displacement of a prismatic joint."""
JointEquation = LoopOfThree | TwoEllipses
"""Equations that determine several joint angles through a single quartic equation."""
