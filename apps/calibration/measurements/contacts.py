"""Scalar measurements: distances from a fixed point, and contacts with a sphere or a plane.

The tool carries one target at the position x, for example a ball or a probe tip. Contacts and
distances are measured without a device frame. The coordinates of the unknown fixed point or plane
are in the base frame of the robot.

At tool pose T_i, a ball bar between a fixed point c and the target x measures the distance d_i =
|T_i x - c|. For contacts with a sphere around c, all distances d_i are equal to the sphere radius
r. Contacts with a plane of normal n and height h satisfy n . (T_i x) = h.

Source:
    J. M. Hollerbach, C. W. Wampler, The calibration index and taxonomy for robot kinematic
    calibration methods, International Journal of Robotics Research 15 (1996).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    """Measurements with one value per configuration.

    Attributes:
        values: (N,) measured values [m].
        sigma: Standard deviation of each distance [m].
    """

    values: FloatArray
    sigma: float = SMALL
    _n_frame_unknowns: ClassVar[int] = 0
    _fixes_tool: ClassVar[bool] = False
    _shapes: ClassVar[Mapping[str, tuple[int | None, ...]]] = {"values": (None,)}

    @property
    def _stated(self) -> str:
        return stated(self.sigma)

    @property
    def rows(self) -> IntArray:
        """Index of the measurement row of each error.

        Each row contains the error of one measurement.
        """
        return np.arange(len(self.values))

    @property
    def labels(self) -> tuple[str, ...]:
        """Label of each measurement row: measurement number, counted from 1."""
        return tuple(f"measurement {i + 1}" for i in range(len(self.values)))

    @property
    def configurations(self) -> IntArray:
        """Index of the configuration of each measurement row."""
        return self.rows

    def _lengths(self, errors: FloatArray) -> FloatArray:
        return np.asarray(self.sigma * np.abs(errors))

    def at(self, index: IntArray) -> Self:
        """Return the measurements at the configurations `index`."""
        return replace(self, values=self.values[index])

    def _scaled(self, factor: float) -> Self:
        return replace(self, values=factor * self.values)

    def _placed_as(self, other: Self) -> Self:
        del other
        return self

    def _best(self, T: FloatArray, start: Callable[[FloatArray], FloatArray]) -> Start:
        """Return the best of several fits, each with a different start position of the target.

        Several start positions of the target avoid local minima.

        Args:
            T: (N, 4, 4) nominal tool poses.
            start: Function that returns the start values of all unknowns for a given target
                position (3,).
        """
        return min(
            (self._refined(T, start(target)) for target in _TARGETS), key=lambda fit: fit.misfit
        )

    def _refined(self, T: FloatArray, x: FloatArray) -> Start:
        """Fit the unknowns to the measurements at the nominal tool poses."""
        still = np.zeros((len(T), 6, 0))

        def errors(y: FloatArray) -> Errors:
            return Errors(self._errors(T, y), lambda: self._derivatives(T, still, y)[1])

        x = least_squares(errors, x, SMALL, step=_STEP, evaluations=_EVALUATIONS)
        misfit = float(self.sigma * np.sqrt(np.mean(self._errors(T, x) ** 2)))
        return Start(np.eye(4), x, self, misfit)


@dataclass(frozen=True, eq=False)
class Distances(_OneNumber):
    """Distances of a target on the tool from a fixed point, for example from a ball bar.

    Attributes:
        values: (N,) distances between target and fixed point [m]. If a probe touches a sphere, the
            distance is the sum of the sphere radius and the probe radius.
        sigma: Standard deviation of each distance [m].
    """

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the six unknown coordinates: target (tool frame), fixed point (base frame)."""
        return (*_point("target"), *_point("center"))

    def _start(self, T: FloatArray) -> Start:
        return self._best(T, lambda target: self._linear(T, target))

    def _linear(self, T: FloatArray, target: FloatArray) -> FloatArray:
        """Estimate the fixed point by linear least squares for a given target position (3,)."""
        # The squared distance of point p from the center c is d^2 = |p|^2 - 2 p . c + |c|^2
        points = points_on_tool(T, target[None])[:, 0]
        p = points - points.mean(0)
        c, rest, across = _sphere(p, (p**2).sum(-1) - self.values**2)
        # If the fixed point lies in the plane of coplanar target positions, the derivative of the
        # distances with respect to its height is 0.
        c += np.sqrt(max(-rest - c @ c, (_HEIGHT * np.abs(p).max()) ** 2)) * across
        return np.concatenate([target, c + points.mean(0)])

    def _errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        apart = points_on_tool(T, x[None, :3])[:, 0] - x[3:6]
        return np.asarray((np.linalg.norm(apart, axis=-1) - self.values) / self.sigma)

    def _derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        apart = points_on_tool(T, x[None, :3])[:, 0] - x[3:6]
        along = apart / np.linalg.norm(apart, axis=-1, keepdims=True) / self.sigma
        by_p = np.einsum("ni,nip->np", along, velocities_on_tool(T, J, x[None, :3])[:, 0])
        by_x = np.concatenate([np.einsum("ni,nij->nj", along, T[:, :3, :3]), -along], -1)
        return by_p, by_x


