"""Subproblems of prismatic joints.

Plane: The equation ``h.(p + t u) = d`` for a point p and a direction u has one solution, ``t = (d -
h.p) / (h.u)``. The direction u must not be parallel to the plane.

Sphere: Let p' be the part of p that is perpendicular to the unit vector u. The equation ``|p + t u|
= r`` has the solutions ``t = -u.p +- sqrt(r^2 - |p'|^2)``. If the radicand is negative, the square
root is replaced by 0, which gives the point of the line nearest to the sphere.

Source: elementary; Elias and Wen 2022 do not treat prismatic joints.
"""

import sympy as sp

from ...model.tolerances import MEETING_SOLUTIONS
from ...terms.terms import Terms
from ...terms.vectors import Vector, dot
from .equations import LineAndPlane, LineAndSphere
from .found import FoundLength
from .sp4 import ratio
from .turns import perpendicular


def slide_to_plane(terms: Terms, h: Vector, u: Vector, p: Vector, d: sp.Expr) -> FoundLength:
    """Solve for the displacement along u that moves the point p to the plane h.p = d."""
    rate, rest = dot(terms, h, u), terms.let(d - dot(terms, h, p))
    return FoundLength(terms.let(rest / rate), LineAndPlane(rate, -rest))


def slide_to_sphere(
    terms: Terms, u: Vector, p: Vector, r2: sp.Expr, sign: sp.Symbol
) -> FoundLength:
    """Solve for the displacement along the unit vector u that moves p to the sphere p.p = r2."""
    along, across = dot(terms, u, p), perpendicular(terms, u, p)
    across2 = dot(terms, across, across)
    xi2 = terms.let(r2 - across2)
    size = terms.let(r2 + across2)
    # Two solutions that differ only by rounding errors are merged, as in subproblem 4.
    xi = terms.let(
        sp.Piecewise(
            (sp.sqrt(xi2), xi2 > terms.let(MEETING_SOLUTIONS * size)),
            (sp.Integer(0), True),
            evaluate=False,
        )
    )
    length = terms.let(sign * xi - along)
    equation = LineAndSphere(2 * along, terms.let(along**2 - xi2))
    return FoundLength(length, equation, sign, ratio(terms, xi2, size))
