"""Measurements of a robot's tool, each with its error and derivative in a device's frame W.

Measurements hold what was measured at N configurations, and know the unknowns that come with
them, such as the places of targets on the tool. Errors are divided by their standard deviations.
A row is what may be wrong as a whole: a pose, or the position of a target.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from chasles import so3

from .frames import mean_pose, register_points, register_poses, targets_at
from .quaternions import quaternions, rotations

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

SMALL = 1e-3
"""A small length [m] and angle [rad]: the standard deviations where none is given, and the scale in
which variables are compared."""

_XYZW = "quaternions are written x, y, z, w, not w, x, y, z"
_WXYZ = "quaternions are written w, x, y, z, not x, y, z, w"
LEFT_HANDED = (
    "the device's frame is left-handed: two of x, y and z are exchanged, or one has the wrong sign"
)
_TURNED_BACK = "orientations are those of the device in the probe's frame, not of the probe"


class Start(NamedTuple):
    """Frames and unknowns in closed form, from the nominal robot.

    Attributes:
        T_W_base: (4, 4) the robot's base frame in the device's.
        unknowns: (u,) the unknowns [m].
        measurements: The measurements, with the frames that it needs.
        misfit: Root mean square distance between measurements and the nominal robot [m].
    """

    T_W_base: FloatArray
    unknowns: FloatArray
    measurements: Measurements
    misfit: float


class Measurements(ABC):
    """What was measured at N configurations.

    Attributes:
        fixes_tool: Whether the orientation of the tool's frame is measured too, so that its six
            corrections are sought rather than targets.
    """

    fixes_tool: ClassVar[bool]

    @property
    @abstractmethod
    def stated(self) -> str:
        """The standard deviations with which errors are compared, in words."""

    @property
    @abstractmethod
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns, all lengths."""

    @property
    @abstractmethod
    def rows(self) -> IntArray:
        """(M,) index of the row of each error."""

    @property
    @abstractmethod
    def labels(self) -> tuple[str, ...]:
        """Name of each row, for messages."""

    @property
    @abstractmethod
    def configurations(self) -> IntArray:
        """(rows,) index of the configuration of each row."""

    @property
    def targets(self) -> tuple[str, ...]:
        """What each row measures: a target, or the probe."""
        return ("probe",) * len(self.configurations)

    @abstractmethod
    def lengths(self, errors: FloatArray) -> FloatArray:
        """(rows,) distance [m] that the errors (M,) of each row mean."""

    @abstractmethod
    def start(self, T: FloatArray) -> Start:
        """Frame and unknowns from nominal poses (N, 4, 4) of the tool in the base frame."""

    def from_frame(self, T: FloatArray, start: Start) -> Start:  # noqa: ARG002
        """The start where the poses T (N, 4, 4) of the tool in W are known, frame included.

        Measurements that may leave turns about axes open find their unknowns anew from T.
        """
        return start

    @abstractmethod
    def at(self, index: IntArray) -> Self:
        """The measurements of some configurations, with the same frames."""

    @abstractmethod
    def placed_as(self, other: Self) -> Self:
        """The measurements with the frames that were found for others of the same set-up."""

    @abstractmethod
    def scaled(self, factor: float) -> Self:
        """The measurements with all lengths times a factor."""

    def read_otherwise(self) -> Iterator[tuple[str, Self]]:
        """Other readings of the same numbers, each behind the words that name the mistake."""
        return iter(())

    @abstractmethod
    def errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """(M,) errors at poses T (N, 4, 4) of the tool in W and unknowns x."""

    @abstractmethod
    def derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(M, p) by parameters whose mixed twists are J (N, 6, p), in the axes of W; (M, u)."""


def stated(sigma: float) -> str:
    """A standard deviation [m] in words."""
    return f"{1e3 * sigma:.3g} mm"


def points_on_tool(T: FloatArray, targets: FloatArray) -> FloatArray:
    """Positions (N, m, 3) of targets (m, 3) on the tool at poses (N, 4, 4)."""
    return np.asarray(T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets))


def velocities_on_tool(T: FloatArray, J: FloatArray, targets: FloatArray) -> FloatArray:
    """Velocities (N, m, 3, p) of targets (m, 3) by mixed twists J (N, 6, p): v + omega x (R x)."""
    levers = np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    turned = np.cross(J[:, None, 3:, :], levers[..., None], axis=-2)
    return np.asarray(J[:, None, :3, :] + turned)


@dataclass(frozen=True, eq=False)
class Positions(Measurements):
    """Positions of targets whose places on the tool are unknown, as a laser tracker measures them.

    Attributes:
        points: (N, m, 3) positions of m targets in W [m], NaN where a target was not seen.
        sigma: Standard deviation of a coordinate [m].
    """

    points: FloatArray
    sigma: float = SMALL
    fixes_tool: ClassVar[bool] = False

    @property
    def stated(self) -> str:
        """The standard deviation of a coordinate."""
        return stated(self.sigma)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """x, y and z of each target in the tool's frame."""
        return tuple(f"target{j + 1}_{axis}" for j in range(self.points.shape[1]) for axis in "xyz")

    @property
    def seen(self) -> BoolArray:
        """(N, m) whether a target was seen."""
        return np.asarray(np.isfinite(self.points).all(-1))

    @property
    def rows(self) -> IntArray:
        """The target's number among those seen."""
        return np.repeat(np.arange(int(self.seen.sum())), 3)

    @property
    def labels(self) -> tuple[str, ...]:
        """Measurement and target, from 1."""
        return tuple(f"measurement {i + 1}, target {j + 1}" for i, j in np.argwhere(self.seen))

    @property
    def configurations(self) -> IntArray:
        """That of each target seen."""
        return np.argwhere(self.seen)[:, 0]

    @property
    def targets(self) -> tuple[str, ...]:
        """Their numbers, from 1."""
        return tuple(f"target {j + 1}" for j in np.argwhere(self.seen)[:, 1])

    def lengths(self, errors: FloatArray) -> FloatArray:
        """Distance of each target from where it was measured."""
        return np.asarray(self.sigma * np.linalg.norm(errors.reshape(-1, 3), axis=-1))

    def at(self, index: IntArray) -> Self:
        """The measurements of some configurations."""
        return replace(self, points=self.points[index])

    def placed_as(self, other: Self) -> Self:
        """These: targets are unknowns, and no frame is kept."""
        del other
        return self

    def scaled(self, factor: float) -> Self:
        """The measurements with all lengths times a factor."""
        return replace(self, points=factor * self.points)

    def read_otherwise(self) -> Iterator[tuple[str, Self]]:
        """A mirrored frame of the device: every exchange of two axes is one, up to a turn."""
        yield LEFT_HANDED, replace(self, points=self.points * [-1.0, 1.0, 1.0])

    def start(self, T: FloatArray) -> Start:
        """By :func:`register_points`."""
        found = register_points(T, self.points)
        return Start(found.T_W_base, found.points.ravel(), self, found.error)

    def from_frame(self, T: FloatArray, start: Start) -> Start:
        """Targets at their mean places."""
        return start._replace(unknowns=targets_at(T, self.points).ravel())

    def errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """Computed less measured positions."""
        apart = points_on_tool(T, x.reshape(-1, 3)) - self.points
        return np.asarray((apart / self.sigma)[self.seen].ravel())

    def derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """V + omega x (R x_j), and R."""
        N, m, _ = self.points.shape
        by_p = velocities_on_tool(T, J, x.reshape(-1, 3))
        by_x = np.zeros((N, m, 3, 3 * m))
        for j in range(m):
            by_x[:, j, :, 3 * j : 3 * j + 3] = T[:, :3, :3]
        parts = (
            (part / self.sigma)[self.seen].reshape(-1, part.shape[-1]) for part in (by_p, by_x)
        )
        by_p, by_x = parts
        return by_p, by_x


