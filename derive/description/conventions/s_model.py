"""The S-model, which describes each link by a full pose.

Source:
    Xie, Miao, Wang and Zhang, Kinematic Model Analysis of an 8-DOF Photographic Robot, 2018,
    equation (2).
"""

import sympy as sp

from ...model.convention import AxisLine, Field, Fitted, of_transform
from ...model.placements import rotation, translation
from .axis_lines import fitted, in_turned_frame, origin_and_turns

alpha, beta, theta = sp.symbols("alpha beta theta", real=True)
x, y, z = sp.symbols("x y z", real=True)


def _turned_then_moved(line: AxisLine) -> Fitted:
    _, beta, alpha = origin_and_turns(line)
    p_x, p_y, p_z = in_turned_frame(line)
    return fitted({"beta": beta, "alpha": alpha, "x": p_x, "y": p_y, "z": p_z})


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
    fit=_turned_then_moved,
)
"""The link transform is Rz(theta) Ry(beta) Rx(alpha) T(x, y, z).
The joint variable is theta or z."""
