"""The poses of a mechanism's bodies and joints at one configuration, in numbers."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...chain.poe import placement_matrix
from ...model.errors import RobotError
from ...model.mechanism import Frame, Mechanism
from ...model.robot import Joint, Placement
from ...terms.terms import Terms

Array = NDArray[np.float64]


class Poses:
    """The poses of all bodies and joints in the base frame.

    Attributes:
        terms: The parameters at their defaults.
        body: Pose of each body's frame, (4, 4).
        fixed: Pose of each joint's own frame before it moves, (4, 4).
        moved: The same after it has moved.
    """

    def __init__(self, mechanism: Mechanism, configuration: Mapping[str, float]) -> None:
        """Carries the base through the tree of joints.

        Args:
            mechanism: The description.
            configuration: Value of every joint that moves (radian or metre).

        Raises:
            RobotError: A joint has no value.
        """
        self.terms = Terms({p.symbol: p.value for p in mechanism.parameters})
        self.body: dict[str, Array] = {mechanism.base_frame: self.matrix(mechanism.base)}
        self.fixed: dict[str, Array] = {}
        self.moved: dict[str, Array] = {}
        for joint in mechanism.joints:
            fixed = self.body[joint.parent] @ self.matrix(joint.before)
            self.fixed[joint.name] = fixed
            self.moved[joint.name] = fixed @ self._motion(mechanism, joint, configuration)
            self.body[joint.link] = self.moved[joint.name] @ self.matrix(joint.after)

    def matrix(self, placement: Placement) -> Array:
        """A constant placement (4, 4)."""
        exact = placement_matrix(placement)
        return np.array(
            [[float(self.terms.value(entry)) for entry in row] for row in exact.tolist()]
        )

    def of(self, frame: Frame) -> Array:
        """The pose of a frame on a body (4, 4)."""
        return self.body[frame.body] @ self.matrix(frame.placement)

    def _motion(
        self, mechanism: Mechanism, joint: Joint, configuration: Mapping[str, float]
    ) -> Array:
        T = np.eye(4)
        if joint.kind == "fixed":
            return T
        if joint.name not in configuration:
            raise RobotError(
                f"robot {mechanism.name!r}: joint {joint.name!r} has no value in the configuration"
            )
        value = joint.direction * configuration[joint.name]
        if joint.kind == "prismatic":
            T[2, 3] = value
            return T
        c, s = math.cos(value), math.sin(value)
        T[:2, :2] = [[c, -s], [s, c]]
        T[2, 3] = float(self.terms.value(joint.pitch)) * value
        return T
