"""Part 3 of the report: roadmaps on a map of our own, and of the arm among obstacles."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any

import lynxmotion_arm
import numpy as np
from report import Finding, Printed, Row, agrees, assumed, in_one_reading, lost, not_printed

from chasles.study.planning import (
    OccupancyMap,
    Plan,
    SuccessStudy,
    box,
    configuration_space,
    occupancy_map,
    prm,
    shortcut,
    sphere,
    success_study,
)

SIDE = 100
"""Cells along each side of the map."""
START, GOAL = np.array([8.0, 8.0]), np.array([92.0, 92.0])
"""Start and goal on the map, in cells."""
CASES = {"3.2": (100, 10), "3.3": (100, 20), "3.4": (200, 10)}
"""Points and step of each figure; the report calls all three 3.2."""
MACHINES = ((10, 34, 10, 8), (44, 20, 8, 10), (44, 66, 8, 12), (78, 26, 10, 8))
"""Corner and sides of each machine on the map, in cells."""
RUNS, SPREAD_RUNS = 20, 4
FEW = 25
"""A number of points with which the reading as least distance finds a path."""
COUNTS = (50, 100, 200, 400)
"""Numbers of points of the study."""
MOST = 0.9
"""Part of the runs that find a path where there are points enough."""
SMALL, LARGE = 10, 20
"""Steps of the figures, in cells."""
LINK = 0.012
"""Radius of the arm's links [m]."""
BALL, BALL_RADIUS = (0.21, 0.09, 0.11), 0.03
"""The ball beside the arm [m]."""
TABLE = np.array([0.5, 0.5, 0.02])
"""Sides of the table under the arm [m]."""


@cache
def workshop() -> OccupancyMap:
    """Walls with gaps and some machines, drawn by us: the map of figure 3.1 is lost."""
    occupied = np.zeros((SIDE, SIDE), dtype=bool)
    occupied[30:34, :50] = True
    occupied[66:70, 50:] = True
    for x, y, width, height in MACHINES:
        occupied[x : x + width, y : y + height] = True
    return occupancy_map(occupied, 1.0)


def rows(printed: dict[str, Printed]) -> list[Row]:
    """Every statement of part 3 beside ours."""
    return [*paths(printed), *claims(printed), *arm(printed)]


@cache
def trials() -> SuccessStudy:
    """Rates of success with the step as the longest way."""
    return success_study(
        workshop(), START, GOAL, samples=COUNTS, max_steps=(SMALL, LARGE), runs=RUNS
    )


def rate(points: int, step: float) -> float:
    """The rate of success with the step as the longest way."""
    found = [row for row in trials().rows if (row.samples, row.max_step) == (points, step)]
    return found[0].rate


@cache
def spread_maps(points: int, step: float) -> list[Any]:
    """Roadmaps with the step as the least distance between points."""
    return [prm(workshop(), points, dispersion=step, rng=key) for key in range(SPREAD_RUNS)]


def spread_rate(points: int, step: float) -> float:
    """The rate of success with the step as the least distance between points."""
    plans = [own.plan(START, GOAL, algorithm="dijkstra") for own in spread_maps(points, step)]
    return sum(plan.found for plan in plans) / SPREAD_RUNS


def spacing(points: int, step: float) -> float:
    """The mean distance of a point from its nearest one, the step as the least distance."""
    found = []
    for own in spread_maps(points, step):
        p = np.asarray(own.q)
        apart = np.linalg.norm(p[:, None] - p[None], axis=-1)
        np.fill_diagonal(apart, np.inf)
        found.append(apart.min(1).mean())
    return float(np.mean(found))


def paths(printed: dict[str, Printed]) -> list[Row]:
    """Figures 3.2 to 3.4 in both readings of the step."""
    free = 1 - workshop().occupied.mean()
    words = "the figure is lost; ours has walls with gaps and machines"
    found = [assumed(printed["map"], f"{SIDE} x {SIDE} cells, {100 * free:.0f} % free", words)]
    for name, own, reading, runs in (
        ("path", rate, "step = longest way between points", RUNS),
        ("spread", spread_rate, "step = least distance between points", SPREAD_RUNS),
    ):
        for k, (figure, case) in enumerate(CASES.items()):
            note = f"{reading}; {runs} runs on our map; figure {figure} by the text"
            found.append(lost(printed[f"{name}_{k + 1}"], own(*case), note))
    return found


def claims(printed: dict[str, Printed]) -> list[Row]:
    """What the report concludes from its figures; no reading of the step bears out all of it."""
    rates = [rate(points, SMALL) for points in COUNTS]
    rising = all(a <= b for a, b in pairwise(rates)) and rates[0] < rates[-1]
    enough = {step: needed(step) for step in (SMALL, LARGE)}
    seconds = [row.seconds for row in trials().rows if row.max_step == LARGE]
    shares = ", ".join(f"{100 * value:.0f} %" for value in rates)
    points = ", ".join(map(str, COUNTS))
    few = {step: spread_rate(FEW, step) for step in (SMALL, LARGE)}
    apart = {step: spacing(100, step) for step in (SMALL, LARGE)}
    always = " and ".join(f"{100 * value:.0f} %" for value in few.values())
    return [
        in_one_reading(
            printed["fails"],
            Finding(rising, shares),
            f"step 10 as longest way between points: {points} points, {RUNS} runs each. As least "
            f"distance {FEW} points find a path in {100 * few[SMALL]:.0f} % of {SPREAD_RUNS} runs",
        ),
        in_one_reading(
            printed["disperses"],
            Finding(
                apart[LARGE] > apart[SMALL],
                f"{apart[SMALL]:.0f} and {apart[LARGE]:.0f} cells apart",
            ),
            "steps 10 and 20 as least distance, 100 points. As longest way the layout does not "
            "depend on the step: no single reading bears out this claim and the one before",
        ),
        in_one_reading(
            printed["fewer"],
            Finding(enough[LARGE] < enough[SMALL], f"{enough[LARGE]} points for {enough[SMALL]}"),
            f"steps 20 and 10 as longest way, for nine of ten runs. As least distance {FEW} points "
            f"find a path in {always} of {SPREAD_RUNS} runs",
        ),
        agrees(
            printed["time"],
            Finding(seconds[0] < seconds[-1], "more time"),
            f"{COUNTS[0]} and {COUNTS[-1]} points, step 20 as longest way",
        ),
    ]


def needed(step: float) -> int:
    """The least number of points with which nine of ten runs find a path."""
    return min(points for points in COUNTS if rate(points, step) >= MOST)


@cache
def arm_plan() -> tuple[Any, Plan]:
    """The arm's space among a ball and a table, and a path from the first via point to the last."""
    table = np.eye(4)
    table[2, 3] = -0.06
    obstacles = [sphere(BALL, BALL_RADIUS), box(table, TABLE, "table")]
    space = configuration_space(lynxmotion_arm.low(), obstacles, radius=LINK)
    start, goal = lynxmotion_arm.solutions(lynxmotion_arm.low(), lynxmotion_arm.VIA[[0, -1]])[:, 0]
    plan = prm(space, 150, rng=1).plan(start, goal, algorithm="dijkstra")
    return space, shortcut(space, plan) if plan.found else plan


def arm(printed: dict[str, Printed]) -> list[Row]:
    """The roadmap in the coordinates of the arm."""
    space, plan = arm_plan()
    clear = min(space.clearance(q)[0] for q in plan.at(np.linspace(0, 1, 60)))
    words = "the report maps a plane; ours moves the arm from point 1 to 5, length in its joints"
    return [not_printed(printed["arm"], plan.length, f"{words}; {1000 * clear:.1f} mm clear")]