@dataclass(frozen=True, eq=False)
class Poses(Measurements):
    """Poses of a probe whose place on the tool is nearly, or not at all, known.

    Attributes:
        T: (N, 4, 4) poses of the probe in W.
        sigma: Standard deviation of a coordinate [m] and of a turn about an axis [rad].
        T_tool_probe: (4, 4) the probe in the tool's frame.
    """

    T: FloatArray
    sigma: tuple[float, float] = (SMALL, SMALL)
    T_tool_probe: FloatArray = field(default_factory=lambda: np.eye(4))
    fixes_tool: ClassVar[bool] = True

    @property
    def stated(self) -> str:
        """The standard deviations of a coordinate and of a turn."""
        return f"{stated(self.sigma[0])} and {1e3 * self.sigma[1]:.3g} mrad"

    @property
    def unknowns(self) -> tuple[str, ...]:
        """None: the probe's frame is found, and the tool's corrections are parameters."""
        return ()

    @property
    def rows(self) -> IntArray:
        """The measurement."""
        return np.repeat(np.arange(len(self.T)), 6)

    @property
    def labels(self) -> tuple[str, ...]:
        """Measurement, from 1."""
        return tuple(f"measurement {i + 1}" for i in range(len(self.T)))

    @property
    def configurations(self) -> IntArray:
        """One row each."""
        return np.arange(len(self.T))

    def lengths(self, errors: FloatArray) -> FloatArray:
        """Distance of the probe's origin from where it was measured."""
        return np.asarray(self.sigma[0] * np.linalg.norm(errors.reshape(-1, 6)[:, :3], axis=-1))

    def at(self, index: IntArray) -> Self:
        """The measurements of some configurations."""
        return replace(self, T=self.T[index])

    def placed_as(self, other: Self) -> Self:
        """The measurements with the other's frame of the probe."""
        return replace(self, T_tool_probe=other.T_tool_probe)

    def scaled(self, factor: float) -> Self:
        """The measurements with all lengths times a factor."""
        scale = np.ones((4, 4))
        scale[:3, 3] = factor
        return replace(self, T=scale * self.T)

    def read_otherwise(self) -> Iterator[tuple[str, Self]]:
        """Quaternions with their components in another order, and orientations turned back."""
        R = self.T[:, :3, :3]
        for words, turned in (
            (_XYZW, rotations(np.roll(quaternions(R), 1, axis=-1))),
            (_WXYZ, rotations(np.roll(quaternions(R), -1, axis=-1))),
            (_TURNED_BACK, R.swapaxes(1, 2)),
        ):
            T = self.T.copy()
            T[:, :3, :3] = turned
            yield words, replace(self, T=T)

    def start(self, T: FloatArray) -> Start:
        """By :func:`register_poses`."""
        T_W_base, T_tool_probe = register_poses(T, self.T)
        apart = (T_W_base @ T @ T_tool_probe - self.T)[:, :3, 3]
        misfit = float(np.sqrt((apart**2).sum(-1).mean()))
        return Start(T_W_base, np.zeros(0), replace(self, T_tool_probe=T_tool_probe), misfit)

    def from_frame(self, T: FloatArray, start: Start) -> Start:
        """The probe at its mean place."""
        return start._replace(measurements=replace(self, T_tool_probe=mean_pose(T, self.T)))

    def errors(self, T: FloatArray, x: FloatArray) -> FloatArray:  # noqa: ARG002
        """Computed less measured positions, and the turns from measured to computed axes in W."""
        found = T @ self.T_tool_probe
        apart = found[:, :3, 3] - self.T[:, :3, 3]
        turned = so3.log(found[:, :3, :3] @ self.T[:, :3, :3].swapaxes(-1, -2))
        return np.concatenate([apart / self.sigma[0], turned / self.sigma[1]], -1).ravel()

    def derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The twist of the probe's origin, to the first order of the error of orientation."""
        v = velocities_on_tool(T, J, self.T_tool_probe[None, :3, 3])[:, 0]
        by_p = np.concatenate([v / self.sigma[0], J[:, 3:] / self.sigma[1]], 1)
        return by_p.reshape(-1, J.shape[-1]), np.zeros((6 * len(T), len(x)))
