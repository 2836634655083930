"""Prismatic joints in any order between revolute joints that the orientation determines.

Up to three joints are revolute, and neighbors among them are not parallel. Up to three joints are
prismatic; of four joints, the prismatic joints are next to each other. Maximum number of solutions:
1, or 2 with three revolute joints.
"""

import numpy as np

from ..steps.slides_between_turns import loses_alignment, requires, solve
from ..structure.lines import Lines
from ..structure.requirement import Requirement
from .family import Family

_LONG = 4
"""Number of joints from which prismatic joints must be next to each other.

Where revolute joints turn two slides almost parallel, solutions of such arms lose digits.
"""


def _requires(lines: Lines) -> list[Requirement]:
    sliding = [k for k, axis in enumerate(lines.axes) if not axis.turns]
    is_apart = bool(sliding) and sliding[-1] - sliding[0] >= len(sliding)
    text = "no joint turns between the slides of four joints"
    found = Requirement(text, np.inf if is_apart and len(lines.axes) == _LONG else 0.0)
    return [*requires(lines), found]


ORIENTED_SLIDES = Family(
    "joints that the orientation determines, between slides",
    (2, 3, _LONG),
    _requires,
    solve,
    readings=("base",),
    aligns=loses_alignment,
)
