"""The S-model: six parameters, a full pose, for each link.

Source:
    Xie, Miao, Wang and Zhang, Kinematic Model Analysis of an 8-DOF Photographic Robot, 2018,
    equation (2).
"""

import sympy as sp

from ...model.convention import Field, of_transform
from ...model.placements import rotation, translation

alpha, beta, theta = sp.symbols("alpha beta theta", real=True)
x, y, z = sp.symbols("x y z", real=True)
s_model = of_transform(
    "s_model",
    (
        Field("theta", "angle"),
        Field("beta", "angle"),
        Field("alpha", "angle"),
        Field("x", "length"),
        Field("y", "length"),
        Field("z", "length"),
    ),
    rotation("z", theta) + rotation("y", beta) + rotation("x", alpha) + translation(x, y, z),
    source="Xie, Miao, Wang and Zhang 2018, (2)",
    words="the S-model",
    turning="theta",
    sliding="z",
)
"""Rz(theta) Ry(beta) Rx(alpha) T(x, y, z): a joint turns by theta or slides by z."""
