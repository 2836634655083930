"""Selects the frame and reference point for which the Jacobian has the most zeros.

Frame and reference point change neither the rank nor the determinant of the Jacobian (Murray, Li
and Sastry 1994, 3.4). If the Jacobian is expressed in a frame in the middle of the chain, its
diagonal blocks are smaller. A reference point at the intersection of joint axes also makes the
diagonal blocks smaller.
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
"""Row indices and column indices of a diagonal block."""
NOTHING = 1e-9
"""Jacobian entries below this value count as 0."""
SEED = 20
TRIES = 3
"""Number of random configurations at which the Jacobian is evaluated.

A Jacobian entry that is 0 at all TRIES random configurations counts as always 0.
"""


@dataclass(frozen=True)
class View:
    """A frame and a reference point for a Jacobian.

    Attributes:
        body: Number of joints between the base and the body that defines the frame.
        point: The reference point in the base frame, for joints at 0.
        filled: Mask (6, n) of the Jacobian entries that may differ from 0.
    """

    body: int
    point: sp.Matrix
    filled: Flags

    @property
    def key(self) -> tuple[int, sp.Matrix]:
        """Key that identifies the frame and the reference point."""
        return self.body, self.point

    @property
    def rows(self) -> tuple[int, ...]:
        """The nonzero rows."""
        return tuple(np.flatnonzero(self.filled.any(axis=1)).tolist())


@dataclass(frozen=True)
class Minor:
    """A square submatrix of the Jacobian for one frame and one reference point.

    Attributes:
        view: The frame and reference point of the Jacobian.
        blocks: The diagonal blocks of the submatrix, which is block-triangular.
    """

    view: View
    blocks: tuple[Block, ...]

    @property
    def size(self) -> int:
        """Number of joints in the largest block."""
        return max(len(columns) for _, columns in self.blocks)

    @property
    def cost(self) -> tuple[int, int]:
        """Sort key (size of the largest block, number of entries that are not 0)."""
        return self.size, int(self.view.filled.sum())


def minors(
    robot: SerialRobot, S: sp.Matrix, values: Mapping[sp.Symbol, sp.Expr | float]
) -> tuple[Minor, ...]:
    """Return the largest square submatrices of a Jacobian.

    A Jacobian with as many nonzero rows as columns (joints) has a single largest square submatrix.
    If the Jacobian has more columns than nonzero rows, each submatrix omits columns. Each submatrix
    that omits columns has its own frame and reference point. All submatrices that omit rows have
    the same frame and reference point. Submatrices that are singular in every configuration are
    omitted.

    Args:
        robot: A serial robot.
        S: The screws of the robot in the base frame (6, n).
        values: Numeric values of the symbols in the screws.
    """
    views = list(_views(robot, S, values))
    fewest = min(len(view.rows) for view in views)
    views = [view for view in views if len(view.rows) == fewest]
    count = S.shape[1]
    if count >= fewest:
        found = (_best(views, columns) for columns in combinations(range(count), fewest))
        return tuple(minor for minor in found if minor)
    choices = [_without_rows(view, count) for view in views]
    return min(choices, key=lambda choice: max((m.cost for m in choice), default=(count + 1, 0)))


def _best(views: Sequence[View], columns: Sequence[int]) -> Minor | None:
    found = [
        Minor(view, blocks)
        for view in views
        if (blocks := _blocks(view.filled, view.rows, columns))
    ]
    return min(found, key=lambda minor: minor.cost, default=None)


def _without_rows(view: View, count: int) -> tuple[Minor, ...]:
    found = (_blocks(view.filled, rows, range(count)) for rows in combinations(view.rows, count))
    return tuple(Minor(view, blocks) for blocks in found if blocks)


def _views(
    robot: SerialRobot, S: sp.Matrix, values: Mapping[sp.Symbol, sp.Expr | float]
) -> Iterator[View]:
    in_numbers = np.array(S.xreplace(values).evalf(), float)
    configurations = np.random.default_rng(SEED).uniform(-3, 3, (TRIES, S.shape[1]))
    points = [(p, np.array(p.xreplace(values).evalf(), float).ravel()) for p in _points(robot)]
    for body in range(S.shape[1] + 1):
        stacked = seen_screws(in_numbers, configurations, body)
        for point, at in points:
            moved = stacked.copy()
            moved[:, :3] += np.cross(stacked[:, 3:], at[None, :, None], axis=1)
            yield View(body, point, np.asarray((np.abs(moved) > NOTHING).any(axis=0)))


def _points(robot: SerialRobot) -> list[sp.Matrix]:
    T = placement_matrix(robot.base)
    found = [T[:3, 3]]
    for joint in robot.joints:
        for placement in (joint.before, joint.after):
            T = T * placement_matrix(placement)
            found.append(T[:3, 3])
    return [sp.ImmutableMatrix(point) for point in dict.fromkeys(map(sp.ImmutableMatrix, found))]


def seen_screws(S: FloatArray, q: FloatArray, body: int) -> FloatArray:
    """Return the screws of all joints in the frame of a body (..., 6, n).

    Args:
        S: The screws in the base frame (6, n), with unit axes.
        q: Configurations (..., n).
        body: Number of joints between the base and the body.
    """
    # The first array index is the screw component, so that cross products use whole rows.
    seen = np.repeat(S[:, None], math.prod(q.shape[:-1]), axis=1)
    angles = q.reshape(-1, q.shape[-1], 1)
    for k in range(body):
        seen[..., :k] = _carried(S[:, k], -angles[:, k], seen[..., :k])
    for k in range(S.shape[1] - 1, body - 1, -1):
        seen[..., k + 1 :] = _carried(S[:, k], angles[:, k], seen[..., k + 1 :])
    return np.moveaxis(seen, 0, 1).reshape(*q.shape[:-1], *S.shape)


def _carried(axis: FloatArray, angle: FloatArray, screws: FloatArray) -> FloatArray:
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
    across = _cross(w, vectors)
    turned: FloatArray = vectors + s * across + (1 - c) * _cross(w, across)
    return turned


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return cross products of vectors (3, ...).

    Explicit products of the components are several times faster than ``np.cross``.
    """
    (a1, a2, a3), (b1, b2, b3) = a, b
    return np.stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1])


def _blocks(filled: Flags, rows: Sequence[int], columns: Sequence[int]) -> tuple[Block, ...] | None:
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
    for row in rows:
        if filled[row, column] and row not in seen:
            seen.add(row)
            if row not in row_of or _matched(filled, rows, row_of[row], row_of, seen):
                row_of[row] = column
                return True
    return False
