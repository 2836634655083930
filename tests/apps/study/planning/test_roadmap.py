"""Roadmaps on grid maps contain exact edges and no invalid path."""

import numpy as np
import pytest

from chasles.errors import InputValueError, ShapeError
from chasles.study.planning import (
    occupancy_map,
    prm,
    rrt_connect,
    shortcut,
    success_study,
)
from chasles.study.planning.success_study import wilson
from tests.support.waiting import SECONDS

SIDE = 0.1


def passage(width=2):
    """Return two rooms of 20 by 40 cells that a passage connects."""
    occupied = np.zeros((41, 40), dtype=bool)
    occupied[20] = True
    occupied[20, 10 : 10 + width] = False
    return occupancy_map(occupied, SIDE)


START, GOAL = (0.25, 3.0), (3.85, 3.0)


def random_map(rng):
    return occupancy_map(rng.random((30, 30)) < 0.1, SIDE, rng.uniform(-1, 1, 2))


def test_free_segment_check_agrees_with_fine_sampling():
    rng = np.random.default_rng(1)
    free = 0
    for _ in range(80):
        space = random_map(rng)
        a, b = rng.uniform(space.lower, space.upper, (2, 2))
        points = a + np.linspace(0, 1, 5001)[:, None] * (b - a)
        sampled = space.is_free(points).all()
        found = space.is_free_segment(a, b)
        assert sampled or not found
        free += found
        if sampled and not found:
            finer = a + np.linspace(0, 1, 2_000_001)[:, None] * (b - a)
            assert not space.is_free(finer).all()
    assert free > 2


def test_narrow_passage_plans_are_free_and_shortcuts_never_longer():
    space = passage()
    found = 0
    for key in range(4):
        plan = prm(space, 300, rng=key).plan(START, GOAL)
        if not plan.found:
            assert "parts of the roadmap" in plan.reason or "no free edge" in plan.reason
            assert len(plan.q) == 0
            continue
        found += 1
        for better in (plan, shortcut(space, plan, rng=key)):
            assert space.is_free(better.at(np.linspace(0, 1, 5001))).all()
            np.testing.assert_array_equal(better.q[[0, -1]], [START, GOAL])
            assert better.length <= plan.length * (1 + 1e-12)
    assert found >= 2


def test_astar_and_dijkstra_find_equal_length():
    space = passage(4)
    for key in range(2):
        made = prm(space, 200, rng=key)
        lengths = [
            made.plan(START, GOAL, algorithm=algorithm).length
            for algorithm in ("astar", "dijkstra")
        ]
        assert lengths[0] == pytest.approx(lengths[1]) or not np.isfinite(lengths).any()


def test_step_and_dispersion_limit_point_distances():
    space = passage()
    near = prm(space, 150, max_step=0.4)
    edges = near.q[near.edges]
    assert np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1).max() <= 0.4
    spread = prm(space, 150, dispersion=0.3)
    apart = np.linalg.norm(spread.q[:, None] - spread.q, axis=-1) + np.eye(len(spread.q))
    assert apart.min() >= 0.3
    assert 40 < len(spread.q) < 150


def test_same_rng_gives_same_roadmap():
    space = passage()
    one, two, other = (prm(space, 100, rng=key) for key in (5, 5, 6))
    assert np.array_equal(one.q, two.q)
    assert np.array_equal(one.edges, two.edges)
    assert not np.array_equal(one.q, other.q)


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ((2.05, 3.0), GOAL, r"the start is not free: \(2\.05, 3\) m is occupied"),
        (START, (9.0, 1.0), r"the goal is not free: \(9, 1\) m is outside the map"),
    ],
    ids=["occupied start", "goal outside map"],
)
def test_occupied_start_or_goal_is_explained(start, goal, reason):
    plan = prm(passage(), 50).plan(start, goal)
    assert not plan.found
    assert np.isinf(plan.length)
    with pytest.raises(InputValueError, match=reason):
        plan.at(0.5)


def test_disconnected_roadmap_is_explained():
    plan = prm(passage(0), 300).plan(START, GOAL)
    assert plan.reason == "start and goal lie in different parts of the roadmap, which has 2 parts"


def test_success_rate_grows_with_samples_and_step():
    counts, steps = (30, 300), (0.5, np.inf)
    found = success_study(passage(), START, GOAL, samples=counts, max_steps=steps, runs=4)
    rates = {(row.samples, row.max_step): row.rate for row in found.rows}
    assert len(rates) == 4
    assert rates[300, np.inf] > rates[30, 0.5]
    assert all(row.lower <= row.rate <= row.upper for row in found.rows)


def test_wilson_interval_matches_scipy():
    from scipy.stats import binomtest

    for successes in (0, 1, 7, 15, 29, 30):
        expected = binomtest(successes, 30).proportion_ci(method="wilson")
        np.testing.assert_allclose(wilson(successes, 30), expected, atol=1e-12)


def test_rrt_connect_finds_free_path_or_explains_failure():
    pytest.importorskip("ompl")
    space = passage(1)
    plan = rrt_connect(space, START, GOAL, time_limit=SECONDS)
    assert plan.found, plan.reason
    assert space.is_free(plan.at(np.linspace(0, 1, 50001))).all()
    assert rrt_connect(space, (2.05, 3.0), GOAL).reason.startswith("the start is not free")
    blocked = rrt_connect(passage(0), START, GOAL, time_limit=0.2)
    assert blocked.reason == "no path was found in 0.2 s"


def test_invalid_roadmap_arguments_are_rejected():
    with pytest.raises(
        InputValueError, match="prm: samples = 0: expected an integer of at least 1"
    ):
        prm(passage(), 0)
    with pytest.raises(ShapeError, match=r"start: expected \(2,\), got shape \(3,\)"):
        prm(passage(), 10).plan((0, 0, 0), GOAL)
    with pytest.raises(InputValueError, match="expected dijkstra or astar, got 'bfs'"):
        prm(passage(), 10).plan(START, GOAL, algorithm="bfs")
