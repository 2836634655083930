"""Denavit-Hartenberg parameters, standard and modified.

Source:
    J. Denavit, R. S. Hartenberg, A kinematic notation for lower-pair mechanisms based on matrices,
    Journal of Applied Mechanics 22 (1955), for `dh`: the frame of link i is at its far end.
    J. J. Craig, Introduction to Robotics; W. Khalil, J. Kleinfinger, A new geometric notation for
    open and closed-loop robots, ICRA 1986, for `mdh`: the frame of link i is on axis i.
"""

import sympy as sp

from ...model.convention import AxisLine, Field, Fitted, of_transform
from ...model.placements import rotation, translation
from .axis_lines import common_normal, into_fields

a, alpha, d, theta = sp.symbols("a alpha d theta", real=True)
_FIELDS = (
    Field("a", "length"),
    Field("alpha", "angle"),
    Field("d", "length"),
    Field("theta", "angle"),
)


def _standard(line: AxisLine) -> Fitted:

    return into_fields(common_normal(line))


dh = of_transform(
    "dh",
    _FIELDS,
    rotation("z", theta)
    + translation(sp.S.Zero, sp.S.Zero, d)
    + translation(a, sp.S.Zero, sp.S.Zero)
    + rotation("x", alpha),
    source="Denavit and Hartenberg 1955",
    words="the standard Denavit--Hartenberg convention",
    turning="theta",
    sliding="d",
    fit=_standard,
)
"""Standard Denavit-Hartenberg: The link transform is Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
mdh = of_transform(
    "mdh",
    _FIELDS,
    rotation("x", alpha)
    + translation(a, sp.S.Zero, sp.S.Zero)
    + rotation("z", theta)
    + translation(sp.S.Zero, sp.S.Zero, d),
    source="Craig; Khalil and Kleinfinger 1986",
    words="the modified Denavit--Hartenberg convention",
    turning="theta",
    sliding="d",
    fit=common_normal,
)
"""Modified (Craig's) convention; the link transform is Rx(alpha) Tx(a) Rz(theta) Tz(d)."""
