"""Paths of robots with loops, close to obstacles, at ten times as many places as were asked."""

import numpy as np
import pytest

import chasles

pytest.importorskip("coal", reason="coal comes with pin")

from bench.measures.scenes import ROBOTS, drawn, scenes


def test_no_path_touches_when_checked_finer():
    results = list(scenes(8, key=7))
    assert {scene.robot for scene in results} == set(ROBOTS)
    assert sum(scene.found for scene in results) >= 4
    assert sum(scene.checked for scene in results) > 4000
    assert not any(scene.touching for scene in results)


@pytest.mark.parametrize("name", ROBOTS)
def test_ways_approach_no_further_than_stated(name):
    rng, checked = np.random.default_rng(8), 0
    space, _ = drawn(chasles.load(name), rng)
    for _ in range(15):
        a = rng.uniform(space.lower, space.upper)
        b = np.clip(
            a + rng.normal(size=len(a)) * 0.03 * np.ptp([space.lower, space.upper], 0),
            space.lower,
            space.upper,
        )
        here = space.distances((a + b) / 2)
        most = space.approach(a, b)
        apart = (here > 0) & np.isfinite(most)
        for part in np.linspace(0, 1, 17):
            there = space.distances(a + part * (b - a))
            assert (here - np.maximum(there, 0) <= most + 1e-6)[apart].all()
            checked += apart.sum()
    assert checked > 200


def test_an_open_loop_blocks_a_way():
    space, q = drawn(chasles.load("excavator"), np.random.default_rng(9))
    open_q = q[0].copy()
    open_q[1:] += 100  # no triangle has such a side
    assert np.isinf(space.approach(q[0], open_q)).all()
    assert not space.free_way(q[0], open_q)
