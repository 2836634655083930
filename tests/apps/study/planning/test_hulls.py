"""Collision shapes agree with drawings and equations. Motion bounds hold."""

import numpy as np
import pytest

import chasles
from chasles.drawing import skeleton
from chasles.study.planning.hulls import hulls_of

ROBOTS = (
    *("ur5e", "panda", "scara", "stanford", "irb6640", "puma560", "lynxmotion"),
    *("excavator", "well_manipulator", "board_installer", "bricklaying_gantry"),
    *("five_bar", "four_bar", "slider_crank", "planar_3rrr", "stewart_gough", "delta"),
)
DRAWN = ("link", "plate", "guide", "ram", "carriage", "rod")


def closed(robot, rng, count):
    """Return configurations (count, n) and all their joint variables."""
    lower = np.where(np.isfinite(robot.lower), robot.lower, -np.pi)
    upper = np.where(np.isfinite(robot.upper), robot.upper, np.pi)
    q = rng.uniform(lower, upper, (60 * count, robot.n))
    z = robot.configuration(q) if robot.loops else q
    kept = np.flatnonzero(np.isfinite(z).all(-1))[:count]
    assert len(kept) == count
    return q[kept], z[kept]


def to_segment(p, a, b):
    way = b - a
    part = np.clip((p - a) @ way / max(way @ way, 1e-300), 0, 1)
    return np.linalg.norm(p - a - part * way)


@pytest.mark.parametrize("name", ROBOTS)
def test_collision_shapes_match_drawn_skeleton(name):
    robot = chasles.load(name)
    hulls, bones, checked = hulls_of(robot), skeleton(robot), 0
    joints_on_ground = sum(
        body.parent == 0 or (body.span is not None and 0 in body.span.bodies)
        for body in bones.bodies
    )
    for q, z in zip(*closed(robot, np.random.default_rng(1), 2), strict=True):
        poses, own = bones.poses(q), {}
        for hull, points in zip(hulls.hulls, hulls.corners(z), strict=True):
            own.setdefault(hull.part, []).append(points)
        for k, (body, T) in enumerate(zip(bones.bodies, poses, strict=True)):
            if k == 0 and joints_on_ground > 1:
                continue
            for shape in body.shapes:
                drawn = np.array(shape.points) @ T[:3, :3].T + T[:3, 3]
                if shape.kind in DRAWN:
                    corners = np.concatenate(own[body.span.name if body.span else body.name])
                    apart = np.linalg.norm(drawn[:, None] - corners, axis=-1).min(1)
                    assert apart.max() < 1e-5 * bones.size
                    checked += 1
                elif shape.kind in ("barrel", "piston"):
                    ends = own[body.span.name][0]
                    end = drawn[0] if shape.kind == "barrel" else drawn[1]
                    assert np.linalg.norm(end - ends[int(shape.kind == "piston")]) < 1e-9
                    away = np.cross(drawn[1] - drawn[0], ends[1] - ends[0])
                    assert np.linalg.norm(away) < 1e-9
                    checked += 1
    assert checked >= 4


@pytest.mark.parametrize("name", [name for name in ROBOTS if name != "bricklaying_gantry"])
def test_tool_lies_on_a_collision_shape(name):
    robot = chasles.load(name)
    hulls = hulls_of(robot)
    for q, z in zip(*closed(robot, np.random.default_rng(2), 2), strict=True):
        tool = robot.fk(q)[:3, 3]
        corners = hulls.corners(z)
        near = min(to_segment(tool, a, b) for own in corners for a in own for b in own)
        assert near < 0.05 * hulls.skeleton.size


def test_hexapod_leg_shapes_match_rod_equations():
    robot = chasles.load("stewart_gough")
    hulls = hulls_of(robot)
    legs = [k for k, hull in enumerate(hulls.hulls) if hull.is_strut]
    assert [hulls.hulls[k].part for k in legs] == [f"leg_{i}" for i in range(1, 7)]
    for q, z in zip(*closed(robot, np.random.default_rng(3), 20), strict=True):
        T, corners = robot.fk(q), hulls.corners(z)
        platform = next(
            c for c, h in zip(corners, hulls.hulls, strict=True) if h.part == "platform"
        )
        ways = np.array([corners[k][1] - corners[k][0] for k in legs])
        a, length = robot.functions["rod_ends"](q)[:2]
        np.testing.assert_allclose(np.linalg.norm(ways, axis=1), length, atol=1e-12)
        np.testing.assert_allclose(hulls.poses(z[None])[1][0, legs], length, atol=1e-12)
        tops = np.array([corners[k][1] for k in legs])
        apart = np.linalg.norm(tops[:, None] - platform, axis=-1).min(1)
        assert apart.max() < 1e-7
        back = (tops - T[:3, 3]) @ T[:3, :3]
        np.testing.assert_allclose(back[:, 2], 0, atol=1e-12)
        assert a.shape == (6, 3)


