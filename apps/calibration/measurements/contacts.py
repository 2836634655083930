"""Measurements of one number: distances from a fixed point, and contacts with a sphere or a plane.

One target x on the tool takes part, a ball in a socket or the tip of a probe. No device has a frame
of its own; the fixed point or plane is unknown, in the robot's base frame.

    |T_i x - c| = d_i     a ball bar between a fixed point c and the target; d_i = r on a sphere
    n . (T_i x) = h       contacts with a plane

Source:
    J. M. Hollerbach, C. W. Wampler, The calibration index and taxonomy for robot kinematic
    calibration methods, International Journal of Robotics Research 15 (1996).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..fitting.levenberg_marquardt import Errors, least_squares
from .tool_measurements import (
    SMALL,
    Measurements,
    Start,
    points_on_tool,
    stated,
    velocities_on_tool,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class _OneNumber(Measurements):
    """One number a configuration.

    Attributes:
        values: (N,) the numbers [m].
        sigma: Standard deviation [m].
    """

    values: FloatArray
    sigma: float = SMALL
    fixes_tool: ClassVar[bool] = False

    @property
    def stated(self) -> str:
        """The standard deviation of a number."""
        return stated(self.sigma)

    @property
    def rows(self) -> IntArray:
        """The measurement."""
        return np.arange(len(self.values))

    @property
    def labels(self) -> tuple[str, ...]:
        """Measurement, from 1."""
        return tuple(f"measurement {i + 1}" for i in range(len(self.values)))

    @property
    def configurations(self) -> IntArray:
        """One row each."""
        return self.rows

    def lengths(self, errors: FloatArray) -> FloatArray:
        """Their size."""
        return np.asarray(self.sigma * np.abs(errors))

    def at(self, index: IntArray) -> Self:
        """The measurements of some configurations."""
        return replace(self, values=self.values[index])

    def scaled(self, factor: float) -> Self:
        """The measurements with all lengths times a factor."""
        return replace(self, values=factor * self.values)

    def placed_as(self, other: Self) -> Self:
        """These: fixed points and targets are unknowns."""
        del other
        return self

    def _refined(self, T: FloatArray, x: FloatArray) -> Start:
        """The start after a fit of the unknowns alone, at the nominal poses."""
        still = np.zeros((len(T), 6, 0))

        def errors(y: FloatArray) -> Errors:
            return Errors(self.errors(T, y), lambda: self.derivatives(T, still, y)[1])

        x = least_squares(errors, x, SMALL, step=_STEP, evaluations=_EVALUATIONS)
        misfit = float(self.sigma * np.sqrt(np.mean(self.errors(T, x) ** 2)))
        return Start(np.eye(4), x, self, misfit)


@dataclass(frozen=True, eq=False)
class Distances(_OneNumber):
    """Distances of a target on the tool from a fixed point: a ball bar, or contacts with a sphere.

    Attributes:
        values: (N,) distances [m]; all alike on a sphere, its radius and that of the probe.
        sigma: Standard deviation [m].
    """

    @property
    def unknowns(self) -> tuple[str, ...]:
        """The target in the tool's frame, and the fixed point in the base frame."""
        return (*_point("target"), *_point("centre"))

    def start(self, T: FloatArray) -> Start:
        """The target in the tool's origin, and the centre by a linear fit of spheres."""
        # d^2 = |p|^2 - 2 p . c + |c|^2
        p = T[:, :3, 3] - T[:, :3, 3].mean(0)
        c, rest, across = _sphere(p, (p**2).sum(-1) - self.values**2)
        # At height 0 above the plane of the points the errors have no derivative by the height.
        c += np.sqrt(max(-rest - c @ c, (_HEIGHT * np.abs(p).max()) ** 2)) * across
        return self._refined(T, np.concatenate([np.zeros(3), c + T[:, :3, 3].mean(0)]))

    def errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """Computed less measured distances."""
        apart = points_on_tool(T, x[None, :3])[:, 0] - x[3:6]
        return np.asarray((np.linalg.norm(apart, axis=-1) - self.values) / self.sigma)

    def derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The velocity of the target along the line to the centre."""
        apart = points_on_tool(T, x[None, :3])[:, 0] - x[3:6]
        along = apart / np.linalg.norm(apart, axis=-1, keepdims=True) / self.sigma
        by_p = np.einsum("ni,nip->np", along, velocities_on_tool(T, J, x[None, :3])[:, 0])
        by_x = np.concatenate([np.einsum("ni,nij->nj", along, T[:, :3, :3]), -along], -1)
        return by_p, by_x


@dataclass(frozen=True, eq=False)
class SphereContacts(_OneNumber):
    """Contacts of a target on the tool with a sphere whose radius is not known either.

    Without a known length the scale of the robot is not determined, and a length keeps its nominal
    value; with a known radius take :class:`Distances`.

    Attributes:
        values: (N,) distances from the surface [m]; zeros where the probe touches it.
        sigma: Standard deviation [m].
    """

    @property
    def unknowns(self) -> tuple[str, ...]:
        """The target in the tool's frame, the centre in the base frame, and the radius."""
        return (*_point("target"), *_point("centre"), "radius")

    def start(self, T: FloatArray) -> Start:
        """The target in the tool's origin, and the sphere by a linear fit."""
        # |p|^2 = 2 p . c + r^2 - |c|^2
        p = T[:, :3, 3] - T[:, :3, 3].mean(0)
        c, rest, _ = _sphere(p, (p**2).sum(-1))
        centre, radius = c + T[:, :3, 3].mean(0), np.sqrt(rest + c @ c)
        return self._refined(T, np.concatenate([np.zeros(3), centre, [radius]]))

    def errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """Distance from the surface, less the one that was measured."""
        return self._bar(x).errors(T, x)

    def derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The velocity of the target along the line to the centre."""
        by_p, by_x = self._bar(x).derivatives(T, J, x)
        return by_p, np.column_stack([by_x, np.full(len(T), -1 / self.sigma)])

    def _bar(self, x: FloatArray) -> Distances:
        """The distances from the centre."""
        return Distances(self.values + x[6], self.sigma)


@dataclass(frozen=True, eq=False)
class PlaneContacts(_OneNumber):
    """Contacts of a target on the tool with a plane.

    Attributes:
        values: (N,) distances from the plane [m]; zeros where the probe touches it.
        sigma: Standard deviation [m].
        normal: (3,) the plane's normal, found from the nominal robot.
    """

    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """The target in the tool's frame, the plane's slopes (m per m) and height."""
        return (*_point("target"), "plane_slope_1", "plane_slope_2", "plane_height")

    def start(self, T: FloatArray) -> Start:
        """The target in the tool's origin, and the plane of least squares."""
        p = T[:, :3, 3]
        normal = np.linalg.svd(p - p.mean(0))[2][2]
        found = replace(self, normal=tuple(normal.tolist()))
        x = np.zeros(6)
        x[5] = normal @ p.mean(0)
        return found._refined(T, x)

    def placed_as(self, other: Self) -> Self:
        """The measurements with the other's normal."""
        return replace(self, normal=other.normal)

    def errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """Distance from the plane, less the one that was measured."""
        height = points_on_tool(T, x[None, :3])[:, 0] @ self._direction(x) - x[5]
        return np.asarray((height - self.values) / self.sigma)

    def derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The velocity of the target along the normal."""
        n, points = self._direction(x), points_on_tool(T, x[None, :3])[:, 0]
        by_p = np.einsum("i,nip->np", n, velocities_on_tool(T, J, x[None, :3])[:, 0])
        slopes = points @ self._across().T
        by_x = np.column_stack([n @ T[:, :3, :3], slopes, -np.ones(len(T))])
        return by_p / self.sigma, by_x / self.sigma

    def _across(self) -> FloatArray:
        """(2, 3) directions perpendicular to the normal."""
        return np.asarray(np.linalg.svd(np.array([self.normal]))[2][1:])

    def _direction(self, x: FloatArray) -> FloatArray:
        """The normal at slopes x[3:5]; its length differs from 1 by their squares."""
        return np.asarray(np.array(self.normal) + x[3:5] @ self._across())


_STEP = 1e-6
"""Relative change at which the start is good enough; the identification goes on from there."""
_EVALUATIONS = 50
"""Most evaluations on the way there."""
_HEIGHT = 0.1
"""Least height of a fixed point above points in a plane, in parts of their extent."""
_FLAT = 1e-6
"""Third singular value of points, in parts of the largest, below which they lie in a plane, or the
second one, on a line."""


def _sphere(p: FloatArray, right: FloatArray) -> tuple[FloatArray, float, FloatArray]:
    """The solution c, rest of 2 p . c + rest = right for points p (N, 3) about 0.

    The third result is a direction of c that the points leave open; 0 if they determine c.
    """
    _, sizes, axes = np.linalg.svd(p, full_matrices=False)
    rows = np.column_stack([2 * p, np.full(len(p), sizes[0])])
    found = np.linalg.lstsq(rows, right, rcond=_FLAT)[0]
    is_flat = sizes[-1] <= _FLAT * sizes[0]
    return found[:3], float(sizes[0] * found[3]), axes[-1] * float(is_flat)


def _point(what: str) -> tuple[str, ...]:
    """Names of the coordinates of a point."""
    return tuple(f"{what}_{axis}" for axis in "xyz")
