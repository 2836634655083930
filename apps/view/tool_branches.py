"""The postures with which a robot holds its tool at a pose, for a tool that is dragged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import Robot, Solutions

from ..drawing.figure import redundancy_at

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_LEAST_ERROR_BUDGET = 60
"""Evaluations of forward kinematics for a pose out of reach: a drag moves little from frame to
frame, and further starts would leave the branch."""


@dataclass(frozen=True, eq=False)
class Branches:
    """All postures with the tool at a pose, and the one that follows the last posture.

    Attributes:
        q: (k, n) coordinates of the branches [rad or m], at the turns nearest to the last posture,
            or within the limits where those are not.
        inside: (k,) whether a branch is within the limits.
        margin: (k,) margin of each branch: 0 at the border of reach.
        followed: (n,) coordinates that follow the last posture: those of the nearest branch within
            the limits; without one, those of the least error of the tool nearby.
        reached: Whether the tool is at the pose with these.
    """

    q: FloatArray
    inside: BoolArray
    margin: FloatArray
    followed: FloatArray
    reached: bool


def branches(robot: Robot, T: FloatArray, last: FloatArray) -> Branches:
    """The branches of the inverse at a pose, for robots of all kinds.

    Where the pose leaves joints free, they keep their values of the last posture. Robots without a
    closed form of the inverse have the branch alone that iteration finds.

    Args:
        robot: The robot.
        T: (4, 4) pose of the tool `T_0_ee`.
        last: (n,) coordinates of the last posture [rad or m].
    """
    q, inside, margin = _all(robot, T, last)
    units = np.array([robot.unit_length if c.unit == "m" else 1.0 for c in robot.coordinates])
    if inside.any():
        moves = np.abs((q - last) / units).max(-1)
        followed = q[np.argmin(np.where(inside, moves, np.inf))]
        return Branches(q, inside, margin, followed, reached=True)
    found = robot.ik_numeric(T, last, max_evaluations=_LEAST_ERROR_BUDGET)
    followed = found.q if np.isfinite(found.q).all() else last
    return Branches(q, inside, margin, followed, reached=bool(found.valid))


def _all(robot: Robot, T: FloatArray, last: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Coordinates of all branches, whether they are within the limits, and their margins."""
    if hasattr(robot, "ik"):
        return _in_closed_form(robot, T, last)
    if hasattr(robot, "ik_planar"):
        x = np.array([T[0, 3], T[1, 3], np.arctan2(T[1, 0], T[0, 0])])
        found = robot.ik_planar(x)
        q = _unwound(robot, found.q[found.valid], last)
        return q, robot.is_within_limits(q), found.margin[found.valid]
    return np.empty((0, robot.n)), np.empty(0, dtype=np.bool_), np.empty(0)


def _in_closed_form(
    robot: Robot, T: FloatArray, last: FloatArray
) -> tuple[FloatArray, BoolArray, FloatArray]:
    solutions: Solutions = robot.ik(T, fixed=redundancy_at(robot, last))
    near = last + solutions.distances_from(last)
    moved = solutions.within_limits(windings=False)
    here = robot.is_within_limits(near)
    q = np.where(here[:, None] | ~moved.valid[:, None], near, moved.q)
    kept = solutions.distinct().valid
    return q[kept], (here | moved.valid)[kept], solutions.margin[kept]


def _unwound(robot: Robot, q: FloatArray, last: FloatArray) -> FloatArray:
    """Angles at the turns nearest to the last posture."""
    turns = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    whole = 2 * np.pi * np.round((q - last) / (2 * np.pi))
    return np.where(turns, q - whole, q)
