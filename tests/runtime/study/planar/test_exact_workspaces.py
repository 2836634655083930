"""Exact sections against dense samples, integrals on grids, and workspaces by optimisation."""

import math

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study import ExactWorkspace, exact_workspace, workspace
from chasles.study.planar.annuli import BorderArc
from chasles.study.planar.arc_regions import ArcRegion, swept

NEAR = 0.01
"""Distance [m] from the border from which a place is reached in more than single postures."""


def chains(count, seed=0):
    """Random planar chains with limits, some with joints that turn freely."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        n = 2 + k % 3
        lengths, lower = rng.uniform(0.2, 1, n), rng.uniform(-3, 1, n)
        upper = lower + rng.uniform(0.3, 4, n)
        if k % 5 == 4:
            lower[k % n], upper[k % n] = -np.pi, np.pi
        yield lengths, lower, upper


def region_of(lengths, lower, upper):
    found = ArcRegion((BorderArc(np.array([lengths.sum(), 0.0]), 0.0, 0.0, 0.0),), solid=False)
    for j in reversed(range(len(lengths))):
        axis = np.array([lengths[:j].sum(), 0.0])
        found = swept(found, axis, lower[j], upper[j])
    return found


def place(lengths, q):
    turn = np.cumsum(q, axis=-1)
    return np.stack([(lengths * np.cos(turn)).sum(-1), (lengths * np.sin(turn)).sum(-1)], -1)


def sampled(lengths, lower, upper, rng, count=20_000):
    """Postures; in half of them some joints are at their limits."""
    shape = (count, len(lengths))
    ends = np.where(rng.random(shape) < 0.5, lower, upper)
    at_end = (rng.random(shape) < 0.4) & (np.arange(count) % 2 == 0)[:, None]
    return np.where(at_end, ends, rng.uniform(lower, upper, shape))


def reached(chain, target, rng):
    """Whether the last two joints reach a place, in closed form, for some values of the others."""
    lengths, lower, upper = chain
    q = rng.uniform(lower[:-2], upper[:-2], (1 if len(lower) == 2 else 20_000, len(lower) - 2))
    turn = q.sum(1)
    x, y = (target - place(lengths[:-2], q)).T
    x, y = np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x
    a, b = lengths[-2:]
    cosine = (x * x + y * y - a * a - b * b) / (2 * a * b)
    found = False
    for elbow in (np.arccos(np.clip(cosine, -1, 1)), -np.arccos(np.clip(cosine, -1, 1))):
        shoulder = np.arctan2(y, x) - np.arctan2(b * np.sin(elbow), a + b * np.cos(elbow))
        fits = np.abs(cosine) <= 1
        for joint, least, most in zip((shoulder, elbow), lower[-2:], upper[-2:], strict=True):
            fits &= (joint - least) % (2 * np.pi) <= most - least
        found |= fits.any()
    return found


def from_border(region, points):
    """Distances of points from the border."""
    least = np.full(len(points), np.inf)
    for arc in region.arcs:
        x, y = (points - arc.centre).T
        start, end = sorted((arc.start, arc.end))
        on_arc = (np.arctan2(y, x) - start) % (2 * np.pi) <= end - start
        least = np.where(on_arc, np.minimum(least, np.abs(np.hypot(x, y) - arc.radius)), least)
        for angle in (start, end):
            corner = arc.centre + arc.radius * np.array([math.cos(angle), math.sin(angle)])
            least = np.minimum(least, np.linalg.norm(points - corner, axis=1))
    return least


def test_sections_of_random_chains_against_samples():
    rng, checked = np.random.default_rng(1), 0
    for chain in chains(12):
        region = region_of(*chain)
        postures = sampled(*chain, rng)
        places = place(chain[0], postures)
        outside = places[~region.contains(places)]
        assert not len(outside) or from_border(region, outside).max() < 1e-9
        least, most = region.extents
        asked = rng.uniform(least, most, (60, 2))
        asked = asked[from_border(region, asked) > NEAR]
        inside = region.contains(asked)
        assert [reached(chain, target, rng) for target in asked] == inside.tolist()
        # The border is closed: its arcs lead from each one's end to another one's start.
        ends = [np.array([math.cos(a.end), math.sin(a.end)]) * a.radius for a in region.arcs]
        starts = [np.array([math.cos(a.start), math.sin(a.start)]) * a.radius for a in region.arcs]
        np.testing.assert_allclose(np.sum(ends, axis=0), np.sum(starts, axis=0), atol=1e-9)
        checked += len(asked)
    assert checked > 500


def test_two_links_have_the_textbook_area():
    rng = np.random.default_rng(2)
    for _ in range(100):
        a, b = rng.uniform(0.1, 1, 2)
        turn, elbow = rng.uniform(0.1, 3), np.sort(rng.uniform(0, np.pi, 2))
        region = region_of(np.array([a, b]), np.array([0, elbow[0]]), np.array([turn, elbow[1]]))
        # In polar coordinates r dr = a b sin(elbow) d elbow, and every radius spans the same turn.
        exact = turn * a * b * (math.cos(elbow[0]) - math.cos(elbow[1]))
        assert region.area == pytest.approx(exact, rel=1e-9)
    whole = region_of(np.array([0.7, 0.4]), np.full(2, -np.pi), np.full(2, np.pi))
    assert whole.area == pytest.approx(np.pi * (1.1**2 - 0.3**2), rel=1e-12)


def test_bodies_of_revolution_against_grids():
    rng, checked = np.random.default_rng(3), 0
    for chain in chains(6, seed=5):
        section = region_of(*chain)
        turn = np.array([0, rng.uniform(0.5, 7)]) + rng.uniform(-3, 3)
        body = ExactWorkspace("", section, np.zeros(3), np.eye(3)[[0, 2]], turn, np.zeros(2))
        r, z = np.abs(section.extents[:, 0]).max(), section.extents[:, 1]
        points = rng.uniform([-r, -r, z[0]], [r, r, z[1]], (20_000, 3))
        radius = np.hypot(points[:, 0], points[:, 1])
        angle = np.arctan2(points[:, 1], points[:, 0])
        inside = np.zeros(len(points), dtype=bool)
        for sign in (1, -1):
            turned = (angle + (sign < 0) * np.pi - turn[0]) % (2 * np.pi) <= np.ptp(turn)
            inside |= turned & section.contains(np.column_stack([sign * radius, points[:, 2]]))
        box = (2 * r) ** 2 * np.ptp(z)
        error = box * inside.std() / math.sqrt(len(points))
        assert body.volume == pytest.approx(box * inside.mean(), abs=4 * error)
        found = points[inside]
        assert (found.min(0) >= body.extents[0] - 1e-12).all()
        assert (found.max(0) <= body.extents[1] + 1e-12).all()
        checked += 1
    assert checked == 6


@pytest.mark.parametrize("name", ["lynxmotion", "scara", "bricklaying_planar"])
def test_robots_against_samples(name):
    robot = chasles.load(name)
    exact = exact_workspace(robot)
    found = workspace(robot, 100_000, finest=30, threads=1)
    np.testing.assert_allclose(exact.extents, found.extents, atol=1e-9)
    size = exact.volume or exact.area
    assert abs(size - found.measure.value) < found.measure.error


def test_the_teaching_arm_of_the_paper():
    extents = exact_workspace(chasles.load("lynxmotion")).extents
    np.testing.assert_allclose(extents[1], [0.28660254, 0.28660254, 0.4], atol=5e-9)
    np.testing.assert_allclose(extents[0], [-0.28660254, -0.28660254, -0.05], atol=5e-9)


def test_arms_of_other_kinds():
    with pytest.raises(InputValueError, match="ur5e: expected parallel axes, or a vertical first"):
        exact_workspace(chasles.load("ur5e"))
    with pytest.raises(InputValueError, match="takes serial arms, this has loops"):
        exact_workspace(chasles.load("five_bar"))


def test_picture():
    pytest.importorskip("matplotlib").use("Agg")
    axes = exact_workspace(chasles.load("lynxmotion")).plot()
    assert axes.get_xlabel() == "r [m]"
    assert "m³" in axes.get_title()
