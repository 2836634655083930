"""Path planning by the algorithm RRT-Connect of the library ompl.

Source: J. J. Kuffner, S. M. LaValle, RRT-connect: an efficient approach to single-query path
planning, 2000. The Open Motion Planning Library (ompl).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles.contract import check_type, requires

from ..arguments import Rng, above_0, key_of
from .plan import Plan, Space, ends_of, no_plan, plan_along

FloatArray = NDArray[np.float64]

_SEEDS = 2**32 - 1
"""Number of different random seeds that the library ompl accepts."""


def rrt_connect(
    space: Space,
    q_start: ArrayLike,
    q_goal: ArrayLike,
    *,
    time_limit: float = 5.0,
    rng: Rng = 0,
) -> Plan:
    """Plan a path by RRT-Connect, for example if a roadmap of `prm` needs too many points.

    Args:
        space: The space, such as a `ConfigurationSpace` or an `OccupancyMap`.
        q_start: (n,) coordinates of the start.
        q_goal: (n,) coordinates of the goal.
        time_limit: Maximum time of the search for a path [s].
        rng: A seed (an int of at least 0), a `numpy.random.Generator`, or None for fresh random
            numbers. Only the first seed in a process has an effect, because the library ompl
            ignores later seeds.

    Returns:
        A `Plan` with the path `q` (m, n), or with the `reason` for a missing path. All segments of
        a returned path were checked and are free.

    Raises:
        ShapeError: `q_start` or `q_goal` is not (n,).
        InputValueError: `time_limit` is not above 0.
        NotInstalledError: The library ompl is not installed.
    """
    check_type("rrt_connect: space", space, Space)
    above_0("rrt_connect: time_limit", time_limit)
    with requires("chasles[planning]"):
        from ompl import base, geometric, util  # noqa: PLC0415
    ends = ends_of(space, q_start, q_goal)
    if isinstance(ends, Plan):
        return ends
    n = len(space.lower)
    # Random seeds of the library ompl begin at 1. The library logs an error if a seed is set twice.
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(key_of("rrt_connect", rng) % _SEEDS + 1)
    util.setLogLevel(util.LOG_ERROR)
    states, bounds = base.RealVectorStateSpace(n), base.RealVectorBounds(n)
    for k in range(n):
        bounds.setLow(k, float(space.lower[k]))
        bounds.setHigh(k, float(space.upper[k]))
    states.setBounds(bounds)
    information = base.SpaceInformation(states)

    def point(state: Any) -> FloatArray:
        return np.array([state[k] for k in range(n)])

    class Segments(base.MotionValidator):  # type: ignore[misc]
        checked = 0

        def checkMotion(self, a: Any, b: Any, *_: Any) -> bool:
            self.checked += 1
            return space.is_free_segment(point(a), point(b))

    segments = Segments(information)
    information.setMotionValidator(segments)
    information.setStateValidityChecker(lambda state: bool(space.is_free(point(state)[None])[0]))
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.setStartAndGoalStates(*(_state(states, end) for end in ends))
    planner = geometric.RRTConnect(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(float(time_limit))
    if not problem.hasExactSolution():
        return no_plan(n, f"no path was found in {time_limit:g} s", segments.checked)
    points = np.array([point(state) for state in problem.getSolutionPath().getStates()])
    return plan_along(points, segments.checked)


def _state(states: Any, point: FloatArray) -> Any:
    state = states.allocState()
    for k, value in enumerate(point):
        state[k] = float(value)
    return state
