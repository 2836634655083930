"""The content of one drawing view: robot, additional pale configurations, tool path and frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .marks import Anchor, Mark, anchors, hull, marks
from .skeleton import Skeleton
from .views import View

FloatArray = NDArray[np.float64]

UNIT = {"one": 0.016, "four": 0.022}
"""Radius of a joint symbol relative to the widest view, for figures with one view and for figures
with four views."""
_ARROW = 6.0
"""Length of frame arrows in drawing units."""
_LINES = ("link", "rod", "ram", "piston")
_MARGIN, _SCALE = 2.5, 3.5
"""Margin of a view and height of the scale bar, in drawing units."""
_FLAT = 1e-6
"""Maximum height of a triangle that is drawn as a line, relative to its longest side."""


@dataclass(frozen=True)
class Frame:
    """A coordinate frame in a drawing.

    Attributes:
        name: Name of the frame.
        origin: (2,) projected origin [m].
        tips: (3, 2) projected tips of the arrows along the x, y and z axes [m].
    """

    name: str
    origin: FloatArray
    tips: FloatArray


@dataclass(frozen=True)
class Dimension:
    """A dimension between two points of a body.

    Attributes:
        a: (2,) projected start point [m].
        b: (2,) projected end point [m].
        length: The length [m].
    """

    a: FloatArray
    b: FloatArray
    length: float


@dataclass(frozen=True)
class Scene:
    """One view of the robot with all elements that are drawn in the view.

    Attributes:
        view: The projection.
        unit: Radius of a joint symbol [m].
        marks: Lines and areas of the robot, in drawing order.
        ghosts: For each ghost, the projected lines (k, 2) of its bodies [m].
        path: (k, 2) the projected tool path [m], or None.
        frames: The base frame and the tip frame.
        anchors: Points at which the coordinate labels are placed.
        dimensions: Dimensions of the bodies, in a planar view.
    """

    view: View
    unit: float
    marks: list[Mark]
    ghosts: list[list[FloatArray]]
    path: FloatArray | None
    frames: list[Frame]
    anchors: list[Anchor]
    dimensions: list[Dimension]

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the bounding box, with a margin [m]."""
        points = [mark.points for mark in self.marks]
        points += [line for ghost in self.ghosts for line in ghost]
        points += [frame.tips for frame in self.frames]
        points += [] if self.path is None else [self.path]
        every = np.concatenate(points)
        margin = _MARGIN * self.unit
        below = _SCALE * self.unit if self.view.name == "axonometric" else 0.0
        return every.min(0) - margin - np.array([0.0, below]), every.max(0) + margin


def scenes(
    skeleton: Skeleton,
    poses: FloatArray,
    ghosts: FloatArray,
    path: FloatArray | None,
    views: list[View],
    span_of: FloatArray | None = None,
) -> list[Scene]:
    """Return one scene per view.

    Args:
        skeleton: The bodies.
        poses: (bodies, 4, 4) poses of the bodies in the base frame.
        ghosts: (g, bodies, 4, 4) body poses of g additional configurations, which are drawn in pale
            colors.
        path: (k, 3) tool positions, or None.
        views: The projections.
        span_of: (m, bodies, 4, 4) body poses that determine the symbol size, or None to use `poses`
            and `ghosts`.
    """
    everything = span_of if span_of is not None else np.concatenate([poses[None], ghosts])
    points = np.concatenate([corners(skeleton, one) for one in everything])
    if path is not None:
        points = np.concatenate([points, path])
    spans = [np.ptp(view.project(points), axis=0).max() for view in views]
    share = UNIT["one" if len(views) == 1 else "four"]
    unit = share * float(max(*spans, 1e-3 * skeleton.size))
    return [_scene(skeleton, poses, ghosts, path, view, unit) for view in views]


def corners(skeleton: Skeleton, poses: FloatArray) -> FloatArray:
    """Return the points (k, 3) of all shapes and of the tip in the base frame [m]."""
    found = [skeleton.tip_poses(poses)[None, :3, 3], np.zeros((1, 3))]
    for body, T in zip(skeleton.bodies, poses, strict=True):
        found += [np.array(s.points) @ T[:3, :3].T + T[:3, 3] for s in body.shapes]
    return np.concatenate(found)


def _scene(
    skeleton: Skeleton,
    poses: FloatArray,
    ghosts: FloatArray,
    path: FloatArray | None,
    view: View,
    unit: float,
) -> Scene:
    is_planar = view.name == "plane"
    frames = [
        _frame(name, T, view, unit)
        for name, T in (
            (skeleton.robot.base_frame, np.eye(4)),
            (skeleton.robot.tip_frame, skeleton.tip_poses(poses)),
        )
    ]
    return Scene(
        view,
        unit,
        marks(skeleton, poses, view, unit),
        [_lines(skeleton, ghost, view, unit) for ghost in ghosts],
        None if path is None else view.project(path),
        frames,
        anchors(skeleton, poses, view),
        _dimensions(skeleton, poses, view) if is_planar else [],
    )


def _frame(name: str, T: FloatArray, view: View, unit: float) -> Frame:
    tips = T[:3, 3] + _ARROW * unit * T[:3, :3].T
    return Frame(name, view.project(T[:3, 3]), view.project(tips))


def _lines(skeleton: Skeleton, poses: FloatArray, view: View, unit: float) -> list[FloatArray]:
    """Return the lines of bodies and the outlines of plates, without the ground."""
    found = []
    for mark in marks(skeleton, poses, view, unit):
        if mark.style in _LINES and mark.name != skeleton.bodies[0].name:
            found.append(mark.points)
        elif mark.style == "plate":
            found.append(np.concatenate([mark.points, mark.points[:1]]))
    return found


def _dimensions(skeleton: Skeleton, poses: FloatArray, view: View) -> list[Dimension]:
    """Return the dimensions of links, rods and sides of triangular plates."""
    found: list[Dimension] = []
    for body, T in zip(skeleton.bodies, poses, strict=True):
        for shape in body.shapes:
            points = np.array(shape.points) @ T[:3, :3].T + T[:3, 3]
            if shape.kind == "plate" and body.joint:
                found += _sides(hull(view.project(points)))
                continue
            if shape.kind not in ("link", "rod"):
                continue
            found += _parts(view.project(points))
    return found


def _sides(around: FloatArray) -> list[Dimension]:
    """Return the sides of a triangle. A flat triangle becomes a line."""
    if len(around) != 3:  # noqa: PLR2004 - a triangle has three corners
        return []
    u, v = around[1] - around[0], around[2] - around[0]
    if abs(u[0] * v[1] - u[1] * v[0]) > _FLAT * float(max(u @ u, v @ v)):
        return _parts(around[[0, 1, 2, 0]])
    order = np.argsort(around @ max((u, v), key=lambda vector: float(vector @ vector)))
    return _parts(around[order])


def _parts(seen: FloatArray) -> list[Dimension]:
    lengths = np.linalg.norm(np.diff(seen, axis=0), axis=1)
    return [
        Dimension(a, b, float(length))
        for a, b, length in zip(seen, seen[1:], lengths, strict=False)
        if length > 0
    ]
