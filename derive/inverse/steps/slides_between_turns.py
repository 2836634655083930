"""Solves for prismatic and revolute joints in any order.

The tool orientation determines the revolute joints.

The chain has up to three revolute joints, of which two consecutive joints are never parallel. Once
the revolute joints are known, the tool position is linear in the displacements of up to three
prismatic joints. A chain with up to two revolute joints has at most one solution. A chain with
three revolute joints has at most two solutions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from ...terms.vectors import added, subtracted
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement, askew
from ..subproblems.sp1 import sp1
from ..subproblems.turns import any_across, rotated
from .aligned import first_angle
from .dependent_slides import dependent_lengths, in_order
from .least_squares import step_on_all
from .rotations import Aligned, three_turns, two_turns
from .target import Target
from .work import Work

_MAX = 3
"""Maximum number of revolute joints, and maximum number of prismatic joints."""
_FREEDOMS = 6


def requires(lines: Lines) -> list[Requirement]:
    """Return the conditions on the axes of the chain."""
    turning = [k for k, axis in enumerate(lines.axes) if axis.turns]
    few = len(turning) <= _MAX and 1 <= len(lines.axes) - len(turning) <= _MAX
    count = Requirement(
        "at most three joints are revolute, and at most three are prismatic", 0.0 if few else np.inf
    )
    return [count, *(askew(lines, *pair) for pair in pairwise(turning))]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """Solve for all joints of a chain of prismatic and revolute joints."""
    # 1. The orientation.
    _turns(work, lines, target)
    # 2. The position.
    _slides(work, lines.axes, target)
    # 3. If the chain has fewer than six joints, a Gauss-Newton step corrects all joint values.
    if len(lines.axes) < _FREEDOMS:
        step_on_all(work, lines, target)


def _turns(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    match [axis for axis in lines.axes if axis.turns]:
        case [first, second, third]:
            aligned = Aligned(partial(first_angle, terms, lines.axes, target))
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
            work.step([only], "subproblem 1", "only this joint rotates the tool", found)


def _slides(work: Work, axes: Sequence[Axis], target: Target) -> None:
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
    meaning = "the displacement by the prismatic joints"
    displacement = work.name_vector(
        ("W", "V"), meaning, subtracted(terms, target.position, carried)
    )
    directions = [axis.h for axis in sliding]
    steps = list(in_order(terms, directions, displacement))
    lengths = dependent_lengths(terms, directions, displacement)
    for axis, found, length, reason in zip(sliding, steps, lengths, _reasons(sliding), strict=True):
        work.slide(axis, "line-plane intersection", reason, replace(found, length=length))


def _reasons(sliding: Sequence[Axis]) -> Iterator[str]:
    match sliding:
        case [_, second, third]:
            yield f"{second.name} and {third.name} do not move the tool along their common normal"
    for _, later in pairwise(sliding[-2:]):
        yield f"{later.name} moves the tool only along its own direction"
    alone = "only this joint moves the tool along its direction"
    yield "this joint produces the remaining displacement" if len(sliding) > 1 else alone
