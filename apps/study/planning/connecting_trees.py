"""Two trees that grow towards each other, by the library ompl.

Source:
    J. J. Kuffner, S. M. LaValle, RRT-connect: an efficient approach to single-query path planning,
    2000; the Open Motion Planning Library, ompl.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError

from ..arguments import above_0
from .roadmap import Plan, Space, ends_of, no_plan, plan_along

FloatArray = NDArray[np.float64]


def connecting_trees(
    space: Space, start: ArrayLike, goal: ArrayLike, *, seconds: float = 5.0, key: int = 1
) -> Plan:
    """A path by RRT-Connect, for spaces in which a roadmap needs too many points.

    Args:
        space: The space.
        start: (n,) the start.
        goal: (n,) the goal.
        seconds: Time after which the search ends [s].
        key: Chooses the random numbers, at least 1; ompl takes the first key of a process alone.

    Returns:
        The path, or the reason why there is none. Every way of it was checked.

    Raises:
        ShapeError: Start or goal is not (n,).
        InputValueError: ompl is not installed, or the time is not above 0.
    """
    try:
        from ompl import base, geometric, util  # noqa: PLC0415
    except ImportError as error:
        raise InputValueError("connecting_trees needs ompl: pip install ompl") from error
    above_0("connecting_trees: seconds", seconds)
    ends = ends_of(space, start, goal)
    if isinstance(ends, Plan):
        return ends
    n = len(space.lower)
    # ompl complains about every key after the first, which it does not take.
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(key)
    util.setLogLevel(util.LOG_ERROR)
    states, bounds = base.RealVectorStateSpace(n), base.RealVectorBounds(n)
    for k in range(n):
        bounds.setLow(k, float(space.lower[k]))
        bounds.setHigh(k, float(space.upper[k]))
    states.setBounds(bounds)
    information = base.SpaceInformation(states)

    def point(state: Any) -> FloatArray:
        return np.array([state[k] for k in range(n)])

    class Ways(base.MotionValidator):  # type: ignore[misc]
        checked = 0

        def checkMotion(self, a: Any, b: Any, *_: Any) -> bool:
            self.checked += 1
            return space.free_way(point(a), point(b))

    ways = Ways(information)
    information.setMotionValidator(ways)
    information.setStateValidityChecker(lambda state: bool(space.free(point(state)[None])[0]))
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.setStartAndGoalStates(*(_state(states, end) for end in ends))
    planner = geometric.RRTConnect(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(float(seconds))
    if not problem.hasExactSolution():
        return no_plan(n, f"no path was found in {seconds:g} s", ways.checked)
    points = np.array([point(state) for state in problem.getSolutionPath().getStates()])
    return plan_along(points, ways.checked)


def _state(states: Any, point: FloatArray) -> Any:
    state = states.allocState()
    for k, value in enumerate(point):
        state[k] = float(value)
    return state
