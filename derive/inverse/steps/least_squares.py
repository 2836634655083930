"""Gauss-Newton step for arms with fewer joints than the six equations of a pose.

Each step of a closed-form solution uses only some of the six equations of a pose. Near a double
solution of one equation, the joint angle from this equation is accurate only to 1e-8. The other
pose equations often determine the same joint angle to double precision. A Gauss-Newton step on all
six pose equations restores full accuracy. The Gauss-Newton step dq solves ``(J^T J + mu) dq = J^T
e`` with a damping factor mu.

In this equation, e is the twist from the tool to its target pose, and J is the mixed Jacobian.
Lengths in e and J are divided by the arm length.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import NEARLY_SOLVED, POSE_DAMPING
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, cross, dot, subtracted
from ..structure.lines import Axis, Lines
from ..subproblems.quartic import ONE, ZERO, select
from ..subproblems.sp6 import advanced, chosen
from ..subproblems.turns import CosSin, rotated
from .target import Target
from .work import Work

Row = list[sp.Expr]


@dataclass(frozen=True)
class _State:
    turns: dict[int, CosSin]
    lengths: dict[int, sp.Expr]
    error: Row
    square: sp.Expr
    columns: list[Row]


def with_all_conditions(work: Work, lines: Lines, target: Target) -> None:
    """Apply a Gauss-Newton step to a solution.

    The Gauss-Newton step is applied only if the chain contains an added joint that always stays at
    0.

    Args:
        work: Object that records the solution steps.
        lines: The chain, numbered from the base.
        target: The pose that the chain must reach.
    """
    if any(axis.stays for axis in lines.axes):
        step_on_all(work, lines, target)


def step_on_all(work: Work, lines: Lines, target: Target) -> None:
    """Apply a Gauss-Newton step to all joints of a chain with fewer than six joints.

    The Gauss-Newton step is used only if the tool pose is near its target and the step decreases
    the pose error.

    Args:
        work: Object that records the solution steps.
        lines: The chain, numbered from the base.
        target: The pose that the chain must reach.
    """
    terms = work.terms
    axes = [axis for axis in lines.axes if not axis.stays]
    own = {axis.joint for axis in axes}
    turns = {joint: turn for joint, turn in work.turns.items() if joint in own}
    lengths = {joint: length for joint, length in work.lengths.items() if joint in own}
    here = _state(terms, lines, axes, target, turns, lengths)
    there = _state(terms, lines, axes, target, *_moved(terms, axes, here))
    better = sp.And(there.square < here.square, here.square <= terms.let(NEARLY_SOLVED**2))
    for joint, turn in turns.items():
        work.turns[joint] = chosen(terms, better, there.turns[joint], turn)
    for joint, length in lengths.items():
        work.lengths[joint] = select(terms, better, there.lengths[joint], length)
    # The Gauss-Newton step changes the angles of parallel joints, so the stored sums of these
    # angles are no longer correct.
    work.sums.clear()


def _state(
    terms: Terms,
    lines: Lines,
    axes: Sequence[Axis],
    target: Target,
    turns: dict[int, CosSin],
    lengths: dict[int, sp.Expr],
) -> _State:
    """Return the joint values, the twist from tool to target, the squared error and Jacobian."""
    let, zero = terms.let, (ZERO, ZERO, ZERO)
    scale = let(sp.Float(1 / (lines.length or 1.0), 20))
    tool = target.home
    basis: list[Vector] = [(ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE)]
    screws: list[tuple[Vector, Vector]] = []
    for axis in reversed(axes):
        if not axis.turns:
            displacement = combination(terms, (lengths[axis.joint],), (axis.h,))
            tool = added(terms, tool, displacement)
            screws = [(h, added(terms, p, displacement)) for h, p in screws]
            screws.append((axis.h, zero))
            continue
        turn = turns[axis.joint]

        def turned(v: Vector, axis: Axis = axis, turn: CosSin = turn) -> Vector:
            return rotated(terms, axis.h, turn, v)

        def moved(p: Vector, axis: Axis = axis) -> Vector:
            return added(terms, axis.p, turned(subtracted(terms, p, axis.p)))

        tool, basis = moved(tool), [turned(e) for e in basis]
        screws = [(turned(h), moved(p)) for h, p in screws]
        screws.append((axis.h, axis.p))
    columns = []
    for axis, (h, p) in zip(reversed(axes), screws, strict=True):
        lever = cross(terms, h, subtracted(terms, tool, p)) if axis.turns else h
        turning = h if axis.turns else zero
        columns.append([*(let(scale * v) for v in lever), *turning])
    off = subtracted(terms, target.position, tool)
    tilts = [cross(terms, e, wanted) for e, wanted in zip(basis, target.axes, strict=True)]
    tilt = combination(terms, (sp.Rational(1, 2),) * 3, (tilts[0], tilts[1], tilts[2]))
    error = [*(let(scale * v) for v in off), *tilt]
    # The vector ``tilt`` is 0 if the rotation error is 0 or 180 degrees. The squared error
    # therefore uses the differences between the axes of the tool frame and the target frame.
    apart = [subtracted(terms, e, wanted) for e, wanted in zip(basis, target.axes, strict=True)]
    square = let(
        sum((v**2 for v in error[:3]), ZERO) + let(sum((dot(terms, d, d) for d in apart), ZERO) / 2)
    )
    return _State(turns, lengths, error, square, columns)


def _moved(
    terms: Terms, axes: Sequence[Axis], state: _State
) -> tuple[dict[int, CosSin], dict[int, sp.Expr]]:
    step = _solved(terms, state.columns, state.error)
    turns, lengths = dict(state.turns), dict(state.lengths)
    for axis, change in zip(reversed(axes), step, strict=True):
        if axis.turns:
            turns[axis.joint] = advanced(terms, turns[axis.joint], change)
        else:
            lengths[axis.joint] = terms.let(lengths[axis.joint] + change)
    return turns, lengths


def _solved(terms: Terms, columns: Sequence[Row], error: Row) -> Row:
    let, n = terms.let, len(columns)

    def product(a: Row, b: Row) -> sp.Expr:
        return let(sum((x * y for x, y in zip(a, b, strict=True)), ZERO))

    normal = [[product(a, b) for b in columns] for a in columns]
    mu = let(POSE_DAMPING * sum((normal[k][k] for k in range(n)), ZERO))
    right = [product(column, error) for column in columns]
    inverse: Row = []
    for j in range(n):
        pivot = let(normal[j][j] + mu)
        inverse.append(let(1 / pivot))
        for i in range(j + 1, n):
            factor = let(normal[i][j] * inverse[j])
            for k in range(j + 1, i + 1):
                normal[i][k] = let(normal[i][k] - factor * normal[k][j])
            right[i] = let(right[i] - factor * right[j])
    found: Row = [ZERO] * n
    for j in reversed(range(n)):
        rest = sum((normal[i][j] * found[i] for i in range(j + 1, n)), ZERO)
        found[j] = let(let(right[j] - rest) * inverse[j])
    return found
