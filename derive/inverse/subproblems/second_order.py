"""One step of second order towards the common root of two equations in two angles.

Statement: The equations are ``g + n.x + x.(G x) / 2 = 0`` and ``h + m.x + x.(H x) / 2 = 0``, where
x is the small step of two angles. The matrices G and H are diagonal, because no term contains the
product of the two angles.

Derivation: let g be the equation with the larger gradient n. On the parabola ``x = -(g + tau^2 d.(G
d) / 2) n/|n|^2 + tau d`` with ``d = (-n2, n1)/|n|``, g vanishes to second order. On this parabola,
h is quadratic in tau. Of the two roots tau of h, the root nearer to 0 is used. At a double root
tau, the derivative of h vanishes, and Newton's method only halves the error per step. The
second-order step converges quickly even at a double root.

Source: elementary.
"""

from typing import NamedTuple

import sympy as sp

from ...model.tolerances import DIRECTION_FLOOR, PARABOLA_STEP
from ...terms.terms import Terms
from .quartic import ZERO, select
from .turns import direction


class Expansion(NamedTuple):
    """Value, first derivatives and second derivatives of an equation for two angles."""

    value: sp.Expr
    first: sp.Expr
    second: sp.Expr
    first_twice: sp.Expr
    second_twice: sp.Expr


def step_on_parabola(
    terms: Terms, equations: tuple[Expansion, Expansion]
) -> tuple[sp.Expr, sp.Expr]:
    """Return the changes of two angles that solve two second-order equations."""
    let = terms.let
    sizes = [let(e.first**2 + e.second**2) for e in equations]
    swap = sizes[1] > sizes[0]
    one, two = equations
    g, n1, n2, G1, G2 = (select(terms, swap, b, a) for a, b in zip(one, two, strict=True))
    h, m1, m2, H1, H2 = (select(terms, swap, a, b) for a, b in zip(one, two, strict=True))
    square = let(select(terms, swap, sizes[1], sizes[0]) + DIRECTION_FLOOR)
    d = direction(terms, -n2, n1)
    ratio = let(let(m1 * n1 + m2 * n2) / square)
    bend = let(G1 * d.c**2 + G2 * d.s**2)
    tau = _nearer_root(
        terms,
        let(H1 * d.c**2 + H2 * d.s**2 - ratio * bend),
        let(m1 * d.c + m2 * d.s),
        let(h - g * ratio),
    )
    off = let(let(g + bend * tau**2 / 2) / square)
    return let(tau * d.c - off * n1), let(tau * d.s - off * n2)


def _nearer_root(terms: Terms, A: sp.Expr, B: sp.Expr, C: sp.Expr) -> sp.Expr:
    """Return the root of ``A tau^2 / 2 + B tau + C`` nearest to 0.

    If the two roots are complex, return their mean.
    """
    let = terms.let
    square = let(B**2 - 2 * A * C)
    root = let(sp.sqrt(sp.Max(ZERO, square, evaluate=False)))
    real = square > 0
    top = select(terms, real, let(2 * C), B)
    bottom = select(
        terms, real, let(B + select(terms, B >= 0, root, -root)), let(A + DIRECTION_FLOOR)
    )
    tau = let(-top / bottom)
    return let(sp.Max(-PARABOLA_STEP, sp.Min(tau, PARABOLA_STEP, evaluate=False), evaluate=False))
