"""Prismatic subproblems: a translation moves a point into a plane or onto a sphere.

Plane: The equation ``h.(p + t u) = d`` for a point p and a direction u gives ``t = (d - h.p) /
(h.u)``, the only solution. The direction u must not lie in the plane.

Sphere: The equation ``|p + t u| = r`` with a unit vector u gives ``t = -u.p +- sqrt(r^2 -
|p'|^2)``, where p' is the component of p perpendicular to u. If no real root exists, the root term
is set to 0, which gives the point of the line nearest to the sphere.

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
    """Solves for the displacement along u after which a point has the component d along h."""
    rate, rest = dot(terms, h, u), terms.let(d - dot(terms, h, p))
    return FoundLength(terms.let(rest / rate), LineAndPlane(rate, -rest))


def slide_to_sphere(
    terms: Terms, u: Vector, p: Vector, r2: sp.Expr, sign: sp.Symbol
) -> FoundLength:
    """Solves for the displacement along the unit vector u that gives p the squared length r2."""
    along, across = dot(terms, u, p), perpendicular(terms, u, p)
    across2 = dot(terms, across, across)
    xi2 = terms.let(r2 - across2)
    size = terms.let(r2 + across2)
    # As in subproblem 4, two solutions that differ only by rounding error are merged.
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
