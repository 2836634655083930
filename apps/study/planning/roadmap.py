"""Probabilistic roadmaps: graphs of random free points, connected by edges.

An edge of a roadmap is checked only when a path first uses it. Most edges are never checked.

Source:
    L. E. Kavraki, P. Svestka, J.-C. Latombe, M. H. Overmars, Probabilistic roadmaps for path
    planning in high-dimensional configuration spaces, 1996; R. Bohlin, L. E. Kavraki, Path planning
    using lazy PRM, 2000.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError
from chasles.contract import check_type, requires
from chasles.summaries import summary_repr

from ..arguments import Rng, integer_at_least, key_of, number
from .plan import Plan, Space, ends_of, no_plan, plan_along

FloatArray = NDArray[np.float64]
Algorithm = Literal["dijkstra", "astar"]

_TRIES = 200
"""Maximum number of random points that are sampled per point of the roadmap."""


@dataclass(frozen=True, eq=False)
class Roadmap:
    """A graph of free points, with edges that are checked when a path is planned.

    Attributes:
        space: The space, such as a `ConfigurationSpace` or an `OccupancyMap`.
        q: (m, n) coordinates of the free points.
        edges: (k, 2) index pairs of neighboring points. The edges between these points may cross
            blocked points.
        max_step: Maximum Euclidean length of an edge in the coordinates.
        neighbors: Number of nearest points to which a start or a goal is connected.
    """

    space: Space
    q: FloatArray
    edges: NDArray[np.intp]
    max_step: float
    neighbors: int

    def __repr__(self) -> str:
        """Short summary with the main values."""
        count, n = self.q.shape
        facts = (f"{count:,} points in {n} coordinates", f"{len(self.edges):,} edges")
        return summary_repr(self, "", *facts, methods="plan(q_start, q_goal)")

    def plot(self, ax: Any = None) -> Any:
        """Plot the points and edges of the roadmap in the first two coordinates.

        Args:
            ax: matplotlib axes, or None for a new figure.

        Returns:
            The axes.
        """
        from ..pictures import plot_roadmap  # noqa: PLC0415

        return plot_roadmap(self, ax)

    def plan(
        self, q_start: ArrayLike, q_goal: ArrayLike, *, algorithm: Algorithm = "astar"
    ) -> Plan:
        """Return the shortest free path on the roadmap.

        Args:
            q_start: (n,) coordinates of the start.
            q_goal: (n,) coordinates of the goal.
            algorithm: "astar" or "dijkstra". Dijkstra's algorithm finds a path of the same length
                as A* but visits more points.

        Returns:
            A `Plan` with the path `q` (m, n), or with the `reason` for a missing path.

        Raises:
            ShapeError: `q_start` or `q_goal` is not (n,).
            InputValueError: `algorithm` is unknown.
        """
        with requires("chasles[study]"):
            import networkx as nx  # noqa: PLC0415

        if algorithm not in ("dijkstra", "astar"):
            raise InputValueError(f"plan: expected dijkstra or astar, got {algorithm!r}")
        ends = ends_of(self.space, q_start, q_goal)
        if isinstance(ends, Plan):
            return ends
        points = np.vstack([self.q, ends])
        graph = self._graph(points)
        first, last = len(self.q), len(self.q) + 1
        if self.space.is_free_segment(*ends):
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
        """Return the roadmap as a graph with unchecked edges.

        The last two points of the graph are the start and the goal.
        """
        with requires("chasles[study]"):
            import networkx as nx  # noqa: PLC0415
            from scipy.spatial import cKDTree  # noqa: PLC0415

        edges = [tuple(pair) for pair in self.edges.tolist()]
        if len(self.q):
            tree, k = cKDTree(self.q), min(self.neighbors, len(self.q))
            for end in (len(self.q), len(self.q) + 1):
                distances, near = tree.query(points[end], k=k)
                kept = np.atleast_1d(distances) <= self.max_step
                edges += [(int(other), end) for other in np.atleast_1d(near)[kept]]
        graph = nx.Graph()
        graph.add_nodes_from(range(len(points)))
        for i, j in edges:
            graph.add_edge(i, j, length=float(np.linalg.norm(points[i] - points[j])), free=False)
        return graph

    def _check(self, graph: Any, points: FloatArray, path: list[int]) -> tuple[bool, int]:
        """Remove the first blocked edge of a path.

        Return whether an edge was removed, and the number of edge checks.
        """
        checked = 0
        for i, j in pairwise(path):
            if graph[i][j]["free"]:
                continue
            checked += 1
            if not self.space.is_free_segment(points[i], points[j]):
                graph.remove_edge(i, j)
                return True, checked
            graph[i][j]["free"] = True
        return False, checked

    def _why_none(self, graph: Any, first: int, last: int) -> str:
        with requires("chasles[study]"):
            import networkx as nx  # noqa: PLC0415

        for end, name in ((first, "start"), (last, "goal")):
            if graph.degree(end) == 0:
                return f"no free edge connects the {name} to a point of the roadmap"
        parts = nx.number_connected_components(graph)
        return f"start and goal lie in different parts of the roadmap, which has {parts} parts"


def prm(
    space: Space,
    samples: int,
    *,
    neighbors: int = 10,
    max_step: float = np.inf,
    dispersion: float = 0.0,
    rng: Rng = 0,
) -> Roadmap:
    """Return a probabilistic roadmap: random free points, and edges between near points.

    Args:
        space: The space, such as a `ConfigurationSpace` or an `OccupancyMap`.
        samples: Number of free points to sample.
        neighbors: Maximum number of nearest points to which each point is connected.
        max_step: Maximum Euclidean length of an edge in the coordinates.
        dispersion: Minimum Euclidean distance between two points in the coordinates. If too few
            points with this distance are found, the roadmap has fewer points than `samples`.
        rng: A seed (an int of at least 0), a `numpy.random.Generator`, or None for fresh random
            numbers.

    Raises:
        InputValueError: `samples` or `neighbors` is less than 1, `max_step` is not above 0, or
            `dispersion` is negative.
    """
    check_type("prm: space", space, Space)
    samples = integer_at_least("prm: samples", samples, 1)
    neighbors = integer_at_least("prm: neighbors", neighbors, 1)
    max_step = number("prm: max_step", max_step)
    dispersion = number("prm: dispersion", dispersion)
    if not max_step > 0 or not dispersion >= 0:
        raise InputValueError(
            f"prm: expected max_step > 0 and dispersion >= 0, got {max_step} and {dispersion}"
        )
    with requires("chasles[study]"):
        from scipy.spatial import cKDTree  # noqa: PLC0415

    points = _points(
        space, samples, dispersion, np.random.default_rng([key_of("prm", rng), samples])
    )
    k = min(neighbors + 1, len(points))
    if k < 2:  # noqa: PLR2004 - an edge has two ends
        return Roadmap(space, points, np.empty((0, 2), dtype=np.intp), max_step, neighbors)
    distances, near = cKDTree(points).query(points, k=k)
    i = np.repeat(np.arange(len(points)), k - 1)
    j, kept = near[:, 1:].ravel(), distances[:, 1:].ravel() <= max_step
    edges = np.unique(np.sort(np.column_stack([i, j])[kept], axis=1), axis=0)
    return Roadmap(space, points, edges, max_step, neighbors)


def _points(space: Space, count: int, dispersion: float, rng: np.random.Generator) -> FloatArray:
    """Return at most `count` free points whose distances are at least `dispersion`."""
    lower, upper = space.lower, space.upper
    kept = np.empty((0, len(lower)))
    for _ in range(_TRIES):
        sampled = rng.uniform(lower, upper, (count, len(lower)))
        sampled = sampled[space.is_free(sampled)]
        if dispersion:
            sampled = _dispersed(kept, sampled, dispersion)
        kept = np.vstack([kept, sampled])[:count]
        if len(kept) == count:
            break
    return kept


def _dispersed(kept: FloatArray, sampled: FloatArray, dispersion: float) -> FloatArray:
    """Select sampled points at least `dispersion` away from the kept points and from each other."""
    apart = np.linalg.norm(sampled[:, None] - kept, axis=-1) >= dispersion
    chosen = np.empty((0, sampled.shape[1]))
    for point in sampled[apart.all(axis=1)]:
        if (np.linalg.norm(chosen - point, axis=1) >= dispersion).all():
            chosen = np.vstack([chosen, point])
    return chosen
