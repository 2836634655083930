"""Solves five joints as six: an added joint 6 rotates the tool and must be at 0.

Every solution of the five joints is a solution of the six joints with angle 6 at 0. Solutions with
a nonzero angle 6 are discarded. The added axis is skew to the other axes, so that the six joints
fit no known family. The axis is far enough from the tool origin to move it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .line_quantities import Array
from .raghavan_roth import JOINTS
from .split_choice import Choice, choice_at, length

OWN = JOINTS - 1
"""Number of joints of the arm itself."""
AXES = (((0.36, 0.48, 0.8), (0.4, -0.3, 0.0)), ((-0.8, 0.36, 0.48), (0.0, 0.4, 0.3)))
"""Candidate axes in the tool frame: direction, and point relative to the arm length."""
APART = (np.pi,) * OWN + (0.0,)
"""Assumed separations of the solutions (radian): zero in the added joint."""


@dataclass(frozen=True)
class WithTool:
    """A five-joint arm with an added sixth joint.

    Attributes:
        constants: The constant placements before, between and after the six joints, as floats.
        choice: The joint orders in the equations.
    """

    constants: tuple[Array, ...]
    choice: Choice


def with_tool_joint(
    constants: Sequence[Array],
    slides: frozenset[int] = frozenset(),
    given: tuple[int, ...] = (),
) -> WithTool | None:
    """Returns the best-conditioned six-joint extension of a five-joint arm, or None.

    Args:
        constants: The constant placements before, between and after the joints, as floats.
        slides: Indices of the prismatic joints.
        given: Indices of the fixed joints; five joints remain free.
    """
    found = []
    for direction, point in AXES:
        axis = _placement(np.array(direction), length(constants) * np.array(point))
        arm = (*constants[:-1], constants[-1] @ axis, np.linalg.inv(axis))
        choice = choice_at(arm, given, slides, APART)
        if choice is None:
            continue
        # All solutions of a pose have the same angle 6, so joint 6 cannot separate them.
        kept = tuple(r for r in choice.ratings if r.split.joints[2] != OWN)
        if kept and (own := replace(choice, ratings=kept)).good > 0:
            found.append(WithTool(arm, own))
    return max(found, key=lambda arm: (arm.choice.good, arm.choice.ratings[0].key), default=None)


def _placement(z: Array, p: Array) -> Array:
    """Returns a frame (4, 4) at point ``p`` with z axis ``z`` (unit vector)."""
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3] = np.column_stack([x, np.cross(z, x), z, p])
    return frame
