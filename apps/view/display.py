"""What a view shows: a robot's posture, its branches as ghosts, its limits, its workspace.

All of it is computed here, apart from any window: `at`, `ghosts` and `limits` together are a frame.
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
"""Part of the range of a coordinate from its limit that counts as near."""
_NEAR_BORDER = 0.05
"""Margin of a branch (no unit) below which it counts as near the border of reach."""
_STRIDE = 0.05
"""Radians, and parts of the robot's size, that a coordinate of iterated loops moves at once."""
_PLANAR_GHOSTS = 8
"""Branches of a planar platform with three legs of two."""


class Nearness(Enum):
    """The place of a coordinate, or of a branch, with respect to its limits."""

    FREE = "within the limits"
    NEAR = "near a limit or the border of reach"
    BEYOND = "beyond a limit"


COLOURS = {Nearness.FREE: BLUE, Nearness.NEAR: YELLOW, Nearness.BEYOND: VERMILION}
"""Colours of nearness, which differ for all kinds of sight."""


@dataclass(frozen=True, eq=False)
class Posture:
    """A posture of a robot.

    Attributes:
        q: (n,) coordinates [rad or m].
        z: (n_z,) the configuration of its loops; q of a serial robot.
        bodies: (bodies, 4, 4) poses of the skeleton's bodies in the base frame.
        tool: (4, 4) pose of the tool.
        closes: Whether the loops close at the coordinates that were asked for; where they do not,
            this is the posture before.
        reached: Whether the tool is at the pose that was asked for.
        branches: The branches of the inverse at that pose, None where none was asked for.
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
    """Other postures with the same pose of the tool, in a fixed number of places.

    Attributes:
        positions: (g, bodies, 3) positions of the bodies [m].
        wxyzs: (g, bodies, 4) their orientations as quaternions.
        scales: (g,) 1 of a ghost, 0 of a place without one.
        colours: (g, 3) red, green and blue from 0 to 255.
    """

    positions: FloatArray
    wxyzs: FloatArray
    scales: FloatArray
    colours: NDArray[np.uint8]

    @staticmethod
    def joined(parts: Sequence[Ghosts]) -> Ghosts:
        """Several kinds of ghosts, one after the other."""
        return Ghosts(
            np.concatenate([part.positions for part in parts]),
            np.concatenate([part.wxyzs for part in parts]),
            np.concatenate([part.scales for part in parts]),
            np.concatenate([part.colours for part in parts]),
        )


class Display:
    """A robot as a view shows it.

    Attributes:
        robot: The robot.
        skeleton: Its bodies.
        solids: The solids of its bodies.
        start: The posture at which a view starts: that of its drawings.
        most_ghosts: The greatest number of ghosts.
        most_modes: The greatest number of assembly modes, 0 where they are not known.
        moved: The coordinate, by index, that moves each joint with a symbol, by name.
    """

    robot: Robot
    skeleton: Skeleton
    solids: tuple[Solid, ...]
    start: Posture
    most_ghosts: int
    most_modes: int
    moved: Mapping[str, int]

    def __init__(self, robot: Robot) -> None:
        """Prepares the display.

        Args:
            robot: The robot.

        Raises:
            ManifestError: The robot was derived by a version without skeletons.
        """
        self.robot = robot
        self.skeleton = skeleton(robot)
        self.moved = _moved(robot, self.skeleton)
        turns = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
        self._units = np.where(turns, 1.0, self.skeleton.size)
        self.solids = solids(self.skeleton, frozenset(self.moved))
        self.most_ghosts = len(robot.labels.get("ik", ()))
        if self.most_ghosts == 1:
            # The only branch is the posture itself.
            self.most_ghosts = 0
        if "ik" not in robot.functions and "ik_planar" in dir(robot):
            self.most_ghosts = _PLANAR_GHOSTS
        modes = robot.functions["modes"] if has_modes(robot) else None
        self.most_modes = modes.outputs[0].shape[0] if modes else 0
        self.start = self._start()

    def at(self, q: FloatArray, last: Posture) -> Posture:
        """The posture at coordinates.

        Args:
            q: (n,) coordinates [rad or m].
            last: The posture before, which chooses the branch of loops that are iterated.

        Returns:
            The posture. Where the loops do not close, the one before; of loops that are iterated,
            the last one on the straight way in q that closes.
        """
        if self.robot.loop_solution == "newton":
            return self._followed(q, last)
        z = self._configurations(q[None], last.z)[0]
        return (
            self._posture(q, z)
            if np.isfinite(z).all()
            else replace(last, closes=False, branches=None)
        )

    def reaching(self, T: FloatArray, last: Posture) -> Posture:
        """The posture that follows the tool to a pose, on the branch nearest to the last posture.

        Args:
            T: (4, 4) the pose in the base frame.
            last: The posture before.
        """
        found = branches(self.robot, T, last.q)
        there = self.at(found.followed, last)
        reached = found.reached and there.closes
        return replace(there, reached=reached, branches=found)

    def ghosts(self, posture: Posture) -> Ghosts:
        """The other branches at the tool's pose, or at the pose that was asked for."""
        found = posture.branches or branches(self.robot, posture.tool, posture.q)
        z = self._configurations(found.q, posture.z)
        is_other = np.abs(found.q - posture.q).max(-1, initial=0.0) > SAME_SOLUTION
        shown = np.flatnonzero(is_other & np.isfinite(z).all(-1))[: self.most_ghosts]
        colours = [COLOURS[_nearness_of(found, k)] for k in shown]
        return self._placed(z[shown], colours, self.most_ghosts)

    def modes(self, posture: Posture) -> Ghosts:
        """The other assembly modes at the same actuators."""
        found = others(
            assembly_modes(self.skeleton, posture.q, posture.z), posture.z, self.skeleton
        )
        near = found.margin < _NEAR_BORDER * np.abs(found.margin).max(initial=0.0)
        colours = [YELLOW if k else PURPLE for k in near]
        return self._placed(found.z, colours, self.most_modes)

    def _placed(self, z: FloatArray, shown: Sequence[Colour], count: int) -> Ghosts:
        """Configurations (g, n_z) with their colours in a number of places."""
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
        """A number of places without ghosts."""
        bodies = len(self.skeleton.bodies)
        wxyzs = np.zeros((count, bodies, 4))
        wxyzs[..., 0] = 1.0
        positions, colours = np.zeros((count, bodies, 3)), np.zeros((count, 3), dtype=np.uint8)
        return Ghosts(positions, wxyzs, np.zeros(count), colours)

    def limits(self, posture: Posture) -> Mapping[str, Nearness]:
        """The nearness of each actuated coordinate to its limits, by the joint that it moves."""
        lower, upper = self.robot.lower, self.robot.upper
        beyond = (posture.q < lower - AT_LIMIT) | (posture.q > upper + AT_LIMIT)
        gap = np.minimum(posture.q - lower, upper - posture.q)
        span = np.where(np.isfinite(upper - lower), upper - lower, 0.0)
        near = gap < _NEAR_LIMIT * span
        return {
            name: Nearness.BEYOND if beyond[k] else Nearness.NEAR if near[k] else Nearness.FREE
            for name, k in self.moved.items()
        }

    def workspace(self, units: Sequence[SliderUnit], count: int) -> FloatArray:
        """(m, 3) positions of the tool [m] at coordinates spread evenly over the sliders.

        Args:
            units: The sliders.
            count: The number of postures; those in which loops do not close have no position.
        """
        lower = np.array([unit.lower for unit in units])
        upper = np.array([unit.upper for unit in units])
        points = low_discrepancy(0, count, self.robot.n, np.full(self.robot.n, 0.5))
        positions = self.robot.fk(lower + points * (upper - lower))[:, :3, 3]
        return np.asarray(positions[np.isfinite(positions).all(-1)])

    def ball(self, posture: Posture) -> tuple[FloatArray, float]:
        """The centre (3,) and radius [m] of a ball around the robot at a posture."""
        points = [
            solid.triangles.vertices @ posture.bodies[solid.body, :3, :3].T
            + posture.bodies[solid.body, :3, 3]
            for solid in self.solids
        ]
        every = np.vstack(points)
        centre = (every.min(0) + every.max(0)) / 2
        return centre, float(np.linalg.norm(every - centre, axis=1).max())

    def _start(self) -> Posture:
        q = self.skeleton.posture
        if self.robot.reference is None:
            return self._posture(q, q)
        return self._posture(q, self._configurations(q[None], np.array(self.robot.reference.z))[0])

    def _posture(self, q: FloatArray, z: FloatArray, *, closes: bool = True) -> Posture:
        bodies = self.skeleton.poses_from_configuration(z)
        return Posture(q, z, bodies, self.skeleton.tip_poses(bodies), closes)

    def _followed(self, q: FloatArray, last: Posture) -> Posture:
        """The posture at the end of a straight way, in strides that do not lose the branch."""
        move = float(np.abs((q - last.q) / self._units).max())
        parts = np.linspace(0, 1, 1 + max(1, math.ceil(move / _STRIDE)))[1:, None]
        way = last.q + parts * (q - last.q)
        found = self.robot.solve_loops_along(way, last.z)
        reached = int(found.valid.sum())
        if reached == 0:
            return replace(last, closes=False, branches=None)
        k = reached - 1
        return self._posture(way[k], found.z[k], closes=reached == len(way))

    def _configurations(self, q: FloatArray, near: FloatArray) -> FloatArray:
        """(k, n_z) configurations at coordinates (k, n); NaN where the loops do not close."""
        if not self.robot.configuration_variables:
            return q
        if self.robot.loop_solution == "newton":
            return np.asarray(self.robot.configuration_near(q, near))
        return np.asarray(self.robot.configuration(q))


def _moved(robot: Robot, bodies: Skeleton) -> dict[str, int]:
    """The coordinate that moves each joint or cylinder, by the name of its symbol."""
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
    """Unit quaternions (..., 4) of poses (..., 4, 4), w first.

    Each comes from the largest of its four entries, so that none is lost to rounding (Shepperd,
    Quaternion from rotation matrix, 1978).
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
