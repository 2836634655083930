"""Measurements of a robot's tool in the frame W of a measuring device.

A `Measurements` object contains the measured values at N configurations. A `Measurements` object
also defines additional unknowns, such as the positions of targets in the tool frame. Errors of
measured values are divided by the standard deviations of the measurements. A measurement row is a
pose, a target position or a scalar measurement. If one error of a measurement row is an outlier,
the whole row is excluded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from chasles import ShapeError, so3
from chasles.arrays import real_array

from .frames import mean_pose, register_points, register_poses, targets_at
from .quaternions import quaternions, rotations

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

SMALL = 1e-3
"""Default standard deviation of measured positions [m] and rotations [rad]."""

_XYZW = "quaternions are written x, y, z, w, not w, x, y, z"
_WXYZ = "quaternions are written w, x, y, z, not x, y, z, w"
LEFT_HANDED = (
    "the device frame is left-handed: two of x, y and z are swapped, or one has the wrong sign"
)
_TURNED_BACK = "rotations are inverse: they transform from the device frame to the probe frame"


class Start(NamedTuple):
    """Start values of an identification: frames and unknowns estimated with the nominal robot.

    Attributes:
        T_W_base: (4, 4) the base frame in the device frame W.
        unknowns: (u,) start values of the unknowns, such as target positions [m].
        measurements: The measurements, with their estimated frames.
        misfit: Root mean square deviation of the measurements from values computed with the nominal
            robot [m].
    """

    T_W_base: FloatArray
    unknowns: FloatArray
    measurements: Measurements
    misfit: float


class Measurements(ABC):
    """Measurements of the tool at N configurations. Base class of all kinds of measurements."""

    _n_frame_unknowns: ClassVar[int]
    """Number of frame coordinates that `_start` estimates in addition to `unknowns`."""
    _fixes_tool: ClassVar[bool]
    """Whether the tool orientation is measured. If the orientation is measured, corrections of the
    tool frame are identified instead of target positions."""
    _shapes: ClassVar[Mapping[str, tuple[int | None, ...]]]
    """Required shape of each measured array, keyed by attribute name. In a shape, None stands for
    any size."""

    def __post_init__(self) -> None:
        """Check the types and shapes of the measured arrays.

        Raises:
            InputTypeError: An array of measurements contains values that are not real numbers.
            ShapeError: An array of measurements has the wrong shape.
        """
        for name, sizes in self._shapes.items():
            array = real_array(type(self).__name__, name, getattr(self, name))
            fits = [size in (None, found) for size, found in zip(sizes, array.shape, strict=False)]
            if array.ndim != len(sizes) or not all(fits):
                wanted = ", ".join("any" if size is None else str(size) for size in sizes)
                raise ShapeError(
                    f"{type(self).__name__}: {name}: expected shape ({wanted}), got {array.shape}"
                )
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        """Return the number N of configurations."""
        return len(getattr(self, next(iter(self._shapes))))

    @property
    @abstractmethod
    def _stated(self) -> str:
        """The standard deviations of the measurements, as text."""

    @property
    @abstractmethod
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns that `identify` determines together with the parameters."""

    @property
    @abstractmethod
    def rows(self) -> IntArray:
        """(M,) index of the measurement row to which each error belongs."""

    @property
    def _surplus(self) -> int:
        """Number of errors minus number of unknowns, if no robot parameter is identified."""
        return len(self.rows) - len(self.unknowns) - self._n_frame_unknowns

    @property
    @abstractmethod
    def labels(self) -> tuple[str, ...]:
        """Name of each measurement row, for messages."""

    @property
    @abstractmethod
    def configurations(self) -> IntArray:
        """(rows,) index of the configuration of each measurement row."""

    @property
    def targets(self) -> tuple[str, ...]:
        """Name of the target or probe in each measurement row."""
        return ("probe",) * len(self.configurations)

    @abstractmethod
    def _lengths(self, errors: FloatArray) -> FloatArray:
        """Convert errors (M,) to the distance error (rows,) of each measurement row [m]."""

    @abstractmethod
    def _start(self, T: FloatArray) -> Start:
        """Estimate frames and unknowns from nominal tool poses (N, 4, 4) in the base frame."""

    def _from_frame(self, T: FloatArray, start: Start) -> Start:  # noqa: ARG002
        """Update the start values for a known base frame.

        The tool poses T (N, 4, 4) are in the device frame W. By default, the start values do not
        change. Subclasses may update target positions, station frames or the probe frame.
        """
        return start

    @abstractmethod
    def at(self, index: IntArray) -> Self:
        """Return the measurements at the configurations `index`, with the same frames."""

    @abstractmethod
    def _placed_as(self, other: Self) -> Self:
        """Return a copy of the measurements with the frames that were identified for `other`."""

    @abstractmethod
    def _scaled(self, factor: float) -> Self:
        """Return the measurements with all lengths multiplied by a factor."""

    def _read_otherwise(self) -> Iterator[tuple[str, Self]]:
        return iter(())

    @abstractmethod
    def _errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """Return the (M,) errors of measurements for tool poses T (N, 4, 4) in W and unknowns x."""

    @abstractmethod
    def _derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives of the errors with respect to robot parameters and unknowns.

        J (N, 6, p) is the mixed Jacobian of the tool with respect to the robot parameters, in the
        axes of the device frame W. The two derivatives have shapes (M, p) and (M, u) for M errors,
        p parameters and u unknowns.
        """


def stated(sigma: float) -> str:
    """Return a standard deviation [m] as text."""
    return f"{1e3 * sigma:.3g} mm"


def points_on_tool(T: FloatArray, targets: FloatArray) -> FloatArray:
    """Return the positions (N, m, 3) of targets (m, 3) on the tool at poses (N, 4, 4)."""
    return np.asarray(T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets))


def velocities_on_tool(T: FloatArray, J: FloatArray, targets: FloatArray) -> FloatArray:
    """Return the velocities (N, m, 3, p) of targets (m, 3) for mixed Jacobians J (N, 6, p).

    On a tool with orientation R and twist (v, omega), a target at position r has the velocity v +
    omega x (R r). The target position r is in the tool frame.
    """
    levers = np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    turned = np.cross(J[:, None, 3:, :], levers[..., None], axis=-2)
    return np.asarray(J[:, None, :3, :] + turned)


@dataclass(frozen=True, eq=False)
class Positions(Measurements):
    """Positions of targets at unknown positions on the tool, for example from a laser tracker.

    Attributes:
        points: (N, m, 3) positions of m targets in the frame W of the measuring device [m], NaN for
            invisible targets.
        sigma: Standard deviation of each position coordinate [m].
    """

    points: FloatArray
    sigma: float = SMALL
    _n_frame_unknowns: ClassVar[int] = 6
    _fixes_tool: ClassVar[bool] = False
    _shapes: ClassVar[Mapping[str, tuple[int | None, ...]]] = {"points": (None, None, 3)}

    @property
    def _stated(self) -> str:
        return stated(self.sigma)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the x, y and z coordinates of each target in the tool frame."""
        return tuple(f"target{j + 1}_{axis}" for j in range(self.points.shape[1]) for axis in "xyz")

    @property
    def _seen(self) -> BoolArray:
        """(N, m) mask of the targets that were visible at each configuration."""
        return np.asarray(np.isfinite(self.points).all(-1))

    @property
    def rows(self) -> IntArray:
        """Index of the measurement row of each error.

        A row contains the three errors of one visible target at one configuration.
        """
        return np.repeat(np.arange(int(self._seen.sum())), 3)

    @property
    def labels(self) -> tuple[str, ...]:
        """Label of each measurement row: measurement number and target number, counted from 1."""
        return tuple(f"measurement {i + 1}, target {j + 1}" for i, j in np.argwhere(self._seen))

    @property
    def configurations(self) -> IntArray:
        """Index of the configuration at which each visible target was measured."""
        return np.argwhere(self._seen)[:, 0]

    @property
    def targets(self) -> tuple[str, ...]:
        """Name of the target in each measurement row, numbered from 1."""
        return tuple(f"target {j + 1}" for j in np.argwhere(self._seen)[:, 1])

    def _lengths(self, errors: FloatArray) -> FloatArray:
        return np.asarray(self.sigma * np.linalg.norm(errors.reshape(-1, 3), axis=-1))

    def at(self, index: IntArray) -> Self:
        """Return the measurements at some configurations."""
        return replace(self, points=self.points[index])

    def _placed_as(self, other: Self) -> Self:
        del other
        return self

    def _scaled(self, factor: float) -> Self:
        return replace(self, points=factor * self.points)

    def _read_otherwise(self) -> Iterator[tuple[str, Self]]:
        """Yield the measurements with mirrored x coordinates, for a left-handed device frame."""
        yield LEFT_HANDED, replace(self, points=self.points * [-1.0, 1.0, 1.0])

    def _start(self, T: FloatArray) -> Start:
        found = register_points(T, self.points)
        return Start(found.T_W_base, found.points.ravel(), self, found.error)

    def _from_frame(self, T: FloatArray, start: Start) -> Start:
        return start._replace(unknowns=targets_at(T, self.points).ravel())

    def _errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        apart = points_on_tool(T, x.reshape(-1, 3)) - self.points
        return np.asarray((apart / self.sigma)[self._seen].ravel())

    def _derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        N, m, _ = self.points.shape
        by_p = velocities_on_tool(T, J, x.reshape(-1, 3))
        by_x = np.zeros((N, m, 3, 3 * m))
        for j in range(m):
            by_x[:, j, :, 3 * j : 3 * j + 3] = T[:, :3, :3]
        parts = (
            (part / self.sigma)[self._seen].reshape(-1, part.shape[-1]) for part in (by_p, by_x)
        )
        by_p, by_x = parts
        return by_p, by_x


