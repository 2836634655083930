"""Planning spaces with free and blocked points, and paths between free points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, ShapeError
from chasles.summaries import summary_repr

from ..arguments import finite, real
from ..results import StudyResult

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@runtime_checkable
class Space(Protocol):
    """A box of coordinates with free and blocked points, the input of planners such as `prm`.

    Attributes:
        lower: (n,) smallest coordinates of the space.
        upper: (n,) largest coordinates of the space.
    """

    @property
    def lower(self) -> FloatArray: ...  # noqa: D102
    @property
    def upper(self) -> FloatArray: ...  # noqa: D102

    def is_free(self, q: FloatArray) -> BoolArray:
        """Return a mask (m,) of the points (m, n) that are free."""

    def is_free_segment(self, a: FloatArray, b: FloatArray) -> bool:
        """Return whether the whole segment between two points (n,) is free."""

    def explain(self, q: FloatArray) -> str:
        """Return the reason why a point (n,) is not free."""


@dataclass(frozen=True, eq=False)
class Plan(StudyResult):
    """A path of straight segments in the coordinates of a space, or the reason for a missing path.

    Attributes:
        q: (m, n) corners of the path from start to goal, in the coordinates of the space. Without a
            path, `q` is an empty array (0, n).
        length: Euclidean length of the path in the coordinates, or inf without a path.
        reason: The reason why no path was found, or "" if a path was found.
        n_checked: Number of segments that the planner checked.
    """

    q: FloatArray
    length: float
    reason: str
    n_checked: int

    def __repr__(self) -> str:
        """Short summary with the main values."""
        if not self.found:
            return summary_repr(self, "", f"no path: {self.reason}")
        corners = f"a path through {len(self.q)} points, length {self.length:.6g}"
        facts = (corners, f"{self.n_checked:,} segments checked")
        return summary_repr(self, "", *facts, methods="q, at(s), plot(), save(path)")

    @property
    def found(self) -> bool:
        """Whether the plan has a path."""
        return not self.reason

    def at(self, s: ArrayLike) -> FloatArray:
        """Return the points (m, n) of the path at given fractions of its length.

        Args:
            s: (m,) fractions of the path length, from 0 to 1.

        Raises:
            InputValueError: The plan has no path.
        """
        fraction = real("Plan.at: s", s)
        corners = self._corner_fractions
        return np.column_stack([np.interp(fraction, corners, column) for column in self.q.T])

    @property
    def _corner_fractions(self) -> FloatArray:
        """Return the fractions (m,) of the path length from the start to each corner, from 0 to 1.

        Raises:
            InputValueError: The plan has no path.
        """
        if not self.found:
            raise InputValueError(f"Plan: there is no path: {self.reason}")
        steps = np.linalg.norm(np.diff(self.q, axis=0), axis=1)
        return np.asarray(np.r_[0, np.cumsum(steps)] / max(steps.sum(), np.finfo(float).tiny))

    def plot(self, ax: Any = None) -> Any:
        """Plot the coordinates against the fraction of the path length.

        If the space has two coordinates, plot the path itself.

        Args:
            ax: matplotlib axes, or None for a new figure.

        Returns:
            The axes.

        Raises:
            InputValueError: The plan has no path.
        """
        from ..pictures import plot_plan  # noqa: PLC0415

        return plot_plan(self, ax)


def no_plan(n: int, reason: str, n_checked: int = 0) -> Plan:
    """Return the `Plan` of a failed search, with an empty path and a reason."""
    return Plan(np.empty((0, n)), np.inf, reason, n_checked)


def plan_along(q: FloatArray, n_checked: int) -> Plan:
    """Return the `Plan` of a path with the corners q (m, n)."""
    length = float(np.linalg.norm(np.diff(q, axis=0), axis=1).sum())
    return Plan(q, length, "", n_checked)


def ends_of(
    space: Space, q_start: ArrayLike, q_goal: ArrayLike
) -> tuple[FloatArray, FloatArray] | Plan:
    """Return the start and goal points as arrays.

    If one of the points is not free or exceeds the limits of the space, return a failed plan.

    Raises:
        ShapeError: The shape of `q_start` or `q_goal` is not (n,).
        InputValueError: `q_start` or `q_goal` contains a number that is not finite.
    """
    n = len(space.lower)
    ends = []
    for name, values in (("start", q_start), ("goal", q_goal)):
        point = real(f"plan: q_{name}", values)
        if point.shape != (n,):
            raise ShapeError(f"q_{name}: expected ({n},), got shape {point.shape}")
        finite(f"q_{name}", point)
        beyond = ((point < space.lower) | (point > space.upper)).any()
        if beyond or not space.is_free(point[None])[0]:
            return no_plan(n, f"the {name} is not free: {space.explain(point)}")
        ends.append(point)
    return ends[0], ends[1]
