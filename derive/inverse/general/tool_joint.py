"""Five joints as six: the sixth turns the tool about an axis of the tool and stays at 0.

A pose that five joints reach is a pose of the six with this angle 0, and solutions of the six with
another angle are none of the five. The axis is skew to the others, so that the six have no
structure, and far enough from the tool's origin to move it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .line_quantities import Array
from .raghavan_roth import JOINTS
from .split_choice import Choice, choice_at, length

OWN = JOINTS - 1
"""Joints of the arm."""
AXES = (((0.36, 0.48, 0.8), (0.4, -0.3, 0.0)), ((-0.8, 0.36, 0.48), (0.0, 0.4, 0.3)))
"""Axes in the tool's frame: a direction, and a point in parts of the arm's length."""
APART = (np.pi,) * OWN + (0.0,)
"""The solutions of a pose are apart in the arm's own joints alone (radian)."""


@dataclass(frozen=True)
class WithTool:
    """An arm of five joints with a sixth.

    Attributes:
        constants: The placements before, between and behind its joints, as floats.
        choice: The orders of the joints in the equations.
    """

    constants: tuple[Array, ...]
    choice: Choice


def with_tool_joint(
    constants: Sequence[Array],
    slides: frozenset[int] = frozenset(),
    given: tuple[int, ...] = (),
) -> WithTool | None:
    """The arm of six joints that is solved best, or None where none is.

    Args:
        constants: The placements before, between and behind the joints, as floats.
        slides: Indices of the joints that slide.
        given: Indices of the given joints, so that five are left.
    """
    found = []
    for direction, point in AXES:
        axis = _placement(np.array(direction), length(constants) * np.array(point))
        arm = (*constants[:-1], constants[-1] @ axis, np.linalg.inv(axis))
        choice = choice_at(arm, given, slides, APART)
        if choice is None:
            continue
        # All solutions of a pose share the angle of the sixth joint: no root tells them apart.
        kept = tuple(r for r in choice.ratings if r.split.joints[2] != OWN)
        if kept and (own := replace(choice, ratings=kept)).good > 0:
            found.append(WithTool(arm, own))
    return max(found, key=lambda arm: (arm.choice.good, arm.choice.ratings[0].key), default=None)


def _placement(z: Array, p: Array) -> Array:
    """The frame (4, 4) at a point whose third axis has a direction (unit vector)."""
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3] = np.column_stack([x, np.cross(z, x), z, p])
    return frame
