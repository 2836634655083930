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

    A position is singular of type 1 if a leg is stretched or folded. A position is singular of type
    2 if the platform gains a degree of freedom. The curves connect singular points on grid lines by
    straight segments.

    Args:
        robot: A planar platform, a robot with `ik_planar`. If `x` or `y` is None, the platform must
            have three legs. Each leg must then consist of two links or be a cylinder with limits.
        phi: The angle of the tool about the z axis of the base [rad].
        x: (2,) lower and upper bound of x in the base frame [m]. None means the extent of the
            region that all legs reach, with a margin.
        y: (2,) lower and upper bound of y in the base frame [m]. None means the extent of the
            region that all legs reach, with a margin.
        slot: Index of the solution of `ik_planar`, from 0. The index determines the branch of each
            leg. Slot 0 contains the reference branch.
        resolution: Number of grid lines per axis, an int of at least 2.

    Returns:
        A `SingularityCurves`. `type_1` and `type_2` are tuples of polylines (k, 2) with positions
        (x, y) in the base frame [m]. A tuple is empty if there are no such positions. Type-2 curves
        end at the boundary of the region that all legs reach.

    Raises:
        MissingFunctionError: The robot is not a planar platform.
        InputTypeError: `robot` is not a `Robot`, or `phi` is not a real number.
        ShapeError: `phi` is an array with one or more dimensions.
        InputValueError: `phi` is not finite, the bounds are not in ascending order, or `resolution`
            is less than 2. `x` or `y` is None, and the legs do not meet the conditions above.
        IndexError: `ik_planar` has no solution with the index `slot`.
        TypeError: `resolution` is not an int.

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
