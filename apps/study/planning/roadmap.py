"""Roadmaps: random free points, joined by free ways, on which paths are sought.

The ways are checked when a path first uses them (lazily): most of them never are.

Source:
    L. E. Kavraki, P. Svestka, J.-C. Latombe, M. H. Overmars, Probabilistic roadmaps for path
    planning in high-dimensional configuration spaces, 1996; R. Bohlin, L. E. Kavraki, Path planning
    using lazy PRM, 2000.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, ShapeError
from chasles.summaries import summary_repr

from ..arguments import finite

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Algorithm = Literal["dijkstra", "astar"]

_TRIES = 200
"""Points that are drawn for each point of the roadmap at most."""


class Space(Protocol):
    """A box in which points are free or not.

    Attributes:
        lower: (n,) least coordinates.
        upper: (n,) largest coordinates.
    """

    @property
    def lower(self) -> FloatArray: ...  # noqa: D102
    @property
    def upper(self) -> FloatArray: ...  # noqa: D102

    def free(self, points: FloatArray) -> BoolArray:
        """Whether points (m, n) are free."""

    def free_way(self, a: FloatArray, b: FloatArray) -> bool:
        """Whether the straight way between two points (n,) is free."""

    def why(self, point: FloatArray) -> str:
        """Why a point (n,) is not free."""


@dataclass(frozen=True, eq=False)
class Plan:
    """The answer of a planner.

    Attributes:
        points: (m, n) corners of the path from start to goal; (0, n) without a path.
        length: Its length in the coordinates; inf without a path.
        reason: Why there is no path; "" with one.
        checked: Number of ways that were checked.
    """

    points: FloatArray
    length: float
    reason: str
    checked: int

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        if not self.found:
            return summary_repr(self, "", f"no path, for {self.reason}")
        corners = f"a path through {len(self.points)} points, length {self.length:.6g}"
        facts = (corners, f"{self.checked:,} ways checked")
        return summary_repr(self, "", *facts, methods="points, at(s)")

    @property
    def found(self) -> bool:
        """Whether there is a path."""
        return not self.reason

    def at(self, s: ArrayLike) -> FloatArray:
        """Points on the path.

        Args:
            s: (m,) parts of its length, from 0 to 1.

        Returns:
            (m, n) points.

        Raises:
            InputValueError: There is no path.
        """
        if not self.found:
            raise InputValueError(f"Plan.at: {self.reason}")
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        at = np.r_[0, np.cumsum(steps)] / max(steps.sum(), np.finfo(float).tiny)
        part = np.asarray(s, dtype=np.float64)
        return np.column_stack([np.interp(part, at, column) for column in self.points.T])


def no_plan(n: int, reason: str, checked: int = 0) -> Plan:
    """The answer without a path."""
    return Plan(np.empty((0, n)), np.inf, reason, checked)


def plan_along(points: FloatArray, checked: int) -> Plan:
    """The answer with a path through corners (m, n)."""
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return Plan(points, length, "", checked)


@dataclass(frozen=True, eq=False)
class Roadmap:
    """Free points and the ways between them.

    Attributes:
        space: The space.
        points: (m, n) free points.
        ways: (k, 2) pairs of points that are near each other.
        step: Longest way.
        neighbours: Nearest points that a start or a goal is joined to.
    """

    space: Space
    points: FloatArray
    ways: NDArray[np.intp]
    step: float
    neighbours: int

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        count, n = self.points.shape
        facts = (f"{count:,} points in {n} coordinates", f"{len(self.ways):,} ways")
        return summary_repr(self, "", *facts, methods="plan(start, goal)")

    def plan(self, start: ArrayLike, goal: ArrayLike, algorithm: Algorithm = "astar") -> Plan:
        """The shortest path on the roadmap.

        Args:
            start: (n,) the start.
            goal: (n,) the goal.
            algorithm: "astar", or "dijkstra", which finds the same length and looks at more points.

        Returns:
            The path, or the reason why there is none.

        Raises:
            ShapeError: Start or goal is not (n,).
            InputValueError: The algorithm is unknown.
        """
        import networkx as nx  # noqa: PLC0415

        if algorithm not in ("dijkstra", "astar"):
            raise InputValueError(f"plan: expected dijkstra or astar, got {algorithm!r}")
        ends = ends_of(self.space, start, goal)
        if isinstance(ends, Plan):
            return ends
        points = np.vstack([self.points, ends])
        graph = self._graph(points)
        first, last = len(self.points), len(self.points) + 1
        if self.space.free_way(*ends):
            return plan_along(np.array(ends), 1)
        checked = 1
        search = nx.astar_path if algorithm == "astar" else nx.dijkstra_path
        to_goal = np.linalg.norm(points - points[last], axis=1).tolist()
        options: dict[str, Any] = (
            {"heuristic": lambda i, _: to_goal[i]} if algorithm == "astar" else {}
        )
        while True:
            try:
                path = search(graph, first, last, weight="length", **options)
            except nx.NetworkXNoPath:
                return no_plan(points.shape[1], self._why_none(graph, first, last), checked)
            checked += (blocked := self._check(graph, points, path))[1]
            if not blocked[0]:
                return plan_along(points[path], checked)

    def _graph(self, points: FloatArray) -> Any:
        """The roadmap with start and goal, the last two points, and no way checked."""
        import networkx as nx  # noqa: PLC0415
        from scipy.spatial import cKDTree  # noqa: PLC0415

        ways = [tuple(pair) for pair in self.ways.tolist()]
        if len(self.points):
            tree, k = cKDTree(self.points), min(self.neighbours, len(self.points))
            for end in (len(self.points), len(self.points) + 1):
                distances, near = tree.query(points[end], k=k)
                kept = np.atleast_1d(distances) <= self.step
                ways += [(int(other), end) for other in np.atleast_1d(near)[kept]]
        graph = nx.Graph()
        graph.add_nodes_from(range(len(points)))
        for i, j in ways:
            graph.add_edge(i, j, length=float(np.linalg.norm(points[i] - points[j])), free=False)
        return graph

    def _check(self, graph: Any, points: FloatArray, path: list[int]) -> tuple[bool, int]:
        """Removes the first blocked way: whether there is one, and how many ways it checked."""
        checked = 0
        for i, j in pairwise(path):
            if graph[i][j]["free"]:
                continue
            checked += 1
            if not self.space.free_way(points[i], points[j]):
                graph.remove_edge(i, j)
                return True, checked
            graph[i][j]["free"] = True
        return False, checked

    def _why_none(self, graph: Any, first: int, last: int) -> str:
        import networkx as nx  # noqa: PLC0415

        for end, name in ((first, "start"), (last, "goal")):
            if graph.degree(end) == 0:
                return f"no free way leads from the {name} to a point of the roadmap"
        parts = nx.number_connected_components(graph)
        return f"start and goal lie in different ones of the {parts} parts of the roadmap"


def roadmap(
    space: Space,
    samples: int,
    *,
    neighbours: int = 10,
    step: float = np.inf,
    dispersion: float = 0.0,
    key: int = 0,
) -> Roadmap:
    """Random free points with ways to their nearest neighbours.

    The step of a roadmap is read in two ways: as the longest way that joins two points (`step`), or
    as the least distance between points, their dispersion (`dispersion`).

    Args:
        space: The space.
        samples: Number of free points.
        neighbours: Nearest points that each point is joined to at most.
        step: Longest way, in the coordinates.
        dispersion: Least distance between points, in the coordinates; with a large one there is no
            room for all samples.
        key: Chooses the random numbers.

    Returns:
        The roadmap; it has fewer points where the space has no room for more.

    Raises:
        InputValueError: A number is not positive.
    """
    from scipy.spatial import cKDTree  # noqa: PLC0415

    if samples < 1 or neighbours < 1 or not step > 0 or not dispersion >= 0:
        raise InputValueError(
            f"roadmap: expected samples >= 1, neighbours >= 1, step > 0 and dispersion >= 0, got "
            f"{samples}, {neighbours}, {step} and {dispersion}"
        )
    points = _points(space, samples, dispersion, np.random.default_rng([key, samples]))
    k = min(neighbours + 1, len(points))
    if k < 2:  # noqa: PLR2004 - a way has two ends
        return Roadmap(space, points, np.empty((0, 2), dtype=np.intp), step, neighbours)
    distances, near = cKDTree(points).query(points, k=k)
    i = np.repeat(np.arange(len(points)), k - 1)
    j, kept = near[:, 1:].ravel(), distances[:, 1:].ravel() <= step
    ways = np.unique(np.sort(np.column_stack([i, j])[kept], axis=1), axis=0)
    return Roadmap(space, points, ways, step, neighbours)


def _points(space: Space, count: int, dispersion: float, rng: np.random.Generator) -> FloatArray:
    """Free points, at most `count`, each at least `dispersion` from those before it."""
    lower, upper = space.lower, space.upper
    kept = np.empty((0, len(lower)))
    for _ in range(_TRIES):
        drawn = rng.uniform(lower, upper, (count, len(lower)))
        drawn = drawn[space.free(drawn)]
        if dispersion:
            drawn = _dispersed(kept, drawn, dispersion)
        kept = np.vstack([kept, drawn])[:count]
        if len(kept) == count:
            break
    return kept


def _dispersed(kept: FloatArray, drawn: FloatArray, dispersion: float) -> FloatArray:
    """The drawn points that lie at least `dispersion` from the points kept before them."""
    apart = np.linalg.norm(drawn[:, None] - kept, axis=-1) >= dispersion
    chosen = np.empty((0, drawn.shape[1]))
    for point in drawn[apart.all(axis=1)]:
        if (np.linalg.norm(chosen - point, axis=1) >= dispersion).all():
            chosen = np.vstack([chosen, point])
    return chosen


def ends_of(
    space: Space, start: ArrayLike, goal: ArrayLike
) -> tuple[FloatArray, FloatArray] | Plan:
    """Start and goal as arrays, or the answer that one of them is not free.

    Raises:
        ShapeError: One of them is not (n,).
        InputValueError: A number is not finite.
    """
    n = len(space.lower)
    ends = []
    for name, given in (("start", start), ("goal", goal)):
        point = np.asarray(given, dtype=np.float64)
        if point.shape != (n,):
            raise ShapeError(f"{name}: expected ({n},), got shape {point.shape}")
        finite(name, point)
        beyond = ((point < space.lower) | (point > space.upper)).any()
        if beyond or not space.free(point[None])[0]:
            return no_plan(n, f"the {name} is not free: {space.why(point)}")
        ends.append(point)
    return ends[0], ends[1]
