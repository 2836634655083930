"""Vectors and axes of frames whose components are named in a scope.

A component that is zero by structure stays zero and costs nothing, here and in the generated C.
"""

from collections.abc import Iterable, Sequence

import sympy as sp

from .scope import Scope

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
Basis = tuple[Vector, Vector, Vector]
"""Three column vectors: the axes of one frame in another, a rotation matrix by columns."""

ZERO, ONE = sp.Integer(0), sp.Integer(1)
ORIGIN: Vector = (ZERO, ZERO, ZERO)
IDENTITY: Basis = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


def named(scope: Scope, components: Iterable[sp.Expr]) -> Vector:
    """The names of three components."""
    x, y, z = (scope.let(component) for component in components)
    return x, y, z


def turned_about_z(scope: Scope, basis: Basis, c: sp.Expr, s: sp.Expr) -> Basis:
    """``R Rz(angle)`` for an angle of cosine c and sine s."""
    x, y, z = basis
    return combination(scope, (c, s), (x, y)), combination(scope, (c, -s), (y, x)), z


def turned_about_x(scope: Scope, basis: Basis, c: sp.Expr, s: sp.Expr) -> Basis:
    """``R Rx(angle)`` for an angle of cosine c and sine s."""
    x, y, z = basis
    return x, combination(scope, (c, s), (y, z)), combination(scope, (c, -s), (z, y))


def combination(scope: Scope, weights: Sequence[sp.Expr], vectors: Sequence[Vector]) -> Vector:
    """The named sum of weighted vectors."""
    return named(
        scope,
        (sum((w * v[k] for w, v in zip(weights, vectors, strict=True)), ZERO) for k in range(3)),
    )


def added(scope: Scope, a: Vector, b: Vector) -> Vector:
    """The named sum of two vectors."""
    return named(scope, (u + v for u, v in zip(a, b, strict=True)))


def subtracted(scope: Scope, a: Vector, b: Vector) -> Vector:
    """The named difference of two vectors."""
    return named(scope, (u - v for u, v in zip(a, b, strict=True)))


def cross(scope: Scope, a: Vector, b: Vector) -> Vector:
    """The named cross product of two vectors."""
    return named(scope, (a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)))


def rotated_z(scope: Scope, vector: Vector, c: sp.Expr, s: sp.Expr) -> Vector:
    """``Rz(angle) v`` for an angle of cosine c and sine s."""
    x, y, z = vector
    return scope.let(c * x - s * y), scope.let(s * x + c * y), z


def rotated_x(scope: Scope, vector: Vector, c: sp.Expr, s: sp.Expr) -> Vector:
    """``Rx(angle) v`` for an angle of cosine c and sine s."""
    x, y, z = vector
    return x, scope.let(c * y - s * z), scope.let(s * y + c * z)


def dot(scope: Scope, a: Vector, b: Vector) -> sp.Expr:
    """The named scalar product of two vectors."""
    return scope.let(sum((u * v for u, v in zip(a, b, strict=True)), ZERO))
