"""The inverse solutions for a dragged tool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import Robot, Solutions

from ..drawing.figure import redundancy_at

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_MIN_ERROR_BUDGET = 60
"""Maximum number of forward kinematics evaluations for a pose out of reach. A few evaluations are
enough, because the tool moves little per frame. Additional start configurations could lead to
solutions on other branches."""


@dataclass(frozen=True, eq=False)
class Branches:
    """All inverse solutions for a tool pose, and the solution that the displayed robot takes.

    Attributes:
        q: (k, n) coordinates of the branches [rad or m]. The angles are shifted by full turns
            towards the previous configuration, within the limits.
        inside: (k,) whether a branch is within the limits.
        margin: (k,) margin of each branch. The margin is 0 at the workspace border.
        followed: (n,) coordinates of the nearest branch within the limits. If no branch is within
            the limits, `followed` contains nearby coordinates with the smallest tool error.
        reached: Whether `followed` reaches the pose.
    """

    q: FloatArray
    inside: BoolArray
    margin: FloatArray
    followed: FloatArray
    reached: bool


def branches(robot: Robot, T: FloatArray, last: FloatArray) -> Branches:
    """Return the branches of the inverse kinematics function for a pose.

    Redundancy parameters keep their values. For a robot without a closed-form inverse kinematics
    function, iteration finds only one branch.

    Args:
        robot: The robot.
        T: (4, 4) tool pose `T_0_ee`.
        last: (n,) previous coordinates [rad or m].
    """
    q, inside, margin = _all(robot, T, last)
    units = np.array([robot.unit_length if c.unit == "m" else 1.0 for c in robot.coordinates])
    if inside.any():
        moves = np.abs((q - last) / units).max(-1)
        followed = q[np.argmin(np.where(inside, moves, np.inf))]
        return Branches(q, inside, margin, followed, reached=True)
    found = robot.ik_numeric(T, last, max_evaluations=_MIN_ERROR_BUDGET)
    followed = found.q if np.isfinite(found.q).all() else last
    return Branches(q, inside, margin, followed, reached=bool(found.valid))


def _all(robot: Robot, T: FloatArray, last: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return (coordinates, within-limits flags, margins), with one entry for each branch."""
    if hasattr(robot, "ik"):
        return _in_closed_form(robot, T, last)
    if hasattr(robot, "ik_planar"):
        x = np.array([T[0, 3], T[1, 3], np.arctan2(T[1, 0], T[0, 0])])
        found = robot.ik_planar(x)
        # A dragged tool may be in a different assembly mode than fk(q).
        reached = found.valid | found.other_mode
        q = _unwound(robot, found.q[reached], last)
        return q, robot.is_within_limits(q), found.margin[reached]
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
    """Shift angles by full turns to the values nearest to the previous configuration."""
    turns = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    full_turns = 2 * np.pi * np.round((q - last) / (2 * np.pi))
    return np.where(turns, q - full_turns, q)
