"""Workspaces in a plane with exact borders, which consist of arcs of circles."""

from .exact import ExactWorkspace, exact_workspace
from .planar_platform import (
    Orientations,
    PlanarRegion,
    constant_orientation,
    dexterous,
    orientations,
    singular_places,
)
from .turning_platform import OrientationRange, orientation_range

__all__ = [
    "ExactWorkspace",
    "OrientationRange",
    "Orientations",
    "PlanarRegion",
    "constant_orientation",
    "dexterous",
    "exact_workspace",
    "orientation_range",
    "orientations",
    "singular_places",
]
