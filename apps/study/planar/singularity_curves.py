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

from ..arguments import finite, integer_at_least
from ..results import StudyResult
from .planar_platform import constant_orientation_workspace
from .zero_curves import zero_curves

FloatArray = NDArray[np.float64]

_PAD = 0.05
"""Margin around the region that all legs reach, relative to the larger side of its bounding box."""


@dataclass(frozen=True, eq=False)
class SingularityCurves(StudyResult):
    """Polylines (k, 2) of singular tool positions (x, y) in the base frame [m], at one tool angle.

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
    """Return the singular tool positions of a planar platform at one tool angle.

    At a type-1 singularity, a leg is stretched or folded. At a type-2 singularity, the platform
    gains a degree of freedom. The curves are polylines through singular points on the lines of a
    grid.

    Args:
        robot: A planar platform, that is, a robot with `ik_planar`. If `x` or `y` is None, the
            platform must have three legs. Each of these legs must be a chain of two links, or a
            cylinder with stroke limits.
        phi: The angle of the tool about the z axis of the base frame [rad].
        x: (2,) ascending bounds of x in the base frame [m]. If `x` is None, the bounds are the
            extent of the region that all legs reach, plus a margin.
        y: (2,) ascending bounds of y in the base frame [m]. If `y` is None, the bounds are the
            extent of the region that all legs reach, plus a margin.
        slot: Index of the solution of `ik_planar`, counted from 0. The index determines the branch
            of each leg (such as elbow up or down). Index 0 belongs to the branch of the reference
            configuration.
        resolution: Number of grid lines per axis, an int of at least 2.

    Returns:
        A `SingularityCurves`. `type_1` and `type_2` are tuples of polylines (k, 2) with positions
        (x, y) in the base frame [m]. `type_1` or `type_2` is empty if no singular position of this
        type is within the bounds. Type-2 curves end at the boundary of the region that all legs
        reach.

    Raises:
        MissingFunctionError: The robot has no `ik_planar`.
        InputTypeError: `robot` is not a `Robot`, or `phi` is not a real number.
        ShapeError: `phi` is an array with one or more dimensions.
        InputValueError: `phi` is not finite, `x` or `y` is not ascending, or `resolution` is not an
            integer of at least 2. `ik_planar` has no solution with the index `slot`. `x` or `y` is
            None, and the robot does not have three legs that are two-link chains or cylinders with
            stroke limits.

    Source:
        C. Gosselin, J. Angeles, Singularity analysis of closed-loop kinematic chains, 1990.
    """
    check_type("singularity_curves: robot", robot, Robot)
    finite("singularity_curves: phi", phi, ())
    resolution = integer_at_least("singularity_curves: resolution", resolution, 2)
    slot, ik_planar = integer_at_least("singularity_curves: slot", slot, 0), robot.ik_planar
    if slot >= (slots := len(ik_planar([0, 0, phi]).q)):
        raise InputValueError(f"singularity_curves: slot: expected less than {slots}, got {slot}")
    if x is None or y is None:
        bounds = _bounds(robot, phi)
        x, y = bounds[0] if x is None else x, bounds[1] if y is None else y
    if not (x[0] < x[1] and y[0] < y[1]):
        raise InputValueError(
            f"singularity_curves: expected ascending bounds x and y, got x = {x} and y = {y}"
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
