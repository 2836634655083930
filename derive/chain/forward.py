"""Forward kinematics of a chain: axes, link poses, and vectors from joint axes to tool and base.

The groups of parallel axes are defined in ``chasles.derive.chain.groups``. A tilt (a constant
rotation about x) follows each group of parallel axes. The last joint rotation of a group and the
following tilt turn the axes of this group into the axes of the next group. Horner's scheme
transforms a point p from the tool to the base. A `Station` is the section of a chain between two
consecutive joint axes, with its frames and prismatic joints. Station k rotates by the angle phi_k
about the z axis of its group of parallel axes. The vector reach_k leads from joint axis k to the
next joint axis, in axes that rotate with station k. The vector lever_k from joint axis k to the
tool follows from reach_k and the next lever:

    lever_k = Rz(phi_k) reach_k + lever_(k+1),    lever_last = Rz(phi_last) (reach + Rx(alpha) p').

A lever is the vector from a joint axis to the tool. The columns of the Jacobian are computed from
the levers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ..terms.terms import Terms
from ..terms.vectors import (
    IDENTITY,
    ORIGIN,
    Basis,
    Vector,
    added,
    combination,
    rotated_x,
    rotated_z,
    subtracted,
    turned_about_x,
    turned_about_z,
)
from .groups import Group, Station

Pose = tuple[Basis, Vector]
"""Axes and origin of a frame, expressed in another frame."""


@dataclass(frozen=True)
class Levers:
    """Vectors from the joint axes of one group to a point.

    Attributes:
        from_axis: Vector from each joint axis of the group to the point, in the axes of the group
            frame.
        turned: Vector from the last joint axis of the group to the point, in axes that rotate with
            the last joint.
    """

    from_axis: tuple[Vector, ...]
    turned: Vector


class Forward:
    """Forward kinematics of a chain, computed once for all functions.

    Attributes:
        terms: Table of named terms.
        groups: The groups of parallel axes of the chain.
        axes: Orientation of each group frame, expressed in the base frame.
        end_axes: Orientation of each group frame after the rotation of the group's last joint,
            expressed in the base frame.
    """

    def __init__(self, terms: Terms, groups: Sequence[Group]) -> None:
        self.terms = terms
        self.groups = tuple(groups)
        self.trigonometry = [
            [terms.cos_sin(station.angle) for station in group.stations] for group in groups
        ]
        self.axes: list[Basis] = [IDENTITY]
        self.end_axes: list[Basis] = []
        for group, angles in zip(self.groups, self.trigonometry, strict=True):
            self.end_axes.append(turned_about_z(terms, self.axes[-1], *angles[-1]))
            self.axes.append(turned_about_x(terms, self.end_axes[-1], *group.tilt))

    def tool_pose(self) -> Pose:
        """Return the tool pose in the base frame."""
        tool = self.groups[-1].stations[-1].frames[-1]
        orientation = self._product(self.end_axes[-1], tool.orientation)
        return orientation, self.levers_of_tool()[0].from_axis[0]

    def link_poses(self) -> list[Pose]:
        """Return the poses of all link frames in the base frame."""
        poses: list[Pose] = []
        origin = ORIGIN
        for axes, group, angles in zip(self.axes, self.groups, self.trigonometry, strict=False):
            for station, (c, s) in zip(group.stations, angles, strict=True):
                station_axes = turned_about_z(self.terms, axes, c, s)
                for frame in station.frames:
                    position = self._moved(origin, station_axes, frame.origin)
                    poses.append((self._product(station_axes, frame.orientation), position))
                origin = self._moved(origin, station_axes, station.reach)
        return poses[:-1]

    def levers_of_tool(self) -> list[Levers]:
        """Return the vectors from the joint axes to the tool origin, in one list per group."""
        levers: list[Levers] = []
        point = ORIGIN
        for group, angles in zip(self.groups[::-1], self.trigonometry[::-1], strict=True):
            c, s = group.tilt
            turned = added(self.terms, group.stations[-1].reach, rotated_x(self.terms, point, c, s))
            positions = [rotated_z(self.terms, turned, *angles[-1])]
            for station, (c, s) in zip(group.stations[-2::-1], angles[-2::-1], strict=True):
                positions.append(
                    added(self.terms, rotated_z(self.terms, station.reach, c, s), positions[-1])
                )
            levers.append(Levers(tuple(positions[::-1]), turned))
            point = positions[-1]
        return levers[::-1]

    def levers_of_base(self) -> list[Levers]:
        """Return the vectors from the joint axes to the base origin, in one list per group."""
        levers: list[Levers] = []
        point = ORIGIN
        for group, angles in zip(self.groups, self.trigonometry, strict=True):
            positions = [point]
            for station, (c, s) in zip(group.stations[:-1], angles[:-1], strict=True):
                reach = rotated_z(self.terms, station.reach, c, s)
                positions.append(subtracted(self.terms, positions[-1], reach))
            c, s = angles[-1]
            turned = rotated_z(self.terms, positions[-1], c, -s)
            levers.append(Levers(tuple(positions), turned))
            c, s = group.tilt
            point = rotated_x(
                self.terms, subtracted(self.terms, turned, group.stations[-1].reach), c, -s
            )
        return levers

    def axes_in_tool(self) -> tuple[list[Basis], list[Basis]]:
        """Return the orientations of the start and end frames of all groups in the tool frame.

        The first list contains the orientation of the start frame of each group. The second list
        contains the orientation after the rotation of the group's last joint.
        """
        tool = self.groups[-1].stations[-1].frames[-1]
        end_axes = [_transposed(tool.orientation)]
        axes: list[Basis] = []
        for group, angles in zip(self.groups[::-1], self.trigonometry[::-1], strict=True):
            c, s = group.tilt
            if axes:
                end_axes.append(turned_about_x(self.terms, axes[-1], c, -s))
            c, s = angles[-1]
            axes.append(turned_about_z(self.terms, end_axes[-1], c, -s))
        return axes[::-1], end_axes[::-1]

    def stations(self) -> list[tuple[int, int, Station]]:
        """Return each station with the index of its group and its index in the group."""
        return [
            (g, k, station)
            for g, group in enumerate(self.groups)
            for k, station in enumerate(group.stations)
        ]

    def _product(self, axes: Basis, constant: Basis) -> Basis:
        x, y, z = (combination(self.terms, column, axes) for column in constant)
        return x, y, z

    def _moved(self, origin: Vector, axes: Basis, vector: Vector) -> Vector:
        return combination(self.terms, (sp.Integer(1), *vector), (origin, *axes))


def _transposed(basis: Basis) -> Basis:
    x, y, z = zip(*basis, strict=True)
    return x, y, z