@dataclass(frozen=True, eq=False)
class Poses(Measurements):
    """Poses of a probe that is mounted on the tool in an unknown pose.

    Attributes:
        T: (N, 4, 4) poses of the probe in the frame W of the measuring device, positions in [m].
        sigma: Standard deviations of a position coordinate [m] and of a rotation component [rad].
        T_tool_probe: (4, 4) pose of the probe frame in the tool frame.
    """

    T: FloatArray
    sigma: tuple[float, float] = (SMALL, SMALL)
    T_tool_probe: FloatArray = field(default_factory=lambda: np.eye(4))
    _n_frame_unknowns: ClassVar[int] = 12
    _fixes_tool: ClassVar[bool] = True
    _shapes: ClassVar[Mapping[str, tuple[int | None, ...]]] = {
        "T": (None, 4, 4),
        "T_tool_probe": (4, 4),
    }

    @property
    def _stated(self) -> str:
        return f"{stated(self.sigma[0])} and {1e3 * self.sigma[1]:.3g} mrad"

    @property
    def unknowns(self) -> tuple[str, ...]:
        """An empty tuple, because tool frame corrections are robot parameters, not unknowns."""
        return ()

    @property
    def rows(self) -> IntArray:
        """Index of the measurement row of each error.

        The six errors of a pose belong to the same row.
        """
        return np.repeat(np.arange(len(self.T)), 6)

    @property
    def labels(self) -> tuple[str, ...]:
        """Label of each measurement row: measurement number, counted from 1."""
        return tuple(f"measurement {i + 1}" for i in range(len(self.T)))

    @property
    def configurations(self) -> IntArray:
        """Index of the configuration of each measurement row."""
        return np.arange(len(self.T))

    def _lengths(self, errors: FloatArray) -> FloatArray:
        return np.asarray(self.sigma[0] * np.linalg.norm(errors.reshape(-1, 6)[:, :3], axis=-1))

    def at(self, index: IntArray) -> Self:
        """Return the measurements at some configurations."""
        return replace(self, T=self.T[index])

    def _placed_as(self, other: Self) -> Self:
        return replace(self, T_tool_probe=other.T_tool_probe)

    def _scaled(self, factor: float) -> Self:
        scale = np.ones((4, 4))
        scale[:3, 3] = factor
        return replace(self, T=scale * self.T)

    def _read_otherwise(self) -> Iterator[tuple[str, Self]]:
        """Yield the poses with reordered quaternion components, then with inverse rotations."""
        R = self.T[:, :3, :3]
        for words, turned in (
            (_XYZW, rotations(np.roll(quaternions(R), 1, axis=-1))),
            (_WXYZ, rotations(np.roll(quaternions(R), -1, axis=-1))),
            (_TURNED_BACK, R.swapaxes(1, 2)),
        ):
            T = self.T.copy()
            T[:, :3, :3] = turned
            yield words, replace(self, T=T)

    def _start(self, T: FloatArray) -> Start:
        T_W_base, T_tool_probe = register_poses(T, self.T)
        apart = (T_W_base @ T @ T_tool_probe - self.T)[:, :3, 3]
        misfit = float(np.sqrt((apart**2).sum(-1).mean()))
        return Start(T_W_base, np.zeros(0), replace(self, T_tool_probe=T_tool_probe), misfit)

    def _from_frame(self, T: FloatArray, start: Start) -> Start:
        return start._replace(measurements=replace(self, T_tool_probe=mean_pose(T, self.T)))

    def _errors(self, T: FloatArray, x: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the position and orientation errors of the probe, in standard deviations.

        An orientation error is the rotation vector from the measured to the computed orientation.
        """
        found = T @ self.T_tool_probe
        apart = found[:, :3, 3] - self.T[:, :3, 3]
        turned = so3.log(found[:, :3, :3] @ self.T[:, :3, :3].swapaxes(-1, -2))
        return np.concatenate([apart / self.sigma[0], turned / self.sigma[1]], -1).ravel()

    def _derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        v = velocities_on_tool(T, J, self.T_tool_probe[None, :3, 3])[:, 0]
        by_p = np.concatenate([v / self.sigma[0], J[:, 3:] / self.sigma[1]], 1)
        return by_p.reshape(-1, J.shape[-1]), np.zeros((6 * len(T), len(x)))
