"""Exact planar workspaces agree with samples, integrals and bounds."""

import math

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study import ExactWorkspace, exact_workspace, workspace
from chasles.study.planar.annuli import BorderArc
from chasles.study.planar.arc_regions import ArcRegion, swept
from chasles.study.planar.meridian import meridian, swept_volume

NEAR = 0.01
"""Minimum distance [m] of a compared point from the workspace boundary. Many configurations reach a
point that is far from the border."""


def chains(count, seed=0):
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
    """Sample configurations, half of them with joints at limits."""
    shape = (count, len(lengths))
    ends = np.where(rng.random(shape) < 0.5, lower, upper)
    at_end = (rng.random(shape) < 0.4) & (np.arange(count) % 2 == 0)[:, None]
    return np.where(at_end, ends, rng.uniform(lower, upper, shape))


def reached(chain, target, rng):
    """Test in closed form whether two joints reach a point."""
    lengths, lower, upper = chain
    q = rng.uniform(lower[:-2], upper[:-2], (1 if len(lower) == 2 else 10_000, len(lower) - 2))
    if len(lower) == 3:
        q = np.linspace(lower[:1], upper[:1], 2_000)
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
    least = np.full(len(points), np.inf)
    for arc in region.arcs:
        x, y = (points - arc.center).T
        start, end = sorted((arc.start, arc.end))
        on_arc = (np.arctan2(y, x) - start) % (2 * np.pi) <= end - start
        least = np.where(on_arc, np.minimum(least, np.abs(np.hypot(x, y) - arc.radius)), least)
        for angle in (start, end):
            corner = arc.center + arc.radius * np.array([math.cos(angle), math.sin(angle)])
            least = np.minimum(least, np.linalg.norm(points - corner, axis=1))
    return least


def test_planar_sections_match_sampled_reachability():
    rng, checked = np.random.default_rng(1), 0
    for chain in chains(5):
        region = region_of(*chain)
        configurations = sampled(*chain, rng)
        places = place(chain[0], configurations)
        outside = places[~region.contains(places)]
        assert not len(outside) or from_border(region, outside).max() < 1e-9
        least, most = region.bounds
        asked = rng.uniform(least, most, (30, 2))
        asked = asked[from_border(region, asked) > NEAR]
        inside = region.contains(asked)
        assert [reached(chain, target, rng) for target in asked] == inside.tolist()
        # The boundary is closed: each arc ends at the start of another arc.
        ends = [np.array([math.cos(a.end), math.sin(a.end)]) * a.radius for a in region.arcs]
        starts = [np.array([math.cos(a.start), math.sin(a.start)]) * a.radius for a in region.arcs]
        np.testing.assert_allclose(np.sum(ends, axis=0), np.sum(starts, axis=0), atol=1e-9)
        checked += len(asked)
    assert checked > 100


def test_two_link_workspace_area_matches_formula():
    rng = np.random.default_rng(2)
    for _ in range(20):
        a, b = rng.uniform(0.1, 1, 2)
        turn, elbow = rng.uniform(0.1, 3), np.sort(rng.uniform(0, np.pi, 2))
        region = region_of(np.array([a, b]), np.array([0, elbow[0]]), np.array([turn, elbow[1]]))
        # In polar coordinates, r dr = a b sin(elbow) d elbow for link lengths a and b. At every
        # radius, the region covers the angle `turn`.
        exact = turn * a * b * (math.cos(elbow[0]) - math.cos(elbow[1]))
        assert region.area == pytest.approx(exact, rel=1e-9)
    whole = region_of(np.array([0.7, 0.4]), np.full(2, -np.pi), np.full(2, np.pi))
    assert whole.area == pytest.approx(np.pi * (1.1**2 - 0.3**2), rel=1e-12)


def body_of(chain, offset, turn):
    axes = np.eye(3)[[0, 2]]
    return ExactWorkspace(
        "", "tool", (), region_of(*chain), np.zeros(3), axes, offset, turn, np.zeros(2)
    )


