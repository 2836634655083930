"""The URDF convention, in which a joint has an origin and an axis.

Source:
    The URDF specification of <joint>: <origin xyz rpy> and <axis xyz>.
"""

import sympy as sp

from ...model.convention import AxisLine, Convention, Field, Fitted, Placements
from ...model.kinds import JointKind
from ...model.placements import Placement, Vector, align_z, from_xyz_rpy, inverse
from .axis_lines import fitted, origin_and_turns

AXIS = Field(
    "axis",
    "direction",
    ("e_x", "e_y", "e_z"),
    default=(sp.S.Zero, sp.S.Zero, sp.S.One),
    needed_to="the direction of the joint axis",
    is_of_motion=True,
)


def _at_the_origin(kind: JointKind, *, xyz: Vector, rpy: Vector, axis: Vector) -> Placements:
    origin = from_xyz_rpy(xyz, rpy)
    if kind == "fixed":
        return origin, ()
    z_to_axis = align_z(axis)
    return origin + z_to_axis, inverse(z_to_axis)


def _origin(kind: JointKind) -> Placement:  # noqa: ARG001
    x, y, z = sp.symbols("xyz_x xyz_y xyz_z", real=True)
    roll, pitch, yaw = sp.symbols("rpy_x rpy_y rpy_z", real=True)
    return from_xyz_rpy((x, y, z), (roll, pitch, yaw))


def _at_the_axis(line: AxisLine) -> Fitted:
    xyz, beta, alpha = origin_and_turns(line)
    return fitted({"xyz": xyz, "rpy": (alpha, beta, sp.S.Zero), "axis": AXIS.default or xyz})


urdf = Convention(
    "urdf",
    (
        Field("xyz", "lengths", ("x", "y", "z")),
        Field("rpy", "angles", (r"\mathrm{roll}", r"\mathrm{pitch}", r"\mathrm{yaw}")),
        AXIS,
    ),
    _at_the_origin,
    source="URDF",
    words="URDF origins $x, y, z$ with roll, pitch and yaw, axes $e$",
    second_part="axis",
    numbers=_origin,
    fit=_at_the_axis,
)
"""The link transform is T(xyz) Rz(yaw) Ry(pitch) Rx(roll), followed by the joint motion about or
along ``axis``. The vector ``axis`` is given in the frame after the first four transforms."""
