"""A single joint: a turntable, a linear axis, or the last body of a linkage such as a ram.

One solution. For a pose that the joint does not reach, the answer is the nearest in turn, or along
the slide.
"""

from ...terms.vectors import dot, subtracted
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement
from ..subproblems.slides import slide_to_plane
from ..subproblems.sp1 import sp1
from ..subproblems.turns import any_across
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [Requirement(f"{lines.axes[0].name} alone moves the tool", 0.0)]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    (axis,) = lines.axes
    if axis.turns:
        e = any_across(terms, axis.h)
        found = sp1(terms, axis.h, e, target.turned(terms, e))
        work.step([axis], "subproblem 1", "it alone turns the tool", found)
        return
    wanted = work.name_vector(("W", "V"), "the tool's origin", target.point(terms, target.home))
    d = dot(terms, axis.h, subtracted(terms, wanted, target.home))
    zero = subtracted(terms, target.home, target.home)
    length = slide_to_plane(terms, axis.h, axis.h, zero, d)
    work.slide(axis, "a line meets a plane", "it alone moves the tool", length)


ONE_JOINT = Family("one joint", (1,), _requires, _solve, readings=("base",))
