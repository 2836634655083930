"""Subproblem 3: a rotation after which the sum of two vectors has a known length.

Statement: The equation ``|p0 + R(k, theta) p| = D`` is solved for theta. For example, the distance
D between shoulder and wrist determines the elbow angle.

Derivation: theta changes only the angle between the components of p0 and R p perpendicular to k.
Let P and Q be the lengths of these perpendicular components, and phi the angle between the two
components. Let ``D'^2 = D^2 - (k.p0 + k.p)^2``. The cosine of phi follows from ``2 P Q cos(phi) =
D'^2 - P^2 - Q^2``, and the sine from Heron's form ``4 P^2 Q^2 sin^2(phi) = (D'^2 - (P - Q)^2) ((P +
Q)^2 - D'^2)``. Heron's form is accurate even for a folded elbow with P = Q. An elbow angle of 1e-10
rad that is computed from the cosine alone would have an error of 1e-8 rad. Two close solutions are
merged if a factor of Heron's form is smaller than the rounding error of D'^2 or (P + Q)^2. If
shoulder and wrist are close together, the small distance D' has full relative accuracy. Therefore,
the two solutions of a nearly folded elbow are not merged.

Boundary: the elbow is stretched at D' = P + Q and folded at D' = |P - Q|. If D' is larger than P +
Q or smaller than |P - Q|, D' is replaced by the nearer of these two values.

Degenerate: if P or Q is 0, the length of the sum does not depend on theta, and theta is set to 0.

Source: Elias and Wen 2022, subproblem 3, with the same formula for the cosine.
"""

import sympy as sp

from ...model.tolerances import MEETING_SOLUTIONS
from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, dot
from .found import FoundTurn
from .sp4 import near_line, on_line
from .turns import CosSin, perpendicular


def sp3(
    terms: Terms,
    k: Vector,
    p0: Vector,
    p: Vector,
    across2: sp.Expr,
    sign: sp.Symbol,
    rounding: sp.Expr | None = None,
) -> FoundTurn:
    """Return the rotation R about the unit vector k that gives ``p0 + R p`` a known length.

    Args:
        terms: Table of named terms.
        k: The axis.
        p0: The fixed vector.
        p: The rotated vector.
        across2: ``D'^2``, the squared length of the component of ``p0 + R p`` perpendicular to k.
            See ``squared_across``.
        sign: The sign of sin(phi), which selects one of the two angles.
        rounding: The number to which the rounding error of ``D'^2`` is proportional, by default
            ``D'^2`` itself. If ``D'^2`` is computed by subtracting a value from ``D^2``, pass
            ``D^2``.
    """
    (P2, Q2), (a, b, e) = _line(terms, k, p0, p, across2)
    is_constant = terms.is_constant(P2) and terms.is_constant(Q2)
    P, Q = (sp.sqrt(square) if is_constant else terms.let(sp.sqrt(square)) for square in (P2, Q2))
    least, most = terms.let((P - Q) ** 2), terms.let((P + Q) ** 2)
    above, below = terms.let(across2 - least), terms.let(most - across2)
    xi2 = terms.let(above * below)
    if is_constant and least != 0:
        return on_line(terms, a, b, e, sign, xi2)
    # Shoulder and wrist may coincide, so their distance is computed with full relative accuracy.
    opening = terms.let(
        above - terms.let(MEETING_SOLUTIONS * (across2 if rounding is None else rounding))
    )
    bend = terms.let(below - terms.let(MEETING_SOLUTIONS * most))
    are_two = terms.let(sp.Min(opening, bend, evaluate=False)) > 0
    if is_constant:
        return on_line(terms, a, b, e, sign, xi2, are_two)
    # If P is only a rounding error, a^2 + b^2 differs from 4 P^2 Q^2, so cosine and sine are
    # divided by their norm.
    return near_line(terms, a, b, e, sign, xi2, terms.let(4 * P2 * Q2), are_two)


def by_cosine(
    terms: Terms, k: Vector, p0: Vector, p: Vector, across2: sp.Expr, sign: sp.Symbol
) -> CosSin:
    """Solve subproblem 3 with fewer operations than ``sp3``.

    Near a folded or stretched elbow, only half of the digits of the angle are correct. Use
    ``by_cosine`` only for steps in which every angle is a solution, so that an inaccurate angle
    does no harm.
    """
    _, (a, b, e) = _line(terms, k, p0, p, across2)
    return on_line(terms, a, b, e, sign, terms.let(terms.let(a**2 + b**2) - e**2)).turn


def _line(
    terms: Terms, k: Vector, p0: Vector, p: Vector, across2: sp.Expr
) -> tuple[tuple[sp.Expr, sp.Expr], tuple[sp.Expr, sp.Expr, sp.Expr]]:
    """Return P^2 and Q^2, and the coefficients of the line ``a cos + b sin = e``."""
    p0_across, p_across = perpendicular(terms, k, p0), perpendicular(terms, k, p)
    P2, Q2 = dot(terms, p0_across, p0_across), dot(terms, p_across, p_across)
    a = terms.let(2 * dot(terms, p0_across, p_across))
    b = terms.let(2 * dot(terms, p0_across, cross(terms, k, p)))
    e = terms.let(across2 - terms.let(P2 + Q2))
    return (P2, Q2), (a, b, e)


def squared_across(terms: Terms, k: Vector, total: Vector, parts: tuple[Vector, ...]) -> sp.Expr:
    """Return the squared length ``D'^2`` of a sum of two vectors without its component along k.

    Args:
        terms: Table of named terms.
        k: The axis of the subproblem.
        total: A vector with the prescribed length of the sum.
        parts: The two added vectors, whose components along k do not depend on the solved angle.
    """
    along = terms.let(sum((dot(terms, k, part) for part in parts), sp.Integer(0)))
    return terms.let(dot(terms, total, total) - along**2)
