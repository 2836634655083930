"""Singular positions of planar platforms at one orientation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import check_type
from chasles.summaries import summary_repr

from ..arguments import finite
from ..results import StudyResult
from .planar_platform import constant_orientation_workspace
from .zero_curves import zero_curves

FloatArray = NDArray[np.float64]

_PAD = 0.05
"""Margin around the region that all legs reach, relative to the larger side of its bounding box."""


@dataclass(frozen=True, eq=False)
class SingularityCurves(StudyResult):
    """Polylines (k, 2) of singular positions x, y [m] at one orientation.

    Attributes:
        robot: The robot's name.
        type_1: Curves on which a leg is stretched or folded.
        type_2: Curves on which the platform gains a degree of freedom.
    """

    robot: str
    type_1: tuple[FloatArray, ...]
    type_2: tuple[FloatArray, ...]

    def __repr__(self) -> str:
        """Return a summary with the numbers of type-1 and type-2 curves."""
        facts = (f"{len(self.type_1)} of type 1", f"{len(self.type_2)} of type 2")
        return summary_repr(self, self.robot, *facts, methods="plot(), save(path)")

    def plot(self, ax: Any = None) -> Any:
        """Plot the type-1 and type-2 singularity curves.

        Args:
            ax: The matplotlib axes, or None for a new figure.

        Returns:
            The axes.
        """
        from ..pictures import plot_singularities  # noqa: PLC0415

        return plot_singularities(self, ax)


def singularity_curves(
    robot: Robot,
    phi: float,
    x: Sequence[float] | None = None,
    y: Sequence[float] | None = None,
    *,
    slot: int = 0,
    resolution: int = 201,
) -> SingularityCurves:
    """Return the singular positions of a planar platform at one orientation.

    The curves connect zeros of the determinants on grid lines by straight segments.

    Args:
        robot: A planar platform.
        phi: The platform angle [rad].
        x: Lower and upper bound of x [m]. The default is the region that all legs reach.
        y: Lower and upper bound of y [m]. The default is the region that all legs reach.
        slot: Solution slot of `ik_planar`. The solution slot determines the branch of each leg.
            Slot 0 contains the reference branch.
        resolution: Number of grid lines per axis.

    Returns:
        Type-1 and type-2 curves. Type-2 curves end at the boundary of the region that all legs
        reach.

    Raises:
        MissingFunctionError: The robot is not a planar platform.
        InputValueError: The bounds are not in ascending order, or the resolution is below 2. If x
            or y is None, `constant_orientation_workspace` may raise further errors.

    Source:
        C. Gosselin, J. Angeles, Singularity analysis of closed-loop kinematic chains, 1990.
    """
    check_type("singularity_curves: robot", robot, Robot)
    finite("singularity_curves: phi", phi, ())
    ik_planar = robot.ik_planar
    if x is None or y is None:
        bounds = _bounds(robot, phi)
        x, y = bounds[0] if x is None else x, bounds[1] if y is None else y
    if not (x[0] < x[1] and y[0] < y[1] and resolution >= 2):  # noqa: PLR2004
        raise InputValueError(
            f"singularity_curves: expected ascending x and y and resolution at least 2, got x = "
            f"{x}, y = {y}, resolution = {resolution}"
        )
    grid = [np.linspace(low, high, resolution) for low, high in (x, y)]

    def pose(points: FloatArray) -> FloatArray:
        return np.concatenate([points, np.full((*points.shape[:-1], 1), phi)], -1)

    def determinant(points: FloatArray) -> FloatArray:
        at = pose(points)
        return np.asarray(robot.determinants(at, ik_planar(at).q[..., slot, :]).J_x)

    def margin(points: FloatArray, leg: int) -> FloatArray:
        _, margins = robot.functions["actuators_all"](pose(points))
        return np.asarray(margins[..., slot, leg])

    # A linear actuator has no type-1 singularity.
    legs = range(robot.n) if "actuators_all" in robot.functions else ()
    type_1 = [zero_curves(lambda p, k=leg: margin(p, k), *grid) for leg in legs]  # type: ignore[misc]
    type_2 = zero_curves(determinant, *grid)
    return SingularityCurves(robot.name, tuple(c for found in type_1 for c in found), type_2)


def _bounds(robot: Robot, phi: float) -> list[tuple[float, float]]:
    """Return bounds of x and y around the region that all legs reach."""
    region = constant_orientation_workspace(robot, phi)
    points = [arc.points() for arc in region.arcs] or [np.zeros((1, 2))]
    lower, upper = np.concatenate(points).min(0), np.concatenate(points).max(0)
    pad = _PAD * max(upper - lower) or robot.unit_length
    return list(zip(lower - pad, upper + pad, strict=True))
