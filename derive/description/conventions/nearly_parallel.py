"""Hayati and Mirmirani's four parameters for axes that are nearly parallel.

Denavit and Hartenberg's d jumps where two axes become parallel; here a tilt beta about y takes its
place.

Source:
    S. Hayati, M. Mirmirani, Improving the absolute positioning accuracy of robot manipulators,
    Journal of Robotic Systems 2 (1985).
"""

import sympy as sp

from ...model.convention import AxisLine, Field, Fitted, of_transform
from ...model.placements import rotation, translation
from .axis_lines import fitted, tilts

a, alpha, beta, theta = sp.symbols("a alpha beta theta", real=True)


def _distal(line: AxisLine) -> Fitted | None:
    """All four fields belong to the joint whose link carries the axis; the tilts need no d."""
    found = tilts(line)
    return found and fitted({"theta": found.turn, **found.values})


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
    fit=_distal,
)
"""Rz(theta) Tx(a) Rx(alpha) Ry(beta); a sliding joint moves along z right after Rz(theta)."""
