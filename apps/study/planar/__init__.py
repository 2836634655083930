"""Planar workspaces with exact borders of circular arcs."""

from .exact import ExactWorkspace, exact_workspace
from .planar_platform import (
    OrientationGrid,
    PlanarRegion,
    constant_orientation_workspace,
    dexterous_workspace,
    orientation_grid,
)
from .singularity_curves import SingularityCurves, singularity_curves
from .turning_platform import OrientationRangeWorkspace, orientation_range_workspace

__all__ = [
    "ExactWorkspace",
    "OrientationGrid",
    "OrientationRangeWorkspace",
    "PlanarRegion",
    "SingularityCurves",
    "constant_orientation_workspace",
    "dexterous_workspace",
    "exact_workspace",
    "orientation_grid",
    "orientation_range_workspace",
    "singularity_curves",
]
