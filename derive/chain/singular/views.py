"""Where an arm's Jacobian is written so that most of its entries are 0: a body and a point of it.

The rank of the Jacobian, and the determinant of as many columns as it has rows, do not depend on
frame and point (Murray, Li and Sastry 1994, 3.4). As seen by a body in the middle of the chain and
at a point where axes meet, rows and columns fall into small blocks.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.utilities.iterables import strongly_connected_components

from ...model.robot import SerialRobot
from ..poe import placement_matrix

FloatArray = NDArray[np.float64]
Flags = NDArray[np.bool_]
Block = tuple[tuple[int, ...], tuple[int, ...]]
"""Rows and columns of a block on the diagonal."""
NOTHING = 1e-9
"""Entry of a Jacobian, beside lengths of about a metre, below which it counts as 0."""
SEED = 20
TRIES = 3
"""Configurations in general position at which an entry has to be 0."""


@dataclass(frozen=True)
class View:
    """Where the Jacobian is written.

    Attributes:
        body: The number of joints before the body that sees it.
        point: The point of the body, in the base frame with every joint at 0.
        filled: The entries (6, n) that are not 0 in general position.
    """

    body: int
    point: sp.Matrix
    filled: Flags

    @property
    def key(self) -> tuple[int, sp.Matrix]:
        """What tells this view from others."""
        return self.body, self.point

    @property
    def rows(self) -> tuple[int, ...]:
        """The rows that are not 0."""
        return tuple(np.flatnonzero(self.filled.any(axis=1)).tolist())


@dataclass(frozen=True)
class Minor:
    """A square part of the Jacobian in a view.

    Attributes:
        view: Where the Jacobian is written.
        blocks: The part's blocks on its diagonal; beside them it is triangular.
    """

    view: View
    blocks: tuple[Block, ...]

    @property
    def size(self) -> int:
        """The joints of the largest block."""
        return max(len(columns) for _, columns in self.blocks)

    @property
    def cost(self) -> tuple[int, int]:
        """The largest block first, then the entries that are not 0."""
        return self.size, int(self.view.filled.sum())


def minors(
    robot: SerialRobot, S: sp.Matrix, values: Mapping[sp.Symbol, sp.Expr | float]
) -> tuple[Minor, ...]:
    """The largest square parts of a Jacobian, each in the view with the smallest blocks.

    There is one part where the rows that are not 0 are as many as the joints. Of more joints, each
    part leaves joints out and may have a view of its own. Of fewer joints, each part leaves rows
    out, and all have the view in which the parts together are the simplest. Parts whose determinant
    is 0 by their pattern of zeros are left out.

    Args:
        robot: A serial robot.
        S: Its screws in the base frame (6, n).
        values: The values of the symbols in the screws.
    """
    views = list(_views(robot, S, values))
    fewest = min(len(view.rows) for view in views)
    views = [view for view in views if len(view.rows) == fewest]
    count = S.shape[1]
    if count >= fewest:
        found = (_best(views, columns) for columns in combinations(range(count), fewest))
        return tuple(minor for minor in found if minor)
    ways = [_without_rows(view, count) for view in views]
    return min(ways, key=lambda way: max((m.cost for m in way), default=(count + 1, 0)))


def _best(views: Sequence[View], columns: Sequence[int]) -> Minor | None:
    """The determinant of some columns, in the view where its blocks are smallest."""
    found = [
        Minor(view, blocks)
        for view in views
        if (blocks := _blocks(view.filled, view.rows, columns))
    ]
    return min(found, key=lambda minor: minor.cost, default=None)


def _without_rows(view: View, count: int) -> tuple[Minor, ...]:
    """The determinants of all columns in as many rows of one view."""
    found = (_blocks(view.filled, rows, range(count)) for rows in combinations(view.rows, count))
    return tuple(Minor(view, blocks) for blocks in found if blocks)


def _views(
    robot: SerialRobot, S: sp.Matrix, values: Mapping[sp.Symbol, sp.Expr | float]
) -> Iterator[View]:
    in_numbers = np.array(S.xreplace(values).evalf(), float)
    postures = np.random.default_rng(SEED).uniform(-3, 3, (TRIES, S.shape[1]))
    points = [(p, np.array(p.xreplace(values).evalf(), float).ravel()) for p in _points(robot)]
    for body in range(S.shape[1] + 1):
        stacked = seen_screws(in_numbers, postures, body)
        for point, at in points:
            moved = stacked.copy()
            moved[:, :3] += np.cross(stacked[:, 3:], at[None, :, None], axis=1)
            yield View(body, point, np.asarray((np.abs(moved) > NOTHING).any(axis=0)))


def _points(robot: SerialRobot) -> list[sp.Matrix]:
    """The origins of all frames of the chain, with every joint at 0."""
    T = placement_matrix(robot.base)
    found = [T[:3, 3]]
    for joint in robot.joints:
        for placement in (joint.before, joint.after):
            T = T * placement_matrix(placement)
            found.append(T[:3, 3])
    return [sp.ImmutableMatrix(point) for point in dict.fromkeys(map(sp.ImmutableMatrix, found))]


def seen_screws(S: FloatArray, q: FloatArray, body: int) -> FloatArray:
    """The screws of all joints (..., 6, n) as the body behind so many joints sees them.

    Args:
        S: The screws in the base frame (6, n), axes of unit length.
        q: Postures (..., n).
        body: Number of joints before the body.
    """
    # Components come first, so that the cross product of all screws is one of rows.
    seen = np.repeat(S[:, None], math.prod(q.shape[:-1]), axis=1)
    angles = q.reshape(-1, q.shape[-1], 1)
    for k in range(body):
        seen[..., :k] = _carried(S[:, k], -angles[:, k], seen[..., :k])
    for k in range(S.shape[1] - 1, body - 1, -1):
        seen[..., k + 1 :] = _carried(S[:, k], angles[:, k], seen[..., k + 1 :])
    return np.moveaxis(seen, 0, 1).reshape(*q.shape[:-1], *S.shape)


def _carried(axis: FloatArray, angle: FloatArray, screws: FloatArray) -> FloatArray:
    """Screws (6, m, k) that a joint carries along, turned by an angle (m, 1)."""
    v, w = axis[:3], axis[3:]
    linear, angular = screws[:3], screws[3:]
    if not w.any():
        return np.concatenate([linear + angle * _cross(v, angular), angular])
    c, s = np.cos(angle), np.sin(angle)
    p = _cross(w, v)[:, None, None]
    p = p - _rotated(w, c, s, p)
    turned = _rotated(w, c, s, angular)
    return np.concatenate([_rotated(w, c, s, linear) + _cross(p, turned), turned])


def _rotated(w: FloatArray, c: FloatArray, s: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors (3, m, k) turned about a unit vector, by Rodrigues' formula."""
    across = _cross(w, vectors)
    turned: FloatArray = vectors + s * across + (1 - c) * _cross(w, across)
    return turned


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """The cross products of vectors (3, ...), several times as fast as NumPy's own."""
    (a1, a2, a3), (b1, b2, b3) = a, b
    return np.stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def _blocks(filled: Flags, rows: Sequence[int], columns: Sequence[int]) -> tuple[Block, ...] | None:
    """The blocks of a square part; None where its zeros make it singular."""
    row_of: dict[int, int] = {}
    for column in columns:
        if not _matched(filled, rows, column, row_of, set()):
            return None
    of_column = {column: row for row, column in row_of.items()}
    edges = [(a, b) for a in columns for b in columns if filled[of_column[a], b]]
    components = strongly_connected_components((list(columns), edges))
    return tuple(
        (tuple(of_column[c] for c in sorted(part)), tuple(sorted(part))) for part in components
    )


def _matched(
    filled: Flags, rows: Sequence[int], column: int, row_of: dict[int, int], seen: set[int]
) -> bool:
    """Whether a column finds a row of its own, others making room (an augmenting path)."""
    for row in rows:
        if filled[row, column] and row not in seen:
            seen.add(row)
            if row not in row_of or _matched(filled, rows, row_of[row], row_of, seen):
                row_of[row] = column
                return True
    return False