@dataclass(frozen=True, eq=False)
class SphereContacts(_OneNumber):
    """Contacts of a target on the tool with a sphere of unknown center and radius.

    Contacts with a sphere of unknown radius do not determine the scale of the robot, so one length
    keeps its nominal value. For contacts with a sphere of known radius, use ``Distances``.

    Attributes:
        values: (N,) distances of the target from the sphere surface [m], or 0 for a contact.
        sigma: Standard deviation of each distance [m].
    """

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of target coordinates (tool frame), center coordinates (base frame) and radius."""
        return (*_point("target"), *_point("center"), "radius")

    def _start(self, T: FloatArray) -> Start:
        return self._best(T, lambda target: self._linear(T, target))

    def _linear(self, T: FloatArray, target: FloatArray) -> FloatArray:
        """Fit a sphere to the positions of a target (3,) by linear least squares."""
        # Points p on a sphere with center c and radius r satisfy |p|^2 = 2 p . c + r^2 - |c|^2
        points = points_on_tool(T, target[None])[:, 0]
        p = points - points.mean(0)
        c, rest, _ = _sphere(p, (p**2).sum(-1))
        return np.concatenate([target, c + points.mean(0), [np.sqrt(rest + c @ c)]])

    def _errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        return self._bar(x)._errors(T, x)

    def _derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        by_p, by_x = self._bar(x)._derivatives(T, J, x)
        return by_p, np.column_stack([by_x, np.full(len(T), -1 / self.sigma)])

    def _bar(self, x: FloatArray) -> Distances:
        return Distances(self.values + x[6], self.sigma)


@dataclass(frozen=True, eq=False)
class PlaneContacts(_OneNumber):
    """Contacts of a target on the tool with a plane.

    Attributes:
        values: (N,) distances of the target from the plane [m], or 0 for a contact.
        sigma: Standard deviation of each distance [m].
        normal: (3,) normal of the plane, estimated with the nominal robot.
    """

    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the target's coordinates in the tool frame, and of the plane's parameters."""
        return (*_point("target"), "plane_slope_1", "plane_slope_2", "plane_height")

    def _start(self, T: FloatArray) -> Start:
        p = T[:, :3, 3]
        normal = np.linalg.svd(p - p.mean(0))[2][2]
        found = replace(self, normal=tuple(normal.tolist()))
        x = np.zeros(6)
        x[5] = normal @ p.mean(0)
        return found._refined(T, x)

    def _placed_as(self, other: Self) -> Self:
        return replace(self, normal=other.normal)

    def _errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        height = points_on_tool(T, x[None, :3])[:, 0] @ self._direction(x) - x[5]
        return np.asarray((height - self.values) / self.sigma)

    def _derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        n, points = self._direction(x), points_on_tool(T, x[None, :3])[:, 0]
        by_p = np.einsum("i,nip->np", n, velocities_on_tool(T, J, x[None, :3])[:, 0])
        slopes = points @ self._across().T
        by_x = np.column_stack([n @ T[:, :3, :3], slopes, -np.ones(len(T))])
        return by_p / self.sigma, by_x / self.sigma

    def _across(self) -> FloatArray:
        """Return two unit vectors (2, 3) perpendicular to the normal of the plane."""
        return np.asarray(np.linalg.svd(np.array([self.normal]))[2][1:])

    def _direction(self, x: FloatArray) -> FloatArray:
        """Return the normal vector of the plane for the slopes x[3:5].

        To first order in the slopes, the length of the normal vector is 1.
        """
        return np.asarray(np.array(self.normal) + x[3:5] @ self._across())


_STEP = 1e-6
"""Relative change at which the fit of the start values stops. The identification later refines the
start values."""
_EVALUATIONS = 50
"""Maximum number of error evaluations in the fit of the start values."""
_TARGETS = np.array([[0, 0, 0], [1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.06
"""Start positions of the target in the fits [m]: the tool origin, and the corners of a tetrahedron.
"""
_HEIGHT = 0.1
"""Minimum distance of the fixed point's start value from the plane of coplanar target positions,
relative to the extent of the positions."""
_FLAT = 1e-6
"""Below this relative singular value, points count as coplanar or collinear."""


def _sphere(p: FloatArray, right: FloatArray) -> tuple[FloatArray, float, FloatArray]:
    """Fit the center of a sphere: solve 2 p . c + b = right for c and b by least squares.

    The points p (N, 3) have mean 0, and c (3,) is the center. If the points p are coplanar, the
    third returned value is the normal of their plane. Coplanar points do not determine the
    component of the sphere center c along this normal. If the points p are not coplanar, the third
    returned value is 0.
    """
    _, sizes, axes = np.linalg.svd(p, full_matrices=False)
    rows = np.column_stack([2 * p, np.full(len(p), sizes[0])])
    found = np.linalg.lstsq(rows, right, rcond=_FLAT)[0]
    is_flat = sizes[-1] <= _FLAT * sizes[0]
    return found[:3], float(sizes[0] * found[3]), axes[-1] * float(is_flat)


def _point(what: str) -> tuple[str, ...]:
    return tuple(f"{what}_{axis}" for axis in "xyz")
