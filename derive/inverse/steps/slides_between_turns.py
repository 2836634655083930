"""Prismatic joints in any order between revolute joints that the orientation determines.

The orientation determines up to three revolute joints; two consecutive revolute axes are never
parallel. The position is then linear in up to three displacements, whose directions depend on the
revolute joints. Maximum number of solutions: 1, or 2 with three revolute joints.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import sympy as sp

from ...model.tolerances import DIRECTION_FLOOR
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, cross, dot, subtracted
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement, askew
from ..subproblems.equations import LineAndPlane
from ..subproblems.found import FoundLength
from ..subproblems.sp1 import sp1
from ..subproblems.turns import any_across, perpendicular, rotated
from .aligned import first_angle
from .least_squares import step_on_all
from .rotations import three_turns, two_turns
from .target import Target
from .work import Work

_MAX = 3
"""Maximum number of revolute joints, and maximum number of prismatic joints."""
_FREEDOMS = 6
_PARALLEL = sp.Float("1e-14", 20)
"""Two prismatic joints count as parallel if the sine of their angle is below this rounding
error."""


def requires(lines: Lines) -> list[Requirement]:
    """Returns the conditions on the axes of the chain."""
    turning = [k for k, axis in enumerate(lines.axes) if axis.turns]
    few = len(turning) <= _MAX and 1 <= len(lines.axes) - len(turning) <= _MAX
    count = Requirement(
        "at most three joints are revolute, and at most three are prismatic", 0.0 if few else np.inf
    )
    return [count, *(askew(lines, *pair) for pair in pairwise(turning))]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """Solves for all joints for a tool displacement."""
    # 1. The orientation.
    _turns(work, lines, target)
    # 2. The position.
    _slides(work, lines.axes, target)
    # 3. The pose may have more conditions than the chain has joints.
    if len(lines.axes) < _FREEDOMS:
        step_on_all(work, lines, target)


def _turns(work: Work, lines: Lines, target: Target) -> None:
    """Solves for the revolute joints from the orientation."""
    terms = work.terms
    match [axis for axis in lines.axes if axis.turns]:
        case [first, second, third]:
            aligned = partial(first_angle, terms, lines.axes, target)
            has_conditions = len(lines.axes) < _FREEDOMS
            three_turns(
                work,
                (first, second, third),
                lambda v: target.turned(terms, v),
                aligned if has_conditions else None,
            )
        case [first, second]:
            two_turns(work, (first, second), lambda v: target.turned(terms, v))
        case [only]:
            e = any_across(terms, only.h)
            found = sp1(terms, only.h, e, target.turned(terms, e))
            work.step([only], "subproblem 1", "it alone turns the tool", found)


def _slides(work: Work, axes: Sequence[Axis], target: Target) -> None:
    """Solves for the prismatic joints from the displacement that the revolute joints leave."""
    terms, carried = work.terms, target.home
    sliding: list[Axis] = []
    for axis in reversed(axes):
        if axis.turns:
            turn = work.turns[axis.joint]
            lever = subtracted(terms, carried, axis.p)
            carried = added(terms, axis.p, rotated(terms, axis.h, turn, lever))
            sliding = [replace(s, h=rotated(terms, axis.h, turn, s.h)) for s in sliding]
        else:
            sliding.insert(0, axis)
    meaning = "the displacement along the slides"
    displacement = work.name_vector(
        ("W", "V"), meaning, subtracted(terms, target.position, carried)
    )
    for axis, (normal, reason) in zip(sliding, _normals(work, sliding), strict=True):
        rate, rest = dot(terms, normal, axis.h), dot(terms, normal, displacement)
        # If two consecutive prismatic joints are parallel, the displacement of the first joint is 0
        # and the second joint moves the tool.
        length = terms.let(rest * rate / terms.let(rate**2 + _PARALLEL**2))
        found = FoundLength(length, LineAndPlane(rate, -rest))
        work.slide(axis, "line-plane intersection", reason, found)
        moved = combination(terms, (length,), (axis.h,))
        displacement = subtracted(terms, displacement, moved)


def _normals(work: Work, sliding: Sequence[Axis]) -> Iterator[tuple[Vector, str]]:
    """Yields, for each prismatic joint, a unit vector along which no later joint moves the tool."""
    terms = work.terms
    match sliding:
        case [_, second, third]:
            across = _unit_across(terms, third.h, second.h)
            reason = f"{second.name} and {third.name} do not move the tool along their normal"
            yield cross(terms, across, third.h), reason
    for axis, later in pairwise(sliding[-2:]):
        reason = f"{later.name} does not move the tool across its direction"
        yield _unit_across(terms, later.h, axis.h), reason
    alone = "it alone moves the tool along its direction"
    yield sliding[-1].h, "the rest of the displacement" if len(sliding) > 1 else alone


def _unit_across(terms: Terms, k: Vector, v: Vector) -> Vector:
    """Returns the direction of the component of ``v`` perpendicular to the unit vector ``k``.

    The second projection makes the result perpendicular to ``k`` even if ``v`` is nearly parallel
    to ``k``.
    """
    across = _unit(terms, perpendicular(terms, k, v))
    return _unit(terms, perpendicular(terms, k, across))


def _unit(terms: Terms, v: Vector) -> Vector:
    """Returns a vector divided by its length; a zero vector does not change."""
    inverse = terms.let(1 / terms.let(sp.sqrt(terms.let(dot(terms, v, v) + DIRECTION_FLOOR))))
    return combination(terms, (inverse,), (v,))
