"""Conditions that a family puts on the axes of a chain, with how far they are from holding."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...model.tolerances import MEASURED_STRUCTURE
from .lines import Lines


@dataclass(frozen=True)
class Requirement:
    """One condition.

    Attributes:
        text: What must hold, in words.
        apart: How far it is from holding: radian, or parts of the arm's length; infinite where no
            small change of the arm would do.
        parallel: The axes that must be parallel, if it is that.
        meeting: The axes that must meet, if it is that.
        parts: The conditions that it sums up, if it does.
        is_length: Whether it is told in parts of the arm's length.
    """

    text: str
    deviation: float
    is_length: bool = False
    parallel: tuple[int, ...] = ()
    meeting: tuple[int, ...] = ()
    parts: tuple["Requirement", ...] = ()


def revolute(lines: Lines, indices: Iterable[int]) -> Requirement:
    """Joints that must turn."""
    slides = [lines.axes[k].name for k in indices if not lines.axes[k].turns]
    text = "all joints are revolute" + (f", but {', '.join(slides)} slides" if slides else "")
    return Requirement(text, np.inf if slides else 0.0)


def parallel(lines: Lines, *indices: int) -> Requirement:
    """Axes that must be parallel."""
    return Requirement(
        f"axes {_names(lines, indices)} are parallel",
        lines.angular_deviation(indices),
        parallel=indices,
    )


def meeting(lines: Lines, *indices: int) -> Requirement:
    """Axes that must pass through one point."""
    what = "pass through one point" if len(indices) > 2 else "intersect"  # noqa: PLR2004
    text = f"axes {_names(lines, indices)} {what}"
    return Requirement(text, lines.meeting_deviation(indices), is_length=True, meeting=indices)


def across(lines: Lines, i: int, j: int) -> Requirement:
    """Axes that must be at right angles."""
    a, b = lines.axes[i], lines.axes[j]
    apart = abs(float(a.direction @ b.direction))
    return Requirement(f"axes {a.name} and {b.name} are at right angles", apart)


def askew(lines: Lines, i: int, j: int) -> Requirement:
    """Axes that must not be parallel."""
    text = f"axes {lines.axes[i].name} and {lines.axes[j].name} are not parallel"
    return Requirement(
        text, np.inf if lines.angular_deviation((i, j)) < MEASURED_STRUCTURE else 0.0
    )


def _names(lines: Lines, indices: Iterable[int]) -> str:
    *names, last = (lines.axes[k].name for k in indices)
    return f"{', '.join(names)} and {last}"
