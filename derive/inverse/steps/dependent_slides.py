"""Prismatic joints whose directions may become linearly dependent.

Prismatic joints with linearly dependent directions move a point only along a line or in a plane, so
many joint displacements reach the same target. The prismatic joints are solved in succession, and
each joint compensates the rounding errors of the joints before it. The displacement of each joint
solves a scalar equation for one component of the point position. If the joint does not change this
component, its displacement is 0.
"""

from collections.abc import Callable, Iterator, Sequence

import sympy as sp
from sympy.logic.boolalg import Boolean

from ...model.tolerances import DIRECTION_FLOOR, OBLIQUE_AXES
from ...terms.terms import Terms
from ...terms.vectors import Vector, combination, cross, dot, subtracted
from ..subproblems.equations import LineAndPlane
from ..subproblems.found import FoundLength
from ..subproblems.quartic import select
from ..subproblems.turns import perpendicular

DEPENDENT_SLIDES = sp.Float("1e-14", 20)
"""Maximum sine of the angle at which prismatic joints count as linearly dependent.

The angle is measured between two joint directions, or between one joint direction and the plane of
two other joint directions.
"""
_TRIPLE = 3
OneOf = Callable[..., sp.Expr]
"""Type of a function that returns one of its three arguments. The three arguments of the function
belong to the three cyclic orders of three directions."""


def dependent_lengths(
    terms: Terms, directions: Sequence[Vector], displacement: Vector
) -> list[sp.Expr]:
    """Return the displacements of up to three prismatic joints that move a point by a vector.

    Args:
        terms: Table of named terms.
        directions: The unit directions of the joints.
        displacement: The displacement vector. The joints produce only its component in the span of
            the joint directions.
    """
    if len(directions) < _TRIPLE:
        return [found.length for found in in_order(terms, directions, displacement)]
    one_of, ordered = _widest_last(terms, directions)
    u, v, w = (found.length for found in in_order(terms, ordered, displacement))
    return [one_of(u, w, v), one_of(v, u, w), one_of(w, v, u)]


def may_be_dependent(terms: Terms, directions: Sequence[Vector]) -> bool:
    """Whether three directions may lie in one plane for some values of fixed joints."""
    if len(directions) < _TRIPLE:
        return False
    first, second, third = directions
    return not terms.is_constant(dot(terms, normal_to_both(terms, first, second), third))


def are_nearly_dependent(terms: Terms, directions: Sequence[Vector]) -> Boolean:
    """Return the condition that three directions nearly lie in one plane."""
    _, (first, second, third) = _widest_last(terms, directions)
    rate = dot(terms, common_normal(terms, third, second), first)
    return sp.Le(terms.let(rate**2), terms.let(sp.Float(OBLIQUE_AXES, 20) ** 2))


def plane_normal(terms: Terms, directions: Sequence[Vector]) -> Vector:
    """Return the unit normal of three directions that lie in one plane."""
    _, (_, second, third) = _widest_last(terms, directions)
    return common_normal(terms, third, second)


def _widest_last(terms: Terms, directions: Sequence[Vector]) -> tuple[OneOf, list[Vector]]:
    """Permute three directions cyclically.

    The returned values are a selector function and the permuted directions.

    The sine of the angle between two directions is largest for the last two permuted directions.
    The selector function takes three arguments and returns argument k, where ``directions[k]`` is
    the first permuted direction.
    """
    squares = [squared_sine(terms, directions[k - 2], directions[k - 1]) for k in range(_TRIPLE)]
    is_first = sp.And(squares[0] >= squares[1], squares[0] >= squares[2])
    is_second = squares[1] >= squares[2]

    def one_of(*values: sp.Expr) -> sp.Expr:
        return _if(terms, is_first, values[0], _if(terms, is_second, values[1], values[2]))

    h = list(directions)
    orders = [h[k:] + h[:k] for k in range(_TRIPLE)]
    return one_of, [_each(one_of, *vectors) for vectors in zip(*orders, strict=True)]


def in_order(
    terms: Terms, directions: Sequence[Vector], displacement: Vector
) -> Iterator[FoundLength]:
    """Yield the displacements of the prismatic joints from the first joint to the last.

    The equation of each joint uses the displacement component along a direction that is
    perpendicular to all later prismatic joints.
    """
    for k, u in enumerate(directions):
        normal = _normal(terms, u, directions[k + 1 :])
        rate, rest = dot(terms, normal, u), dot(terms, normal, displacement)
        length = terms.let(rest * rate / terms.let(rate**2 + DEPENDENT_SLIDES**2))
        yield FoundLength(length, LineAndPlane(rate, -rest))
        moved = combination(terms, (length,), (u,))
        displacement = subtracted(terms, displacement, moved)


def _normal(terms: Terms, direction: Vector, later: Sequence[Vector]) -> Vector:
    match later:
        case []:
            return direction
        case [only]:
            return unit_across(terms, only, direction)
        case [second, third]:
            return common_normal(terms, third, second)
    raise AssertionError(later)


def normal_to_both(terms: Terms, a: Vector, b: Vector) -> Vector:
    """Return the cross product of two vectors.

    The entries of the cross product are expanded so that terms with opposite signs cancel.
    """
    x, y, z = sp.Matrix([terms.spelled(e) for e in a]).cross(
        sp.Matrix([terms.spelled(e) for e in b])
    )
    return terms.let(x), terms.let(y), terms.let(z)


def common_normal(terms: Terms, k: Vector, v: Vector) -> Vector:
    """Return a unit vector perpendicular to two unit vectors, which may be nearly parallel."""
    return cross(terms, unit_across(terms, k, v), k)


def unit_across(terms: Terms, k: Vector, v: Vector) -> Vector:
    """Return the unit vector along the part of ``v`` perpendicular to the unit vector ``k``.

    A second projection keeps the returned vector perpendicular to ``k`` if ``v`` and ``k`` are
    nearly parallel.
    """
    across = _unit(terms, perpendicular(terms, k, v))
    return _unit(terms, perpendicular(terms, k, across))


def _unit(terms: Terms, v: Vector) -> Vector:
    """Return a vector divided by its length, or a zero vector unchanged."""
    inverse = terms.let(1 / terms.let(sp.sqrt(terms.let(dot(terms, v, v) + DIRECTION_FLOOR))))
    return combination(terms, (inverse,), (v,))


def squared_sine(terms: Terms, a: Vector, b: Vector) -> sp.Expr:
    """Return the squared sine of the angle between two unit vectors."""
    across = perpendicular(terms, a, b)
    return dot(terms, across, across)


def _each(one_of: OneOf, *vectors: Vector) -> Vector:
    x, y, z = (one_of(*components) for components in zip(*vectors, strict=True))
    return x, y, z


def _if(terms: Terms, condition: Boolean, one: sp.Expr, other: sp.Expr) -> sp.Expr:
    if condition in (sp.true, sp.false):
        return one if condition is sp.true else other
    return select(terms, condition, one, other)
