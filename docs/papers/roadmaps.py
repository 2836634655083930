"""Part 3 of the report: roadmaps on an occupancy map, and a roadmap of the arm among obstacles."""

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
"""Number of cells along each side of the map."""
START, GOAL = np.array([8.0, 8.0]), np.array([92.0, 92.0])
"""Start and goal positions on the map, in cells."""
CASES = {"3.2": (100, 10), "3.3": (100, 20), "3.4": (200, 10)}
"""Number of roadmap points and step size in each figure. The report numbers three figures 3.2, but
this script numbers these figures 3.2 to 3.4."""
MACHINES = ((10, 34, 10, 8), (44, 20, 8, 10), (44, 66, 8, 12), (78, 26, 10, 8))
"""Corner and side lengths of each machine on the map, in cells."""
RUNS, SPREAD_RUNS = 10, 4
FEW = 25
COUNTS = (50, 100, 200, 400)
"""Numbers of roadmap points in the study of success rates."""
MAX = 0.9
"""A number of roadmap points is sufficient if at least this fraction of the planning runs succeed.
"""
SMALL, LARGE = 10, 20
"""Step sizes of the roadmaps in figures 3.2 to 3.4, in map cells."""
READ = "we read the paper's step as"
LINK = 0.012
"""Radius of the arm's links [m]."""
BALL, BALL_RADIUS = (0.21, 0.09, 0.11), 0.03
"""Center and radius of the spherical obstacle [m]."""
TABLE = np.array([0.5, 0.5, 0.02])
"""Side lengths of the table under the arm [m]."""


@cache
def workshop() -> OccupancyMap:
    """Return the map that replaces the lost figure 3.1, with walls, gaps and machines."""
    occupied = np.zeros((SIDE, SIDE), dtype=bool)
    occupied[30:34, :50] = True
    occupied[66:70, 50:] = True
    for x, y, width, height in MACHINES:
        occupied[x : x + width, y : y + height] = True
    return occupancy_map(occupied, 1.0)


def rows(printed: dict[str, Printed]) -> list[Row]:
    """Compare every statement in part 3 of the report with the results of chasles."""
    return [*paths(printed), *claims(printed), *arm(printed)]


@cache
def trials() -> SuccessStudy:
    """Return the success rates of path planning on the map.

    The study interprets the paper's step as the largest distance between connected roadmap points.
    """
    return success_study(
        workshop(), START, GOAL, samples=COUNTS, max_steps=(SMALL, LARGE), runs=RUNS
    )


def rate(points: int, step: float) -> float:
    """Return the success rate of path planning for a number of roadmap points and a step.

    `step` is the maximum distance between connected points of the roadmap.
    """
    found = [row for row in trials().rows if (row.samples, row.max_step) == (points, step)]
    return found[0].rate


@cache
def spread_maps(points: int, step: float) -> list[Any]:
    """Return roadmaps whose points are at least one step apart."""
    return [prm(workshop(), points, dispersion=step, rng=key) for key in range(SPREAD_RUNS)]


def spread_rate(points: int, step: float) -> float:
    """Return the success rate if the step is the minimum distance between roadmap points."""
    plans = [own.plan(START, GOAL, algorithm="dijkstra") for own in spread_maps(points, step)]
    return sum(plan.found for plan in plans) / SPREAD_RUNS


def spacing(points: int, step: float) -> float:
    """Return the mean distance of a roadmap point from the nearest other point.

    The argument `step` is the minimum distance between roadmap points.
    """
    found = []
    for own in spread_maps(points, step):
        p = np.asarray(own.q)
        apart = np.linalg.norm(p[:, None] - p[None], axis=-1)
        np.fill_diagonal(apart, np.inf)
        found.append(apart.min(1).mean())
    return float(np.mean(found))


def paths(printed: dict[str, Printed]) -> list[Row]:
    """Compute the success rates of figures 3.2 to 3.4 for two interpretations of the paper's step.

    The step is first the largest distance between connected points, and then the smallest distance
    between points.
    """
    free = 1 - workshop().occupied.mean()
    words = "our copy lacks figure 3.1. Our map contains machines, and walls with gaps"
    found = [assumed(printed["map"], f"{SIDE} x {SIDE} cells, {100 * free:.0f} % free", words)]
    for name, own, reading, runs in (
        ("path", rate, f"{READ} the largest distance between connected points", RUNS),
        ("spread", spread_rate, f"{READ} the smallest distance between points", SPREAD_RUNS),
    ):
        for k, (figure, case) in enumerate(CASES.items()):
            note = (
                f"{reading}. Our value is the success rate of {runs} runs on our map. The text of "
                f"the report describes figure {figure}"
            )
            found.append(lost(printed[f"{name}_{k + 1}"], own(*case), note))
    return found


