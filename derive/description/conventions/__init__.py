"""Modeling conventions: each maps the named parameters of a joint to the joint's placements.

:data:`CONVENTIONS` lists all conventions. A convention is one
:class:`~chasles.derive.model.convention.Convention` object in a file of this folder; robot files
and articles use only this object, never its name.

| name      | link transform, the joint's variable in brackets    | file                     |
|-----------|-----------------------------------------------------|--------------------------|
| `dh`      | Rz([theta]) Tz([d]) Tx(a) Rx(alpha)                 | denavit_hartenberg       |
| `mdh`     | Rx(alpha) Tx(a) Rz([theta]) Tz([d])                 | denavit_hartenberg       |
| `hayati`  | Rz([theta]) Tx(a) Rx(alpha) Ry(beta)                | nearly_parallel          |
| `mdh5`    | T(a, b, c) Rx(alpha) Rz([theta])                    | five_parameters          |
| `hayati5` | Tx(a) Rx(alpha) Ry(beta) Tz([d]) Rz([theta])        | five_parameters          |
| `s_model` | Rz([theta]) Ry(beta) Rx(alpha) T(x, y, [z])         | s_model                  |
| `poe`     | exp([q] screw of axis through point)                | product_of_exponentials  |
| `urdf`    | T(xyz) Rz(yaw) Ry(pitch) Rx(roll), then about `axis` | urdf_origin             |
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
