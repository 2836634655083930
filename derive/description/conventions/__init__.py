"""Modeling conventions. A convention maps the parameters of a joint to its placements.

``CONVENTIONS`` lists the conventions. Each convention is a
``Convention`` in a file of this folder.

The following list states the link transform of each convention, with the joint variable in
brackets.

`dh` (denavit_hartenberg.py) is Rz([theta]) Tz([d]) Tx(a) Rx(alpha).
`mdh` (denavit_hartenberg.py) is Rx(alpha) Tx(a) Rz([theta]) Tz([d]).
`hayati` (nearly_parallel.py) is Rz([theta]) Tx(a) Rx(alpha) Ry(beta).
`mdh5` (five_parameters.py) is T(a, b, c) Rx(alpha) Rz([theta]).
`hayati5` (five_parameters.py) is Tx(a) Rx(alpha) Ry(beta) Tz([d]) Rz([theta]).
`s_model` (s_model.py) is Rz([theta]) Ry(beta) Rx(alpha) T(x, y, [z]).
`poe` (product_of_exponentials.py) is exp([q] screw) for the screw of an axis through a point.
`urdf` (urdf_origin.py) is T(xyz) Rz(yaw) Ry(pitch) Rx(roll), then the motion about `axis`.
"""

from ...model.convention import Convention
from .denavit_hartenberg import dh, mdh
from .five_parameters import hayati5, mdh5
from .nearly_parallel import hayati
from .product_of_exponentials import poe
from .s_model import s_model
from .urdf_origin import urdf

__all__ = [
    "CONVENTIONS",
    "dh",
    "hayati",
    "hayati5",
    "mdh",
    "mdh5",
    "poe",
    "s_model",
    "urdf",
]

CONVENTIONS: tuple[Convention, ...] = (dh, mdh, hayati, mdh5, hayati5, s_model, poe, urdf)
