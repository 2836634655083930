"""Studies: workspaces, motion and planning on any robot.

    robot = chasles.load("ur5e")
    found = workspace(robot, samples=10_000_000)
    print(found.measure)
    found.plot()

They need SciPy and more, `pip install 'chasles[study]'`.
"""

from .cells import Cells, Measure
from .planar import (
    ExactWorkspace,
    OrientationRange,
    Orientations,
    PlanarRegion,
    constant_orientation,
    dexterous,
    exact_workspace,
    orientation_range,
    orientations,
    singular_places,
)
from .positions import ReachedPositions, positions
from .reach import Reach, base_placement, evenly, reach
from .samples import By, Samples
from .workspace import Workspace, workspace

__all__ = [
    "By",
    "Cells",
    "ExactWorkspace",
    "Measure",
    "OrientationRange",
    "Orientations",
    "PlanarRegion",
    "Reach",
    "ReachedPositions",
    "Samples",
    "Workspace",
    "base_placement",
    "constant_orientation",
    "dexterous",
    "evenly",
    "exact_workspace",
    "orientation_range",
    "orientations",
    "positions",
    "reach",
    "singular_places",
    "workspace",
]
