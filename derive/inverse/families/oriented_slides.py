"""Arms with prismatic and revolute joints in any order.

The tool orientation determines the angles of up to three revolute joints. The axes of two
consecutive revolute joints are never parallel. Up to three joints are prismatic. An arm with up to
two revolute joints has at most 1 solution, and an arm with three has at most 2.
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
