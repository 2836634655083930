"""Consecutive joint axes of a chain at the zero configuration."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.convention import AxisLine, Convention, Fitted
from ...model.placements import Placement, translation
from ...model.robot import Joint, SerialRobot
from ...model.tolerances import EVALUATION_DIGITS, GIMBAL_LOCK
from ..pose_error import pose_in_digits
from .axis_lines import angle_between, distance_between, is_parallel
from .axis_maps import Motions, axis_map, field_values

_PLACE: tuple[sp.Symbol, sp.Symbol] = sp.symbols("place_x place_y", real=True)
"""Shifts perpendicular to the direction of a prismatic joint."""


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The axis of a moving joint, relative to the preceding axis.

    Attributes:
        joint: The joint.
        before: The preceding moving joint. If ``before`` is None, the preceding axis is the z axis
            of the base frame.
        line: The joint axis in the frame of the preceding joint.
        frame: Pose (4, 4) of the joint frame in the frame of the preceding joint, in high
            precision.
        size: The sum of the distances between consecutive revolute axes (meter), or 1 if the sum is
            zero.
    """

    joint: Joint
    before: Joint | None
    line: AxisLine
    frame: Any
    size: float = 1.0

    @property
    def is_of_lines(self) -> bool:
        """Whether the joint axis and the preceding axis are lines."""
        return self.before is not None and "prismatic" not in (self.joint.kind, self.before.kind)

    @cached_property
    def angle(self) -> float:
        """The angle between the two axes (radian), from 0 to pi."""
        return float(angle_between(self.line))

    @cached_property
    def distance(self) -> float:
        """Distance between the two axes (meter)."""
        return float(distance_between(self.line))

    @property
    def is_parallel(self) -> bool:
        """Whether the two axes are exactly parallel."""
        return is_parallel(self.line)

    def fit(self, convention: Convention) -> Fitted | None:
        """Return the convention parameters for the axis, or None if there are none."""
        return convention.fit(self.line) if convention.fit else None

    def displacements(self, convention: Convention) -> NDArray[np.float64] | None:
        """Return the displacement of the axis per unit of each convention parameter.

        The shape is (4, k) or (2, k) for k parameters.

        The last two rows are rotations about the common normal and its perpendicular. If the result
        has four rows, the first two rows are shifts along these directions, in units of the arm
        length. If the preceding joint is prismatic, the position of its axis is arbitrary.
        Therefore, the two translations perpendicular to the preceding axis count as additional
        parameters. The result is None if the convention cannot describe the axis.
        """
        found = self.fit(convention)
        if found is None:
            return None
        link = axis_map(convention, self.joint.kind)
        values = field_values(found)
        known = [float(values.get(symbol.name, 0)) for symbol in link.symbols]
        return self.by_numbers(link.product, link.symbols, known)

    def by_numbers(
        self, product: Placement, symbols: Sequence[sp.Symbol], values: Sequence[float]
    ) -> NDArray[np.float64]:
        """Return the displacement of the second axis per unit of each symbol of ``product``.

        The product is the transform from the first axis to the second axis.
        """
        if self.before is not None and self.before.kind == "prismatic":
            product = translation(_PLACE[0], _PLACE[1], sp.S.Zero) + product
            symbols, values = (*symbols, *_PLACE), (*values, 0.0, 0.0)
        columns, R = Motions(product, symbols)(values)
        x, y, _ = R.T @ self.normal
        across = np.hypot(x, y)
        x, y = (x / across, y / across) if across > GIMBAL_LOCK else (1.0, 0.0)
        turn = np.array([[x, y], [-y, x]])
        shifts, turns = turn @ columns[:2] / self.size, turn @ columns[3:5]
        rows = turns if self.joint.kind == "prismatic" else np.vstack([shifts, turns])
        lengths = ~columns[3:].any(axis=0)
        rows[:, lengths] *= self.size
        return rows

    @property
    def normal(self) -> NDArray[np.float64]:
        """Direction of the common normal in the preceding frame, or 0 if the axes coincide."""
        if self.is_parallel:
            across = np.array([float(x) for x in self.line.point[:2]] + [0.0])
        else:
            x, y, _ = self.line.direction
            across = np.array([-float(y), float(x), 0.0])
        length = np.linalg.norm(across)
        return across / length if length > GIMBAL_LOCK else 0 * across

    @property
    def words(self) -> tuple[str, ...]:
        """Names of the rows of ``displacements``."""
        along, across = "the common normal", "the perpendicular of axis and common normal"
        if not self.normal.any():
            along, across = "the link's x axis", "the link's y axis"
        turns = f"rotation about {along}", f"rotation about {across}"
        if self.joint.kind == "prismatic":
            return turns
        return f"translation along {along}", f"translation along {across}", *turns


def least_singular_value(rows: NDArray[np.float64] | None) -> float:
    """Return the smallest singular value.

    The value is 0 if ``rows`` is None, or has fewer columns than rows.
    """
    if rows is None or rows.shape[1] < rows.shape[0]:
        return 0.0
    return float(np.linalg.svd(rows, compute_uv=False)[-1])


def neighbours(robot: SerialRobot) -> tuple[Neighbours, ...]:
    """Return all moving joints of a robot with their axes."""
    with mpmath.workdps(EVALUATION_DIGITS):
        found = list(_pairs(robot))
        size = sum(pair.distance for pair in found if pair.is_of_lines)
        return tuple(
            Neighbours(pair.joint, pair.before, pair.line, pair.frame, size or 1.0)
            for pair in found
        )


def _pairs(robot: SerialRobot) -> Iterator[Neighbours]:
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    frame, before = pose_in_digits(robot.base, values), None
    for joint in robot.joints:
        frame = frame * pose_in_digits(joint.before, values)
        if joint.kind != "fixed":
            line = AxisLine(tuple(frame[:3, 2]), tuple(frame[:3, 3]))
            yield Neighbours(joint, before, line, frame)
            frame, before = mpmath.eye(4), joint
        frame = frame * pose_in_digits(joint.after, values)
