"""Four parameters of Hayati and Mirmirani for nearly parallel axes.

The Denavit-Hartenberg parameter d is discontinuous at parallel axes. This convention replaces d by
a tilt beta about y.

Source:
    S. Hayati, M. Mirmirani, Improving the absolute positioning accuracy of robot manipulators,
    Journal of Robotic Systems 2 (1985).
"""

import sympy as sp

from ...model.convention import AxisLine, Field, Fitted, of_transform
from ...model.placements import rotation, translation
from .axis_lines import fitted, tilts

a, alpha, beta, theta = sp.symbols("a alpha beta theta", real=True)


def _standard(line: AxisLine) -> Fitted | None:
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
    fit=_standard,
)
"""The link transform is Rz(theta) Tx(a) Rx(alpha) Ry(beta)."""
