"""Collision-free paths of robots with loops."""

from dataclasses import replace

import numpy as np
import pytest

import chasles

pytest.importorskip("coal", reason="coal comes with pin")

from chasles.study.planning import (
    capsule,
    configuration_space,
    prm,
    rrt_connect,
    shortcut,
    sphere,
)
from chasles.study.planning.loop_bounds import closed_configurations
from tests.campaigns.scenes import drawn, left, planned
from tests.support.waiting import SECONDS


def test_paths_stay_collision_free_at_finer_sampling():
    names = ("five_bar", "excavator", "bricklaying_gantry")
    results = [planned(chasles.load(name), key) for key, name in enumerate(names, 1)]
    assert sum(scene.found for scene in results) >= 2
    assert sum(scene.checked for scene in results) > 2000
    assert not any(scene.touching + scene.open + scene.changed for scene in results)


@pytest.mark.parametrize("name", ["excavator", "slider_crank", "planar_3rrr", "stewart_gough"])
def test_approach_bound_limits_distance_change(name):
    rng, checked = np.random.default_rng(8), 0
    space, _ = drawn(chasles.load(name), rng)
    q, _ = closed_configurations(space.robot, space.lower, space.upper)
    for k in range(6):
        step = rng.normal(size=space.robot.n) * (space.upper - space.lower)
        a = q[k]
        b = np.clip(a + (0.03, 0.003, 0.0003)[k % 3] * step, space.lower, space.upper)
        here = space.distances((a + b) / 2)
        most = space._approach(a, b)
        apart = (here > 0) & np.isfinite(most)
        for part in np.linspace(0, 1, 9):
            there = space.distances(a + part * (b - a))
            assert (here - np.maximum(there, 0) <= most + 1e-6)[apart].all()
            checked += apart.sum()
    assert checked > 80


def around(radius, angles, size, z=0.0):
    """Return spheres on a circle around the origin."""
    return [
        sphere([radius * np.cos(angle), radius * np.sin(angle), z], size, f"ball at {angle:g}")
        for angle in angles
    ]


AMONG = {
    "planar_3rrr": (around(0.15, (0.3, 2.5, 4.6), 0.02), 0.004, 1.0),
    "stewart_gough": (
        [*around(0.25, (0.5, 2.6, 4.7), 0.03, 0.45), capsule([0, 0, 0.66], [0.3, 0, 0.66], 0.02)],
        0.01,
        np.inf,
    ),
}


@pytest.mark.parametrize("name", AMONG)
def test_platform_paths_avoid_obstacles_and_keep_assembly_mode(name):
    """The straight segment from start to goal must be blocked."""
    obstacles, radius, span = AMONG[name]
    robot = chasles.load(name)
    middle, space = (
        np.array(robot.reference.q),
        configuration_space(robot, obstacles, radius=radius),
    )
    lower, upper = np.maximum(space.lower, middle - span), np.minimum(space.upper, middle + span)
    space = replace(space, lower=lower, upper=upper)
    rng, kept = np.random.default_rng(4), []
    q = rng.uniform(lower, upper, (1000, robot.n))
    q = q[np.isfinite(robot.configuration(q)).all(-1)][:240]
    q = q[space.is_free(q)]
    made = prm(space, 40, neighbors=8, rng=2)
    for start, goal in zip(q[::2], q[1::2], strict=False):
        if space.is_free_segment(start, goal):
            continue
        plan = made.plan(start, goal)
        if plan.found:
            kept.append(shortcut(space, plan, attempts=10))
        if len(kept) == 1:
            break
    assert len(kept) == 1
    for path in kept:
        places = path.at(np.linspace(0, 1, 200))
        assert space.is_free(places).all()
        assert left(space, places) == (0, 0)


def test_rrt_connect_finds_collision_free_platform_path():
    pytest.importorskip("ompl")
    obstacles, radius, _ = AMONG["planar_3rrr"]
    robot = chasles.load("planar_3rrr")
    space = configuration_space(robot, obstacles, radius=radius)
    middle = np.array(robot.reference.q)
    q = middle + np.random.default_rng(5).uniform(-0.05, 0.05, (20, robot.n))
    start, goal = q[space.is_free(q)][:2]
    plan = rrt_connect(space, start, goal, time_limit=SECONDS, rng=3)
    assert plan.found, plan.reason
    assert left(space, plan.at(np.linspace(0, 1, 500))) == (0, 0)


def test_open_loop_blocks_segment():
    space, q = drawn(chasles.load("excavator"), np.random.default_rng(9))
    open_q = q[0].copy()
    open_q[1:] += 100  # no loop closes with hydraulic cylinders of this length
    assert np.isinf(space._approach(q[0], open_q)).all()
    assert not space.is_free_segment(q[0], open_q)
