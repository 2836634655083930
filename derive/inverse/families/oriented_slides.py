"""Prismatic joints in any order between revolute joints that the orientation determines.

Up to three joints are revolute, and two consecutive revolute axes are never parallel. Up to three
joints are prismatic. Maximum number of solutions: 1, or 2 with three revolute joints.
"""

from ..steps.slides_between_turns import requires, solve
from .family import Family

ORIENTED_SLIDES = Family(
    "joints that the orientation determines, between slides",
    (2, 3, 4),
    requires,
    solve,
    readings=("base",),
)
