"""Product of exponentials: each joint by the screw axis that it moves about or along.

Source:
    R. W. Brockett, Robotic manipulators and the product of exponentials formula, MTNS 1983 (1984).
"""

from ...model.convention import Convention, Field, Placements
from ...model.kinds import JointKind
from ...model.placements import Vector, align_z, inverse, translation
from .urdf_origin import AXIS


def _around_the_screw(kind: JointKind, *, axis: Vector, point: Vector) -> Placements:  # noqa: ARG001
    """The frame of the screw and back: every link frame coincides with the base frame at zero."""
    z_to_axis, to_point = align_z(axis), translation(*point)
    return to_point + z_to_axis, inverse(z_to_axis) + inverse(to_point)


poe = Convention(
    "poe",
    (AXIS, Field("point", "lengths", ("p_x", "p_y", "p_z"), is_of_motion=True)),
    _around_the_screw,
    source="Brockett 1984",
    words="screw axes, each by its direction $e$ and a point $p$ on it,",
)
"""The screw along ``axis`` through ``point``.

Both are given in the previous link's frame at zero, which for a chain of `poe` joints alone is the
base frame.
"""
