"""Conditions that an arm family imposes on the joint axes of a chain."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...model.tolerances import MEASURED_STRUCTURE
from .lines import Lines

SMALL_ANGLE = 0.1
"""Angles below this value (radian) are printed in milliradians, other angles in degrees."""
_MILLI = 1e3
_PAIR = 2


@dataclass(frozen=True)
class Requirement:
    """A condition on the joint axes of a chain.

    Attributes:
        text: Description of the condition.
        deviation: Deviation of the axes from the condition, as the sine of an angle or as a
            distance divided by the arm length. The deviation is 0 if the condition holds. The
            deviation is infinite if no small change of the arm can satisfy the condition.
        is_length: Whether the deviation is a distance.
        parallel: Axes that must be parallel, if any.
        meeting: Axes that must intersect, if any.
        across: The two axes that must be perpendicular, if any.
        parts: The individual conditions, if this condition combines several conditions.
    """

    text: str
    deviation: float
    is_length: bool = False
    parallel: tuple[int, ...] = ()
    meeting: tuple[int, ...] = ()
    across: tuple[int, ...] = ()
    parts: tuple["Requirement", ...] = ()

    def in_units(self, length: float) -> str:
        """Format a finite deviation in mm, mrad or degrees.

        For two axes that should intersect, the formatted deviation is the distance between these
        axes.
        """
        several = "up to " if max(len(self.parallel), len(self.meeting)) > _PAIR else ""
        if self.is_length:
            # The point nearest to two axes is midway between these axes, so the distance between
            # the axes is twice the deviation.
            sides = _PAIR if len(self.meeting) == _PAIR else 1
            return f"{several}{_MILLI * sides * self.deviation * (length or 1.0):.3g} mm"
        angle = math.asin(min(self.deviation, 1.0))
        if angle < SMALL_ANGLE:
            return f"{several}{_MILLI * angle:.3g} mrad"
        return f"{several}{math.degrees(angle):.3g} deg"


def revolute(lines: Lines, indices: Iterable[int]) -> Requirement:
    """Require revolute joints."""
    requested = tuple(indices)
    slides = [lines.axes[k].name for k in requested if not lines.axes[k].turns]
    verb = "is" if len(slides) == 1 else "are"
    text = f"{_joints(lines, requested)} revolute" + (
        f", but {', '.join(slides)} {verb} prismatic" if slides else ""
    )
    return Requirement(text, np.inf if slides else 0.0)


def parallel(lines: Lines, *indices: int) -> Requirement:
    """Require parallel axes."""
    return Requirement(
        f"axes {_names(lines, indices)} are parallel",
        lines.angular_deviation(indices),
        parallel=indices,
    )


def meeting(lines: Lines, *indices: int) -> Requirement:
    """Require that several axes intersect in one point."""
    verb = "pass through one point" if len(indices) > 2 else "intersect"  # noqa: PLR2004
    text = f"axes {_names(lines, indices)} {verb}"
    return Requirement(text, lines.meeting_deviation(indices), is_length=True, meeting=indices)


def across(lines: Lines, i: int, j: int) -> Requirement:
    """Require that two axes are perpendicular."""
    a, b = lines.axes[i], lines.axes[j]
    deviation = abs(float(a.direction @ b.direction))
    return Requirement(f"axes {a.name} and {b.name} are perpendicular", deviation, across=(i, j))


def askew(lines: Lines, i: int, j: int) -> Requirement:
    """Require that two axes are not parallel."""
    text = f"axes {lines.axes[i].name} and {lines.axes[j].name} are not parallel"
    return Requirement(
        text, np.inf if lines.angular_deviation((i, j)) < MEASURED_STRUCTURE else 0.0
    )


def _joints(lines: Lines, requested: tuple[int, ...]) -> str:
    if len(requested) == len(lines.axes):
        return "all other joints are" if lines.is_part else "all joints are"
    if len(requested) == 1:
        return f"joint {lines.axes[requested[0]].name} is"
    return f"joints {_names(lines, requested)} are"


def _names(lines: Lines, indices: Iterable[int]) -> str:
    *names, last = (lines.axes[k].name for k in indices)
    return f"{', '.join(names)} and {last}"
