"""Two complete and continuous conventions with five parameters, one for nearly parallel axes.

Source:
    Closed chain cascade manipulator with an improved kinematic model, Mathematical Problems in
    Engineering. Equation (6) of this article is `mdh5`, for axes that are not parallel. Equation
    (8) of this article is `hayati5`, for axes that are nearly parallel.
"""

import sympy as sp

from ...model.convention import AxisLine, Field, Fitted, of_transform
from ...model.placements import rotation, translation
from .axis_lines import common_normal, tilts

a, b, c, d = sp.symbols("a b c d", real=True)
alpha, beta, theta = sp.symbols("alpha beta theta", real=True)


def _at_the_normal(line: AxisLine) -> Fitted:
    """Place the frame at the foot of the common normal, so the parameter b of `mdh5` is zero."""
    found = common_normal(line)
    return Fitted(found.turn, sp.S.Zero, {**found.values, "c": found.shift})


mdh5 = of_transform(
    "mdh5",
    (
        Field("a", "length"),
        Field("b", "length"),
        Field("c", "length"),
        Field("alpha", "angle"),
        Field("theta", "angle"),
    ),
    translation(a, b, c) + rotation("x", alpha) + rotation("z", theta),
    source="Closed chain cascade manipulator, (6)",
    words="the five-parameter convention for axes that are not parallel",
    turning="theta",
    fit=_at_the_normal,
)
"""The link transform is T(a, b, c) Rx(alpha) Rz(theta)."""
hayati5 = of_transform(
    "hayati5",
    (
        Field("a", "length"),
        Field("alpha", "angle"),
        Field("beta", "angle"),
        Field("d", "length"),
        Field("theta", "angle"),
    ),
    translation(a, sp.S.Zero, sp.S.Zero)
    + rotation("x", alpha)
    + rotation("y", beta)
    + translation(sp.S.Zero, sp.S.Zero, d)
    + rotation("z", theta),
    source="Closed chain cascade manipulator, (8)",
    words="the five-parameter convention for nearly parallel axes",
    turning="theta",
    sliding="d",
    fit=tilts,
)
"""The link transform is Tx(a) Rx(alpha) Ry(beta) Tz(d) Rz(theta)."""
