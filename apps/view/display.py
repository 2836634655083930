"""The content of a view: configuration, branches as ghosts, limits and workspace of a robot.

This module does not depend on the user interface. The methods `at`, `ghosts` and `limits` compute
the content of one frame.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from chasles import Robot
from chasles.sampling import low_discrepancy
from chasles.tolerances import AT_LIMIT, SAME_SOLUTION

from ..drawing import Skeleton, skeleton
from ..drawing.assembly import assembly_modes, has_modes, others
from .slider_units import SliderUnit
from .solids import BLUE, PURPLE, VERMILION, YELLOW, Colour, Solid, solids
from .tool_branches import Branches, branches

FloatArray = NDArray[np.float64]

_NEAR_LIMIT = 0.05
"""A coordinate is near its limit if its distance to the limit is below this fraction of its
range."""
_NEAR_BORDER = 0.05
"""Minimum margin of a branch. With a smaller margin, a branch is near the boundary of the
workspace."""
_STRIDE = 0.05
"""Maximum change of a coordinate between two solutions of the loops along a straight path [rad, or
relative to the robot size]."""
_PLANAR_GHOSTS = 8
"""Number of branches of a planar platform with three two-link legs."""


class Nearness(Enum):
    """The state of a coordinate or a branch relative to its limits."""

    FREE = "within the limits"
    NEAR = "near a limit or the boundary of reach"
    BEYOND = "beyond a limit"


COLOURS = {Nearness.FREE: BLUE, Nearness.NEAR: YELLOW, Nearness.BEYOND: VERMILION}
"""Colors of configurations by their distance from the limits.

