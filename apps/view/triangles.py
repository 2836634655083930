"""Simple solids as triangle meshes: cylinders, boxes, spheres and plates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_AROUND = 20
"""Number of corners of a drawn circle. A circle with 20 corners looks round, and the meshes of a
robot need only a few kilobytes."""
_BANDS = 8
"""Number of bands of a sphere from pole to pole."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A triangle mesh.

    Attributes:
        vertices: (v, 3) vertices [m].
        faces: (f, 3) vertex indices of each triangle, counterclockwise as seen from outside.
    """

    vertices: FloatArray
    faces: NDArray[np.int32]


def joined(parts: Sequence[Triangles]) -> Triangles:
    """Merge several meshes into one."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts[:-1], strict=True)]
    return Triangles(
        np.vstack([np.empty((0, 3)), *(part.vertices for part in parts)]),
        np.vstack([np.empty((0, 3), dtype=np.int32), *faces]).astype(np.int32),
    )


def tube(a: FloatArray, b: FloatArray, radius: float) -> Triangles:
    """Return a closed cylinder between two points.

    Args:
        a: (3,) center of the first end face [m].
        b: (3,) center of the second end face [m].
        radius: Radius [m].
    """
    x, y = _across(b - a)
    angle = np.arange(_AROUND) * (2 * np.pi / _AROUND)
    ring = radius * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y)
    # The end faces have separate vertices. With shared vertices, shading would make the edges
    # round.
    vertices = np.vstack([ring + a, ring + b, ring + a, ring + b, [a, b]])
    here, there = np.arange(_AROUND), np.roll(np.arange(_AROUND), -1)
    n, center = _AROUND, np.full(_AROUND, 4 * _AROUND)
    faces = [
        np.column_stack([here, there, there + n]),
        np.column_stack([here, there + n, here + n]),
        np.column_stack([center, there + 2 * n, here + 2 * n]),
        np.column_stack([center + 1, here + 3 * n, there + 3 * n]),
    ]
    return Triangles(vertices, np.vstack(faces).astype(np.int32))


def ball(center: FloatArray, radius: float) -> Triangles:
    """Return a sphere."""
    polar = np.linspace(0, np.pi, _BANDS + 1)[:, None]
    angle = np.arange(_AROUND) * (2 * np.pi / _AROUND)
    z = np.broadcast_to(np.cos(polar), (_BANDS + 1, _AROUND))
    shell = np.stack([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), z], -1)
    first = np.arange(_BANDS)[:, None] * _AROUND
    here, there = first + np.arange(_AROUND), first + np.roll(np.arange(_AROUND), -1)
    faces = [(here, here + _AROUND, there + _AROUND), (here, there + _AROUND, there)]
    corners = [np.stack(face, -1).reshape(-1, 3) for face in faces]
    return Triangles(center + radius * shell.reshape(-1, 3), np.vstack(corners).astype(np.int32))


def box(center: FloatArray, axes: FloatArray, size: FloatArray) -> Triangles:
    """Return a box.

    Args:
        center: (3,) center [m].
        axes: (3, 3) directions of the edges as columns, a right-handed frame.
        size: (3,) edge lengths [m].
    """
    vertices: list[FloatArray] = []
    faces: list[list[int]] = []
    for k in range(3):
        u, v = np.roll(np.eye(3), -k, 0)[1:]
        for side in (1.0, -1.0):
            # Four separate vertices per side give flat shading.
            corners = [side * np.eye(3)[k] + a * u + b * v for a, b in _SQUARE[:: int(side)]]
            faces += [[len(vertices) + i for i in face] for face in ((0, 1, 2), (0, 2, 3))]
            vertices += corners
    shaped = np.array(vertices) * (np.asarray(size) / 2)
    return Triangles(center + shaped @ np.asarray(axes).T, np.array(faces, dtype=np.int32))


def box_on(center: FloatArray, axis: FloatArray, size: FloatArray) -> Triangles:
    """Return a box with the third edge along an axis. The rotation about the axis is arbitrary."""
    z = axis / np.linalg.norm(axis)
    x, y = _across(z)
    return box(center, np.column_stack([x, y, z]), size)


def plate(corners: FloatArray, thickness: float) -> Triangles:
    """Return a plate whose outline is a convex polygon.

    Args:
        corners: (k, 3) three or more corners of the polygon, in order [m].
        thickness: Thickness of the plate [m].
    """
    center = corners.mean(0)
    normal = np.cross(corners - center, np.roll(corners, -1, 0) - center).sum(0)
    shift = normal * (thickness / 2 / max(float(np.linalg.norm(normal)), 1e-300))
    k = len(corners)
    vertices = np.vstack([corners + shift, corners - shift, corners + shift, corners - shift])
    vertices = np.vstack([vertices, [center + shift, center - shift]])
    here, there = np.arange(k), np.roll(np.arange(k), -1)
    top, bottom = np.full(k, 4 * k), np.full(k, 4 * k + 1)
    faces = [
        np.column_stack([top, here, there]),
        np.column_stack([bottom, there + k, here + k]),
        np.column_stack([here + 3 * k, there + 3 * k, there + 2 * k]),
        np.column_stack([here + 3 * k, there + 2 * k, here + 2 * k]),
    ]
    return Triangles(vertices, np.vstack(faces).astype(np.int32))


_SQUARE = ((1, 1), (-1, 1), (-1, -1), (1, -1))


def _across(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two directions that form a right-handed frame with an axis."""
    length = float(np.linalg.norm(axis))
    z = axis / length if length > 0 else np.array([0.0, 0.0, 1.0])
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return x, np.cross(z, x)
