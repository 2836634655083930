"""The convention of the product of exponentials, in which each joint has a screw axis.

Source:
    R. W. Brockett, Robotic manipulators and the product of exponentials formula, MTNS 1983 (1984).
"""

import sympy as sp

from ...model.convention import AxisLine, Convention, Field, Fitted, Placements
from ...model.kinds import JointKind
from ...model.placements import Placement, Vector, align_z, inverse, rotation, translation
from .axis_lines import fitted
from .urdf_origin import AXIS


def _around_the_screw(kind: JointKind, *, axis: Vector, point: Vector) -> Placements:  # noqa: ARG001
    """Return the transform from the link frame to the screw axis, and the inverse transform.

    The two transforms cancel at the zero configuration.
    """
    z_to_axis, to_point = align_z(axis), translation(*point)
    return to_point + z_to_axis, inverse(z_to_axis) + inverse(to_point)


def _corrections(kind: JointKind) -> Placement:
    """Return the corrections: two tilts, and two shifts unless the joint is prismatic."""
    x, y, tilt_x, tilt_y = sp.symbols("shift_x shift_y tilt_x tilt_y", real=True)
    shifts = () if kind == "prismatic" else translation(x, y, sp.S.Zero)
    return shifts + rotation("x", tilt_x) + rotation("y", tilt_y)


def _uncorrected(line: AxisLine) -> Fitted:  # noqa: ARG001
    """Return a fit with shift and tilt 0, because point and direction define the axis exactly."""
    return fitted({})


poe = Convention(
    "poe",
    (AXIS, Field("point", "lengths", ("p_x", "p_y", "p_z"), is_of_motion=True)),
    _around_the_screw,
    source="Brockett 1984",
    words="screw axes, each with a direction $e$ and a point $p$ on the axis,",
    numbers=_corrections,
    fit=_uncorrected,
)
"""The joint moves along a screw with the direction ``axis`` through ``point``.

Direction and point are expressed in the frame of the previous link at the zero configuration. For
the first joint, this frame is the first frame of the chain. The `[base]` table of a robot file is
the pose of the first frame in the base frame (default: identity). If all joints are `poe` joints,
all link frames coincide with the first frame at the zero configuration.
"""