def test_revolved_workspace_volume_matches_monte_carlo():
    """The section planes are offset to both sides of the axis of revolution."""
    rng, checked = np.random.default_rng(3), 0
    for k, chain in enumerate(chains(3, seed=5)):
        turn = np.array([0, rng.uniform(*[(0.5, 3), (3.3, 6.2), (6.3, 7)][k % 3])])
        turn += rng.uniform(-3, 3)
        body = body_of(chain, rng.uniform(-0.6, 0.6) * (k % 4 > 0), turn)
        low, high = body.bounds
        points = rng.uniform(low - 0.01, high + 0.01, (10_000, 3))
        rho, angle = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
        inside = np.zeros(len(points), dtype=bool)
        for sign in (1, -1):
            u = sign * np.sqrt(np.maximum(rho**2 - body.offset**2, 0))
            turned = (angle - np.arctan2(-body.offset, u) - turn[0]) % (2 * np.pi)
            there = (rho >= abs(body.offset)) & (turned <= np.ptp(turn))
            inside |= there & body.section.contains(np.column_stack([u, points[:, 2]]))
        box = np.prod(high - low + 0.02)
        error = box * inside.std() / math.sqrt(len(points))
        assert body.volume == pytest.approx(box * inside.mean(), abs=4 * error)
        found = points[inside]
        assert (found.min(0) >= low - 1e-12).all()
        assert (found.max(0) <= high + 1e-12).all()
        assert (np.ptp(found, 0) > 0.6 * (high - low)).all()
        section = body.meridian
        assert section.contains(np.column_stack([rho, points[:, 2]])[inside]).all()
        (rho_0, z_0), (rho_1, z_1) = section.bounds
        assert (rho[inside] >= rho_0 - 1e-12).all()
        assert (rho[inside] <= rho_1 + 1e-12).all()
        asked = rng.uniform([rho_0, z_0], [rho_1, z_1], (10_000, 2))
        hit, size = section.contains(asked), (rho_1 - rho_0) * (z_1 - z_0)
        error = size * hit.std() / math.sqrt(len(asked))
        assert section.area == pytest.approx(size * hit.mean(), abs=4 * error)
        checked += 1
    assert checked == 3


def test_swept_disc_volume_matches_pappus_theorem():
    """Pappus' theorem gives the volume that a disc sweeps."""
    for offset in (0.0, 0.3):
        disc = ArcRegion((BorderArc(np.array([2.0, 0.0]), 0.5, 0.0, 2 * np.pi),))
        whole = 2 * np.pi * 2.0 * np.pi * 0.25
        for turn in (0.7, 3.0, 5.0, 2 * np.pi, 9.0):
            made = swept_volume(disc, offset, turn)
            assert made == pytest.approx(whole * min(turn / (2 * np.pi), 1), rel=1e-12)
    # In a full turn, both halves of the disc sweep equal regions.
    middle = ArcRegion((BorderArc(np.zeros(2), 0.5, 0.0, 2 * np.pi),))
    near = meridian(middle, 0.3).contains(np.array([[0.29, 0.0], [0.31, 0.0], [0.31, 0.51]]))
    assert near.tolist() == [False, True, False]
    both = [swept_volume(middle, 0.3, turn) for turn in (np.pi - 1e-9, np.pi, np.pi + 1e-9)]
    np.testing.assert_allclose(both, both[1], rtol=1e-8)
    assert swept_volume(middle, 0.3, 2 * np.pi) == pytest.approx(4 / 3 * np.pi * 0.5**3)
    assert swept_volume(middle, 0.3, 2 * np.pi - 1e-9) == pytest.approx(4 / 3 * np.pi * 0.5**3)


def meeting(robot, q, k):
    """Fit a point that is fixed on both link k and link k + 2, and return its positions."""
    poses = robot.link_poses(q)
    near, far = poses[:, k - 1], poses[:, k + 1]
    few = slice(0, 200)
    rows = np.concatenate([near[few, :3, :3], -far[few, :3, :3]], axis=-1).reshape(-1, 6)
    step = (far - near)[few, :3, 3].ravel()
    own, _, rank, _ = np.linalg.lstsq(rows, step, rcond=None)
    assert rank == 6
    assert np.abs(rows @ own - step).max() < 1e-10
    return (near[:, :3, :3] @ own[:3]) + near[:, :3, 3]


@pytest.mark.parametrize("name", ["ur5e", "irb6640"])
def test_wrist_workspace_matches_samples(name):
    beyond, empty = check_wrist(chasles.load(name), 30_000)
    assert beyond < 1e-9
    assert empty < 0.01


