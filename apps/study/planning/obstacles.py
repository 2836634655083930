"""Converts obstacles and capsules to shapes of the collision library coal.

Source: T. Duff and others, Building an orthonormal basis, revisited, 2017. The paper gives formulas
for coordinate frames along lines.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError
from chasles.contract import as_path, open_input, requires
from chasles.summaries import summary_repr

from ..arguments import above_0, finite, pose

FloatArray = NDArray[np.float64]

_POINT = 1e-9
"""Maximum segment length [m] of a capsule that counts as a sphere, with the z axis (0, 0, 1)."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A fixed shape that the robot must not touch.

    Attributes:
        shape: A collision shape from the Python package coal.
        T_0_shape: (4, 4) pose of the shape in the base frame.
        name: Name that identifies the obstacle in messages.
    """

    shape: Any
    T_0_shape: FloatArray
    name: str

    def __repr__(self) -> str:
        """Short summary with the main values."""
        x, y, z = self.T_0_shape[:3, 3]
        return summary_repr(
            self, "", self.name, f"{type(self.shape).__name__} at ({x:.4g}, {y:.4g}, {z:.4g}) m"
        )


def sphere(center: ArrayLike, radius: float, name: str = "sphere") -> Obstacle:
    """Return a sphere, an obstacle for `configuration_space`.

    Args:
        center: (3,) center in the base frame [m].
        radius: Radius [m].
        name: Name of the obstacle in messages.

    Raises:
        ShapeError: `center` is not (3,).
        InputValueError: A number is not finite, or `radius` is not above 0.
    """
    with requires("chasles[planning]"):
        import coal  # noqa: PLC0415

    T = np.eye(4)
    T[:3, 3] = finite("sphere: center", center, (3,))
    return Obstacle(coal.Sphere(above_0("sphere: radius", radius)), T, name)


def box(T_0_box: ArrayLike, size: ArrayLike, name: str = "box") -> Obstacle:
    """Return a box, an obstacle for `configuration_space`.

    Args:
        T_0_box: (4, 4) pose of the box in the base frame. The position [m] is the center of the
            box.
        size: (3,) side lengths along the x, y and z axes of the box [m].
        name: Name of the obstacle in messages.

    Raises:
        ShapeError: `T_0_box` is not (4, 4), or `size` is not (3,).
        InputValueError: A number is not finite, a side length is not above 0, or `T_0_box` is not
            rigid.
    """
    with requires("chasles[planning]"):
        import coal  # noqa: PLC0415

    lengths = [above_0("box: size", side) for side in finite("box: size", size, (3,))]
    return Obstacle(coal.Box(*lengths), pose("box: T_0_box", T_0_box), name)


def capsule(start: ArrayLike, end: ArrayLike, radius: float, name: str = "capsule") -> Obstacle:
    """Return a capsule (the points near a line segment), an obstacle for `configuration_space`.

    Args:
        start: (3,) start of the segment in the base frame [m].
        end: (3,) end of the segment in the base frame [m].
        radius: Maximum distance of the points from the segment [m].
        name: Name of the obstacle in messages.

    Raises:
        ShapeError: `start` or `end` is not (3,).
        InputValueError: A number is not finite, or `radius` is not above 0.
    """
    with requires("chasles[planning]"):
        import coal  # noqa: PLC0415

    a, b = finite("capsule: start", start, (3,)), finite("capsule: end", end, (3,))
    length, T = capsules_along(a[None], b[None])
    shape = coal.Capsule(above_0("capsule: radius", radius), float(length[0]))
    return Obstacle(shape, T[0], name)


def mesh(
    path: str | os.PathLike[str], T_0_mesh: ArrayLike | None = None, name: str = ""
) -> Obstacle:
    """Return a triangle mesh from a file, an obstacle for `configuration_space`.

    Args:
        path: A .stl, .obj or .dae file with coordinates in meters.
        T_0_mesh: (4, 4) pose of the file's coordinate frame in the base frame, position in [m].
            None means the base frame.
        name: Name of the obstacle in messages. "" means the file name.

    Raises:
        ShapeError: `T_0_mesh` is not (4, 4).
        InputValueError: The file cannot be read, or contains no triangle mesh. `T_0_mesh` contains
            a number that is not finite, or is not rigid.
    """
    name_of_file = os.fspath(as_path("mesh: path", path))
    with requires("chasles[planning]"):
        import coal  # noqa: PLC0415

    try:
        open_input(path).close()
        shape = coal.MeshLoader().load(name_of_file, np.ones(3))
    except OSError as error:
        raise InputValueError(f"mesh: path: {name_of_file}: {error.strerror}") from None
    except ValueError as error:
        raise InputValueError(f"mesh: path: {name_of_file}: expected a triangle mesh") from error
    T = np.eye(4) if T_0_mesh is None else pose("mesh: T_0_mesh", T_0_mesh)
    return Obstacle(shape, T, name or Path(path).name)


def capsules_along(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the distance (m,) and a pose (m, 4, 4) at the midpoint of each pair of points.

    The z axis of the pose points from the first point to the second point.
    """
    step = b - a
    length = np.linalg.norm(step, axis=-1)
    z = np.where(length[:, None] > _POINT, step / np.maximum(length, _POINT)[:, None], [0, 0, 1])
    # The formulas of Frisvad and Duff compute the axes x and y from the axis z without a cross
    # product.
    sign = np.where(z[:, 2] >= 0, 1.0, -1.0)
    u = -1 / (sign + z[:, 2])
    v = z[:, 0] * z[:, 1] * u
    x = np.stack([1 + sign * z[:, 0] ** 2 * u, sign * v, -sign * z[:, 0]], axis=-1)
    y = np.stack([v, sign + z[:, 1] ** 2 * u, -z[:, 1]], axis=-1)
    T = np.tile(np.eye(4), (len(a), 1, 1))
    T[:, :3, :3] = np.stack([x, y, z], axis=-1)
    T[:, :3, 3] = (a + b) / 2
    return np.asarray(length), T
