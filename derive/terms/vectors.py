"""Vectors and frames whose components are named terms.

Components that are always zero stay 0 and need no operation in the generated C.
"""

from collections.abc import Iterable, Sequence

import sympy as sp

from .terms import Terms

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
Basis = tuple[Vector, Vector, Vector]
"""The three axes of a frame, as column vectors in another frame."""

ZERO, ONE = sp.Integer(0), sp.Integer(1)
ORIGIN: Vector = (ZERO, ZERO, ZERO)
IDENTITY: Basis = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


def named(terms: Terms, components: Iterable[sp.Expr]) -> Vector:
    """Name the components of a vector."""
    x, y, z = (terms.let(component) for component in components)
    return x, y, z


def turned_about_z(terms: Terms, basis: Basis, c: sp.Expr, s: sp.Expr) -> Basis:
    """Return a frame rotated about its own z axis by an angle with cosine c and sine s."""
    x, y, z = basis
    return combination(terms, (c, s), (x, y)), combination(terms, (c, -s), (y, x)), z


def turned_about_x(terms: Terms, basis: Basis, c: sp.Expr, s: sp.Expr) -> Basis:
    """Return a frame rotated about its own x axis by an angle with cosine c and sine s."""
    x, y, z = basis
    return x, combination(terms, (c, s), (y, z)), combination(terms, (c, -s), (z, y))


def combination(terms: Terms, weights: Sequence[sp.Expr], vectors: Sequence[Vector]) -> Vector:
    """Return the sum of weighted vectors."""
    return named(
        terms,
        (_products(weights, [vector[k] for vector in vectors]) for k in range(3)),
    )


def added(terms: Terms, a: Vector, b: Vector) -> Vector:
    """Return the sum of two vectors."""
    return named(terms, (u + v for u, v in zip(a, b, strict=True)))


def subtracted(terms: Terms, a: Vector, b: Vector) -> Vector:
    """Return the difference of two vectors."""
    return named(terms, (u - v for u, v in zip(a, b, strict=True)))


def cross(terms: Terms, a: Vector, b: Vector) -> Vector:
    """Return the cross product of two vectors."""
    pairs = (((a[k - 2], -a[k - 1]), (b[k - 1], b[k - 2])) for k in range(3))
    return named(terms, (_products(u, v) for u, v in pairs))


def rotated_z(terms: Terms, vector: Vector, c: sp.Expr, s: sp.Expr) -> Vector:
    """Return a vector rotated about the z axis by an angle with cosine c and sine s."""
    x, y, z = vector
    return terms.let(_products((c, -s), (x, y))), terms.let(_products((s, c), (x, y))), z


def rotated_x(terms: Terms, vector: Vector, c: sp.Expr, s: sp.Expr) -> Vector:
    """Return a vector rotated about the x axis by an angle with cosine c and sine s."""
    x, y, z = vector
    return x, terms.let(_products((c, -s), (y, z))), terms.let(_products((s, c), (y, z)))


def dot(terms: Terms, a: Vector, b: Vector) -> sp.Expr:
    """Return the scalar product of two vectors."""
    return terms.let(_products(a, b))


def _products(a: Sequence[sp.Expr], b: Sequence[sp.Expr]) -> sp.Expr:
    """Return the sum of the products of two lists.

    Products with 0 or 1 and sums of a single product are simplified without SymPy, because SymPy is
    slow.
    """
    pairs = zip(a, b, strict=True)
    products = [_product(u, v) for u, v in pairs if u is not ZERO and v is not ZERO]
    return products[0] if len(products) == 1 else sp.Add(*products)


def _product(u: sp.Expr, v: sp.Expr) -> sp.Expr:
    if u is ONE:
        return v
    return u if v is ONE else u * v