def claims(printed: dict[str, Printed]) -> list[Row]:
    """Check the conclusions of the report.

    The paper does not define the step of the roadmap. No single definition of the step supports all
    conclusions of the report.
    """
    rates = [rate(points, SMALL) for points in COUNTS]
    rising = all(a <= b for a, b in pairwise(rates)) and rates[0] < rates[-1]
    enough = {step: needed(step) for step in (SMALL, LARGE)}
    seconds = [row.seconds for row in trials().rows if row.max_step == LARGE]
    shares = ", ".join(f"{100 * value:.0f} %" for value in rates)
    points = ", ".join(map(str, COUNTS))
    few = {step: spread_rate(FEW, step) for step in (SMALL, LARGE)}
    apart = {step: spacing(100, step) for step in (SMALL, LARGE)}
    always = " and ".join(f"{100 * value:.0f} % with step {step}" for step, value in few.items())
    return [
        in_one_reading(
            printed["fails"],
            Finding(rising, f"success rates of {shares}"),
            f"{READ} the largest distance between connected points. The rates are for {RUNS} runs "
            f"each with step 10 and {points} points. If we read step 10 as the smallest distance "
            f"between points, {FEW} points are enough: {100 * few[SMALL]:.0f} % of {SPREAD_RUNS} "
            "runs find a path",
        ),
        in_one_reading(
            printed["disperses"],
            Finding(
                apart[LARGE] > apart[SMALL],
                f"points {apart[SMALL]:.0f} and {apart[LARGE]:.0f} cells apart",
            ),
            f"{READ} the smallest distance between points. Our values are for 100 points and steps "
            "10 and 20. If we read the step as the largest distance between connected points, the "
            "layout does not depend on the step. No interpretation of the step supports both the "
            "claim on the layout and the claim on the number of points",
        ),
        in_one_reading(
            printed["fewer"],
            Finding(
                enough[LARGE] < enough[SMALL], f"{enough[LARGE]} points instead of {enough[SMALL]}"
            ),
            f"{READ} the largest distance between connected points. With the stated numbers of "
            f"points, nine of ten runs find a path. If we read the step as the smallest distance "
            f"between points, {FEW} points are enough: of {SPREAD_RUNS} runs, {always} find a path",
        ),
        agrees(
            printed["time"],
            Finding(seconds[0] < seconds[-1], "more time"),
            f"we compared the computation times for {COUNTS[0]} and {COUNTS[-1]} points. In "
            "both roadmaps, points up to the distance 20 are connected",
        ),
    ]


def needed(step: float) -> int:
    """Return the smallest number of roadmap points with which nine of ten runs find a path."""
    return min(points for points in COUNTS if rate(points, step) >= MAX)


@cache
def arm_plan() -> tuple[Any, Plan]:
    """Plan the arm motion from the first to the last via point around a sphere and a table."""
    table = np.eye(4)
    table[2, 3] = -0.06
    obstacles = [sphere(BALL, BALL_RADIUS), box(table, TABLE, "table")]
    space = configuration_space(lynxmotion_arm.low(), obstacles, radius=LINK)
    start, goal = lynxmotion_arm.solutions(lynxmotion_arm.low(), lynxmotion_arm.VIA[[0, -1]])[:, 0]
    plan = prm(space, 150, rng=1).plan(start, goal, algorithm="dijkstra")
    return space, shortcut(space, plan) if plan.found else plan


def arm(printed: dict[str, Printed]) -> list[Row]:
    """Return a table row for a path of the arm that the roadmap planner finds in joint space."""
    space, plan = arm_plan()
    clear = min(space.clearance(q)[0] for q in plan.at(np.linspace(0, 1, 60)))
    words = (
        "the paper plans the path in a plane. Our value is the length of a path in joint space "
        f"from via point 1 to via point 5. The clearance of this path is {1000 * clear:.1f} mm"
    )
    return [not_printed(printed["arm"], plan.length, words)]
