"""Planar workspaces with exact borders, which consist of circular arcs."""

from .exact import ExactWorkspace, exact_workspace
from .planar_platform import (
    OrientationGrid,
    PlanarRegion,
    constant_orientation_workspace,
    dexterous_workspace,
    orientation_grid,
)
from .turning_platform import OrientationRangeWorkspace, orientation_range_workspace

__all__ = [
    "ExactWorkspace",
    "OrientationGrid",
    "OrientationRangeWorkspace",
    "PlanarRegion",
    "constant_orientation_workspace",
    "dexterous_workspace",
    "exact_workspace",
    "orientation_grid",
    "orientation_range_workspace",
]
