"""Hayati and Mirmirani's four parameters for axes that are nearly parallel.

Denavit and Hartenberg's d jumps where two axes become parallel; here a tilt beta about y takes its
place.

Source:
    S. Hayati, M. Mirmirani, Improving the absolute positioning accuracy of robot manipulators,
    Journal of Robotic Systems 2 (1985).
"""

import sympy as sp

from ...model.convention import Field, of_transform
from ...model.placements import rotation, translation

a, alpha, beta, theta = sp.symbols("a alpha beta theta", real=True)
hayati = of_transform(
    "hayati",
    (
        Field("a", "length"),
        Field("alpha", "angle"),
        Field("beta", "angle"),
        Field("theta", "angle"),
    ),
    rotation("z", theta)
    + translation(a, sp.S.Zero, sp.S.Zero)
    + rotation("x", alpha)
    + rotation("y", beta),
    source="Hayati and Mirmirani 1985",
    words="the convention of Hayati and Mirmirani",
    turning="theta",
)
"""Rz(theta) Tx(a) Rx(alpha) Ry(beta); a sliding joint moves along z right after Rz(theta)."""