def check_wrist(robot, count):
    """Compare the workspace with sampled configurations.

    Returns:
        Largest distance of samples outside the workspace [m], and fraction of inner cells without a
        sample.
    """
    exact = exact_workspace(robot, point="wrist")
    rng = np.random.default_rng(8)
    free = ~np.isfinite(robot.upper)
    low, high = np.where(free, -np.pi, robot.lower), np.where(free, np.pi, robot.upper)
    q = rng.uniform(low, high, (count, robot.n))
    ends = rng.random(q.shape) < 0.2
    q = np.where(ends, np.where(rng.random(q.shape) < 0.5, low, high), q)
    p = meeting(robot, q, len(exact.joints))
    rho, z = np.hypot(p[:, 0] - exact.origin[0], p[:, 1] - exact.origin[1]), p[:, 2]
    points = np.column_stack([rho, z])
    outside = points[~exact.meridian.contains(points)]
    beyond = 0.0
    if len(outside):
        u = np.sqrt(np.maximum(outside[:, 0] ** 2 - exact.offset**2, 0))
        places = np.column_stack([u, outside[:, 1]])
        beyond = from_border(exact.meridian.both, places).max()
    low, high = exact.bounds
    assert (p >= low - 1e-9).all()
    assert (p <= high + 1e-9).all()
    sides, low, high = int(math.sqrt(count) / 8), *exact.meridian.bounds
    edges = np.linspace(low, high, sides + 1).T
    hits = np.histogram2d(*points.T, bins=edges)[0]
    corners = np.stack(np.meshgrid(*edges, indexing="ij"), -1)
    within = exact.meridian.contains(corners.reshape(-1, 2)).reshape(corners.shape[:2])
    inner = within[1:, 1:] & within[:-1, 1:] & within[1:, :-1] & within[:-1, :-1]
    assert inner.sum() > 0.2 * inner.size
    return beyond, (hits[inner] == 0).mean()


@pytest.mark.parametrize("name", ["lynxmotion", "scara", "bricklaying_planar", "puma560"])
def test_exact_workspace_matches_sampled_workspace(name):
    robot = chasles.load(name)
    exact = exact_workspace(robot)
    found = workspace(robot, 100_000, resolution=30, threads=1)
    np.testing.assert_allclose(exact.bounds, found.bounds, atol=1e-9)
    size = exact.volume or exact.area
    assert abs(size - found.size.value) < found.size.error


def test_teaching_arm_bounds_match_paper():
    bounds = exact_workspace(chasles.load("lynxmotion")).bounds
    np.testing.assert_allclose(bounds[1], [0.28660254, 0.28660254, 0.4], atol=5e-9)
    np.testing.assert_allclose(bounds[0], [-0.28660254, -0.28660254, -0.05], atol=5e-9)


def test_unsupported_arms_are_rejected_with_reason():
    with pytest.raises(
        InputValueError,
        match="ur5e: tool: the boundary does not consist of arcs, because the axes that move this "
        "point are neither par",
    ):
        exact_workspace(chasles.load("ur5e"))
    with pytest.raises(
        InputValueError,
        match="iiwa14: wrist: the boundary does not consist of arcs, because the axes that move "
        "this point are neither par",
    ):
        exact_workspace(chasles.load("iiwa14"), point="wrist")
    with pytest.raises(InputValueError, match="expected point 'tool' or 'wrist', got 'elbow'"):
        exact_workspace(chasles.load("ur5e"), point="elbow")
    with pytest.raises(InputValueError, match="scara: the workspace is planar"):
        assert exact_workspace(chasles.load("scara")).meridian
    with pytest.raises(InputValueError, match="requires a serial arm, got loops"):
        exact_workspace(chasles.load("five_bar"))


def test_workspace_plot_shows_closed_border():
    pytest.importorskip("matplotlib").use("Agg")
    axes = exact_workspace(chasles.load("lynxmotion")).plot()
    assert axes.get_xlabel() == "distance from the first axis [m]"
    assert "m³" in axes.get_title()
    of_wrist = exact_workspace(chasles.load("puma560"), point="wrist")
    curves = [line.get_xydata() for line in of_wrist.plot().lines]
    drawn = np.concatenate(curves)
    assert drawn[:, 0].min() >= 0.15 - 1e-12  # shoulder offset
    # The boundary of the wrist positions is closed by two straight lines at the shoulder offset.
    assert sum(len(curve) == 2 for curve in curves) >= 2
    ends = np.array([end for curve in curves for end in curve[[0, -1]]])
    apart = np.linalg.norm(ends[:, None] - ends, axis=-1) + 9 * np.eye(len(ends))
    assert apart.min(1).max() < 1e-9
    np.testing.assert_allclose(drawn[:, 0].max(), of_wrist.meridian.bounds[1, 0], atol=1e-3)