def test_planar_platform_leg_shapes_match_hand_calculation():
    robot = chasles.load("planar_3rrr")
    hulls = hulls_of(robot)
    for q, z in zip(*closed(robot, np.random.default_rng(4), 20), strict=True):
        own = dict(zip((h.part for h in hulls.hulls), hulls.corners(z), strict=True))
        for k in (1, 2, 3):
            pivot, elbow = own[f"crank_{k}"]
            way = elbow - pivot
            np.testing.assert_allclose(
                way, 0.17 * np.array([np.cos(q[k - 1]), np.sin(q[k - 1]), 0])
            )
            rod = own[f"coupler_{k}"]
            np.testing.assert_allclose(rod[0], elbow, atol=1e-12)
            assert np.linalg.norm(rod[1] - rod[0]) == pytest.approx(0.13)


@pytest.mark.parametrize("name", ["ur5e", "stanford", "excavator", "slider_crank", "stewart_gough"])
def test_corner_motion_stays_within_bound(name):
    robot = chasles.load(name)
    hulls, rng = hulls_of(robot), np.random.default_rng(5)
    tight = []
    for size in (0.01, 0.1, 0.5):
        for _, z in zip(*closed(robot, rng, 4), strict=True):
            w = rng.uniform(0, size, len(z))
            here, most = hulls.corners(z), hulls.moves(z, w)[0]
            far = np.zeros(len(here))
            for _ in range(60):
                there = hulls.corners(z + rng.choice([-1, 1], len(z)) * w)
                moved = [
                    np.linalg.norm(b - a, axis=1).max() for a, b in zip(here, there, strict=True)
                ]
                far = np.maximum(far, moved)
            assert (far <= most + 1e-12).all()
            tight.append(np.max(most) / max(np.max(far), 1e-12))
    assert np.median(tight) < 4


@pytest.mark.parametrize("name", ["ur5e", "excavator", "well_manipulator"])
def test_distance_bound_ignores_common_motion(name):
    robot = chasles.load(name)
    hulls, rng, checked = hulls_of(robot), np.random.default_rng(6), 0
    for _, z in zip(*closed(robot, rng, 6), strict=True):
        w = rng.uniform(0, 0.2, len(z))
        most, here = hulls.moves(z, w), hulls.corners(z)
        there = hulls.corners(z + rng.uniform(-1, 1, len(z)) * w)
        for i in range(len(here)):
            for j in range(i):
                common = hulls.common(i, j)
                apart = np.linalg.norm(here[i][:, None] - here[j], axis=-1)
                after = np.linalg.norm(there[i][:, None] - there[j], axis=-1)
                change = np.abs(after - apart).max()
                assert change <= most[common, i] + most[common, j] + 1e-12
                checked += most[common, i] < 0.99 * most[0, i]
    assert checked > 20


def test_motion_bound_uses_lever_arms_of_center_configuration():
    """In the folded configuration, the tool is near axis 1."""
    robot = chasles.load("scara")
    hulls, q = hulls_of(robot), np.array([0.0, 2.5, 0.1, 0.0])
    tool = robot.fk(q)[:3, 3]
    elbow = robot.link_poses(q)[0, :3, 3]
    for angle in (0.5, 1.5, 2.5):
        most = hulls.moves(q, np.array([angle, angle, 0, 0]))[0]
        levers = np.linalg.norm(tool[:2]) + np.linalg.norm((tool - elbow)[:2])
        assert most[-1] == pytest.approx(angle * levers, rel=1e-9)
        far = 0.0
        for first in np.linspace(-angle, angle, 31):
            for second in np.linspace(-angle, angle, 31):
                there = robot.fk(q + np.array([first, second, 0, 0]))[:3, 3]
                far = max(far, np.linalg.norm(there - tool))
        assert 0.3 * most[-1] < far <= most[-1]
