"""The prismatic subproblems: a slide that brings a point into a plane or onto a sphere.

Plane: ``h . (p + t u) = d``, so ``t = (d - h . p) / (h . u)``, one solution; u must not lie in the
plane.

Sphere: ``|p + t u| = r`` with a unit vector u: ``t = -u . p +- sqrt(r^2 - |p'|^2)`` with p' the
part of p across u. Out of reach the root is 0, the nearest that the line comes to the sphere.

Source: Elias and Wen 2022 have no slides; the formulas are elementary.
"""

import sympy as sp

from ...scope import Scope
from ...vectors import Vector, dot
from ..found import FoundLength
from ..turns import perpendicular
from .sp4 import MEETING, ratio


def slide_to_plane(scope: Scope, h: Vector, u: Vector, p: Vector, d: sp.Expr) -> FoundLength:
    """The slide along u that gives a point the part d along h."""
    rate, rest = dot(scope, h, u), scope.let(d - dot(scope, h, p))
    return FoundLength(scope.let(rest / rate), (rate, -rest))


def slide_to_sphere(
    scope: Scope, u: Vector, p: Vector, r2: sp.Expr, sign: sp.Symbol
) -> FoundLength:
    """The slide along the unit vector u after which p has the squared length r2."""
    along, across = dot(scope, u, p), perpendicular(scope, u, p)
    across2 = dot(scope, across, across)
    xi2 = scope.let(r2 - across2)
    size = scope.let(r2 + across2)
    # As in subproblem 4: two solutions that differ by rounding alone are one.
    xi = scope.let(
        sp.Piecewise(
            (sp.sqrt(xi2), xi2 > scope.let(MEETING * size)), (sp.Integer(0), True), evaluate=False
        )
    )
    length = scope.let(sign * xi - along)
    equation = (sp.Integer(1), 2 * along, scope.let(along**2 - xi2))
    return FoundLength(length, equation, sign, ratio(scope, xi2, size))
