"""Projections of a drawing: along the base axes, axonometric, or onto the robot's plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError

from .skeleton import Skeleton

FloatArray = NDArray[np.float64]
_SAME_PLANE = 1e-6
"""Maximum sine of the angle between parallel axes. The residuals of loops solved by iteration are
about 1e-9."""
_AZIMUTH, _ELEVATION = math.radians(-56), math.radians(22)


@dataclass(frozen=True)
class View:
    """A parallel projection.

    Attributes:
        name: Name of the view.
        right: Direction in the base frame that points to the right.
        up: Direction in the base frame that points up.
        labels: Axis labels of both directions, or "" for the axonometric view.
    """

    name: str
    right: tuple[float, float, float]
    up: tuple[float, float, float]
    labels: tuple[str, str] = ("", "")

    @property
    def rows(self) -> FloatArray:
        """(3, 3) directions to the right, up and towards the viewer, in the base frame."""
        return np.array([self.right, self.up, np.cross(self.right, self.up)])

    def project(self, points: FloatArray) -> FloatArray:
        """Project points (..., 3) to the drawing plane (..., 2) [m]."""
        seen: FloatArray = points @ self.rows[:2].T
        return seen

    def depth(self, points: FloatArray) -> float:
        """Return the mean depth of points (k, 3) [m].

        The depth value increases toward the viewer.
        """
        return float(np.mean(points @ self.rows[2]))


def _from_aside() -> View:
    (ca, sa), (ce, se) = ((math.cos(v), math.sin(v)) for v in (_AZIMUTH, _ELEVATION))
    return View("axonometric", (-sa, ca, 0.0), (-se * ca, -se * sa, ce))


FRONT = View("front", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), ("x", "z"))
SIDE = View("side", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), ("y", "z"))
TOP = View("top", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), ("x", "y"))
AXONOMETRIC = _from_aside()
SPATIAL = (TOP, AXONOMETRIC, FRONT, SIDE)
"""The views of a spatial robot, in third-angle projection."""
VIEWS = {view.name: view for view in SPATIAL}


def views_of(skeleton: Skeleton, poses: FloatArray, names: tuple[str, ...] | None) -> list[View]:
    """Return the views of a drawing.

    Args:
        skeleton: The bodies.
        poses: (bodies, 4, 4) poses of the bodies.
        names: "front" (x to the right, z up), "side" (y to the right, z up), "top" (x to the right,
            y up), "axonometric", or "plane" for a planar robot. If `names` is None, a planar robot
            gets the view "plane", and a spatial robot gets the other four views.

    Raises:
        InputValueError: A name is unknown.
    """
    plane = plane_of(skeleton, poses)
    known = VIEWS | ({"plane": plane} if plane else {})
    if names is None:
        return [plane] if plane else list(SPATIAL)
    for name in names:
        if name not in known:
            raise InputValueError(f"views: expected some of {', '.join(known)}, got {name!r}")
    return [known[name] for name in names]


def plane_of(skeleton: Skeleton, poses: FloatArray) -> View | None:
    """Return the view onto the plane of motion of a planar robot, or None for a spatial robot.

    All revolute axes of a planar robot are normal to the plane. All prismatic axes lie in the
    plane.
    """
    turns: list[FloatArray] = []
    slides: list[FloatArray] = []
    for body, T in zip(skeleton.bodies, poses, strict=True):
        if body.joint and body.joint.kind != "fixed":
            axis = T[:3, :3] @ np.array(body.joint.axis)
            (slides if body.joint.kind == "prismatic" else turns).append(axis)
            if body.joint.kind == "helical":
                return None
    if not turns:
        return None
    normal = turns[0] / np.linalg.norm(turns[0])
    if any(np.linalg.norm(np.cross(normal, axis)) > _SAME_PLANE for axis in turns):
        return None
    if any(abs(normal @ axis) > _SAME_PLANE for axis in slides):
        return None
    return _on(normal)


def _on(normal: FloatArray) -> View:
    """Return the view along a normal."""
    main = int(np.argmax(np.abs(normal)))
    if abs(normal[main]) > 1 - _SAME_PLANE:
        base = (SIDE, FRONT, TOP)[main]
        return View("plane", base.right, base.up, base.labels)
    up = np.array([0.0, 0.0, 1.0]) - normal * normal[2]
    up /= np.linalg.norm(up)
    right = np.cross(up, normal)
    right *= 1.0 if right[np.argmax(np.abs(right))] > 0 else -1.0
    return View("plane", (right[0], right[1], right[2]), (up[0], up[1], up[2]))
