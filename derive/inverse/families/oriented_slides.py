"""Prismatic joints in any order, between revolute joints.

The orientation determines up to three revolute joints. Consecutive revolute joints are never
parallel. Up to three joints are prismatic. Maximum number of solutions: 1 for up to two revolute
joints, 2 for three.
"""

from ..steps.slides_between_turns import requires, solve
from .family import Family

ORIENTED_SLIDES = Family(
    "prismatic joints between revolute joints that the orientation determines",
    (2, 3, 4),
    requires,
    solve,
    readings=("base",),
)
