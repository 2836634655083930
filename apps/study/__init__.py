"""Studies: workspaces, static loads, motion and planning on any robot.

    robot = chasles.load("ur5e")
    found = workspace(robot, samples=10_000_000)
    print(found.size)
    found.plot()

The functions of chasles.study need the packages of `pip install 'chasles[study]'`.
"""

from .equilibrium import PointMass
from .grid import Grid, SizeEstimate
from .planar import (
    ExactWorkspace,
    OrientationGrid,
    OrientationRangeWorkspace,
    PlanarRegion,
    SingularityCurves,
    constant_orientation_workspace,
    dexterous_workspace,
    exact_workspace,
    orientation_grid,
    orientation_range_workspace,
    singularity_curves,
)
from .reach import Reach, base_placement, reach, uniform_orientations
from .reachable_positions import ReachablePositions, reachable_positions
from .statics import StaticLoads, gravity_forces, static_loads
from .workspace import Workspace, workspace

__all__ = [
    "ExactWorkspace",
    "Grid",
    "OrientationGrid",
    "OrientationRangeWorkspace",
    "PlanarRegion",
    "PointMass",
    "Reach",
    "ReachablePositions",
    "SingularityCurves",
    "SizeEstimate",
    "StaticLoads",
    "Workspace",
    "base_placement",
    "constant_orientation_workspace",
    "dexterous_workspace",
    "exact_workspace",
    "gravity_forces",
    "orientation_grid",
    "orientation_range_workspace",
    "reach",
    "reachable_positions",
    "singularity_curves",
    "static_loads",
    "uniform_orientations",
    "workspace",
]