Color-blind readers can distinguish the colors.
"""


@dataclass(frozen=True, eq=False)
class Displayed:
    """A configuration of a robot with its poses.

    Attributes:
        q: (n,) coordinates [rad or m].
        z: (n_z,) configuration of the loops. For a serial robot, z is q.
        bodies: (bodies, 4, 4) poses of the bodies of the drawn skeleton in the base frame.
        tool: (4, 4) pose of the tool.
        closes: Whether the loops close at the requested coordinates. If the loops do not close, the
            previous configuration is kept.
        reached: Whether the tool is at the requested pose.
        branches: The branches of the inverse kinematics function for the requested pose, or None
            without a requested pose.
    """

    q: FloatArray
    z: FloatArray
    bodies: FloatArray
    tool: FloatArray
    closes: bool = True
    reached: bool = True
    branches: Branches | None = None


@dataclass(frozen=True, eq=False)
class Ghosts:
    """Other branches for the same tool pose, in a fixed number of solution slots.

    Attributes:
        positions: (g, bodies, 3) positions of the bodies [m].
        wxyzs: (g, bodies, 4) orientations of the bodies as quaternions.
        scales: (g,) drawing scale of each slot: 1 for a slot with a branch, 0 for an empty slot.
        colours: (g, 3) red, green and blue from 0 to 255.
    """

    positions: FloatArray
    wxyzs: FloatArray
    scales: FloatArray
    colours: NDArray[np.uint8]

    @staticmethod
    def joined(parts: Sequence[Ghosts]) -> Ghosts:
        """Combine several groups of ghost robots into one group."""
        return Ghosts(
            np.concatenate([part.positions for part in parts]),
            np.concatenate([part.wxyzs for part in parts]),
            np.concatenate([part.scales for part in parts]),
            np.concatenate([part.colours for part in parts]),
        )


class Display:
    """Computes the objects and texts that the 3D view of a robot shows.

    Attributes:
        robot: The robot.
        skeleton: The bodies.
        solids: The solids of the bodies.
        start: The initial configuration, the same as in drawings.
        most_ghosts: Maximum number of ghosts, which show the robot on other branches with the same
            tool pose.
        most_modes: Maximum number of assembly modes, or 0 if they are unknown.
        moved: Index of the coordinate that moves each actuated joint, keyed by joint name.
    """

    robot: Robot
    skeleton: Skeleton
    solids: tuple[Solid, ...]
    start: Displayed
    most_ghosts: int
    most_modes: int
    moved: Mapping[str, int]

    def __init__(self, robot: Robot) -> None:
        """Prepare the display.

        Args:
            robot: The robot.

        Raises:
            ManifestError: An earlier version of chasles derived the robot, so the manifest contains
                no bodies.
        """
        self.robot = robot
        self.skeleton = skeleton(robot)
        self.moved = _moved(robot, self.skeleton)
        turns = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
        self._units = np.where(turns, 1.0, self.skeleton.size)
        self.solids = solids(self.skeleton, frozenset(self.moved))
        self.most_ghosts = len(robot.labels.get("ik", ()))
        if self.most_ghosts == 1:
            self.most_ghosts = 0
        if "ik" not in robot.functions and "ik_planar" in dir(robot):
            self.most_ghosts = _PLANAR_GHOSTS
        modes = robot.functions["modes"] if has_modes(robot) else None
        self.most_modes = modes.outputs[0].shape[0] if modes else 0
        self.start = self._start()

    def at(self, q: FloatArray, last: Displayed) -> Displayed:
        """Return the configuration of the robot at coordinates q.

        Args:
            q: (n,) coordinates [rad or m].
            last: The previous configuration. For loops solved by iteration, this configuration
                selects the branch.

        Returns:
            The configuration. If the loops do not close at q, the result is the previous
            configuration. With Newton's method, the coordinates instead move on a straight line to
            q. The result is the last configuration on this line at which the loops close.
        """
        if self.robot.loop_solution == "newton":
            return self._followed(q, last)
        z = self._configurations(q[None], last.z)[0]
        return (
            self._configuration(q, z)
            if np.isfinite(z).all()
            else replace(last, closes=False, branches=None)
        )

    def reaching(self, T: FloatArray, last: Displayed) -> Displayed:
        """Return the configuration for a tool pose, on the branch nearest to `last`.

        Args:
            T: (4, 4) the pose in the base frame.
            last: The previous configuration.
        """
        found = branches(self.robot, T, last.q)
        there = self.at(found.followed, last)
        reached = found.reached and there.closes
        return replace(there, reached=reached, branches=found)

    def ghosts(self, displayed: Displayed) -> Ghosts:
        """Return the other branches for the requested pose, or for the current tool pose."""
        found = displayed.branches or branches(self.robot, displayed.tool, displayed.q)
        z = self._configurations(found.q, displayed.z)
        is_other = np.abs(found.q - displayed.q).max(-1, initial=0.0) > SAME_SOLUTION
        shown = np.flatnonzero(is_other & np.isfinite(z).all(-1))[: self.most_ghosts]
        colours = [COLOURS[_nearness_of(found, k)] for k in shown]
        return self._placed(z[shown], colours, self.most_ghosts)

    def modes(self, displayed: Displayed) -> Ghosts:
        """Return the other assembly modes for the same actuated coordinates."""
        found = others(
            assembly_modes(self.skeleton, displayed.q, displayed.z), displayed.z, self.skeleton
        )
        near = found.margin < _NEAR_BORDER * np.abs(found.margin).max(initial=0.0)
        colours = [YELLOW if k else PURPLE for k in near]
        return self._placed(found.z, colours, self.most_modes)

    def _placed(self, z: FloatArray, shown: Sequence[Colour], count: int) -> Ghosts:
        """Return `count` transparent robots (ghosts).

        The first ghosts show the configurations in the rows of `z`, one row per ghost.

        Unused ghosts have scale zero.
        """
        found, places, poses = (
            self.no_ghosts(count),
            slice(0, len(z)),
            self.skeleton.poses_from_configuration(z),
        )
        found.positions[places], found.scales[places] = poses[:, :, :3, 3], 1.0
        found.wxyzs[places] = quaternions(poses)
        found.colours[places] = np.reshape(shown, (-1, 3))
        return found

    def no_ghosts(self, count: int) -> Ghosts:
        """Return `count` transparent robots (ghosts), invisible because their scale is 0."""
        bodies = len(self.skeleton.bodies)
        wxyzs = np.zeros((count, bodies, 4))
        wxyzs[..., 0] = 1.0
        positions, colours = np.zeros((count, bodies, 3)), np.zeros((count, 3), dtype=np.uint8)
        return Ghosts(positions, wxyzs, np.zeros(count), colours)

    def limits(self, displayed: Displayed) -> Mapping[str, Nearness]:
        """Return the limit state of each actuated coordinate, keyed by joint name.

        The states are: within the limits, near a limit, or beyond a limit.
        """
        lower, upper = self.robot.lower, self.robot.upper
        beyond = (displayed.q < lower - AT_LIMIT) | (displayed.q > upper + AT_LIMIT)
        gap = np.minimum(displayed.q - lower, upper - displayed.q)
        span = np.where(np.isfinite(upper - lower), upper - lower, 0.0)
        near = gap < _NEAR_LIMIT * span
        return {
            name: Nearness.BEYOND if beyond[k] else Nearness.NEAR if near[k] else Nearness.FREE
            for name, k in self.moved.items()
        }

    def workspace(self, units: Sequence[SliderUnit], count: int) -> FloatArray:
        """Return tool positions (m, 3) [m] for coordinates evenly distributed over the sliders.

        Args:
            units: The sliders.
            count: Number of configurations. Configurations with open loops are omitted.
        """
        lower = np.array([unit.lower for unit in units])
        upper = np.array([unit.upper for unit in units])
        points = low_discrepancy(0, count, self.robot.n, np.full(self.robot.n, 0.5))
        positions = self.robot.fk(lower + points * (upper - lower))[:, :3, 3]
        return np.asarray(positions[np.isfinite(positions).all(-1)])

    def ball(self, displayed: Displayed) -> tuple[FloatArray, float]:
        """Return the center (3,) and the radius [m] of a sphere around the robot."""
        points = [
            solid.triangles.vertices @ displayed.bodies[solid.body, :3, :3].T
            + displayed.bodies[solid.body, :3, 3]
            for solid in self.solids
        ]
        every = np.vstack(points)
        center = (every.min(0) + every.max(0)) / 2
        return center, float(np.linalg.norm(every - center, axis=1).max())

    def _start(self) -> Displayed:
        q = self.skeleton.q_drawn
        if self.robot.reference is None:
            return self._configuration(q, q)
        return self._configuration(
            q, self._configurations(q[None], np.array(self.robot.reference.z))[0]
        )

    def _configuration(self, q: FloatArray, z: FloatArray, *, closes: bool = True) -> Displayed:
        bodies = self.skeleton.poses_from_configuration(z)
        return Displayed(q, z, bodies, self.skeleton.tip_poses(bodies), closes)

    def _followed(self, q: FloatArray, last: Displayed) -> Displayed:
        """Return the configuration at the end of a straight path, without a change of branch."""
        move = float(np.abs((q - last.q) / self._units).max())
        parts = np.linspace(0, 1, 1 + max(1, math.ceil(move / _STRIDE)))[1:, None]
        path = last.q + parts * (q - last.q)
        found = self.robot.solve_loops_along(path, last.z)
        reached = int(found.valid.sum())
        if reached == 0:
            return replace(last, closes=False, branches=None)
        k = reached - 1
        return self._configuration(path[k], found.z[k], closes=reached == len(path))

    def _configurations(self, q: FloatArray, near: FloatArray) -> FloatArray:
        """Return configurations (k, n_z) at coordinates (k, n), or NaN for open loops."""
        if not self.robot.configuration_variables:
            return q
        if self.robot.loop_solution == "newton":
            return np.asarray(self.robot.configuration_near(q, near))
        return np.asarray(self.robot.configuration(q))


def _moved(robot: Robot, bodies: Skeleton) -> dict[str, int]:
    """Return the coordinate index of each actuated joint or cylinder, keyed by name."""
    found = {}
    for body in bodies.bodies:
        k = bodies.actuator(body.joint)
        if body.joint is not None and k is not None:
            found[body.joint.name] = k
    for index, k in bodies.actuators.items():
        if robot.configuration_variables:
            found.setdefault(robot.configuration_variables[index].name, k)
    return found


def _nearness_of(found: Branches, k: int) -> Nearness:
    if not found.inside[k]:
        return Nearness.BEYOND
    return Nearness.NEAR if found.margin[k] < _NEAR_BORDER else Nearness.FREE


def quaternions(T: FloatArray) -> FloatArray:
    """Return unit quaternions (..., 4) of poses (..., 4, 4), w first.

    The largest of the four entries is computed first, for accuracy (Shepperd, Quaternion from
    rotation matrix, 1978).
    """
    R = T[..., :3, :3]
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    a, b, c = R[..., 2, 1], R[..., 0, 2], R[..., 1, 0]
    d, e, f = R[..., 1, 2], R[..., 2, 0], R[..., 0, 1]
    rows = np.stack(
        [
            np.stack([1 + xx + yy + zz, a - d, b - e, c - f], -1),
            np.stack([a - d, 1 + xx - yy - zz, f + c, e + b], -1),
            np.stack([b - e, f + c, 1 - xx + yy - zz, d + a], -1),
            np.stack([c - f, e + b, d + a, 1 - xx - yy + zz], -1),
        ],
        -2,
    )
    largest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), -1)
    row = np.take_along_axis(rows, largest[..., None, None], -2)[..., 0, :]
    return np.asarray(row / np.linalg.norm(row, axis=-1, keepdims=True))
