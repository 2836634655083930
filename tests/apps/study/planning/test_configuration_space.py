"""Robots among obstacles: free segments, distances and failure reasons."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError, ShapeError
from chasles.study.planning import (
    box,
    capsule,
    configuration_space,
    mesh,
    prm,
    rrt_connect,
    shortcut,
    sphere,
)
from tests.support.waiting import SECONDS

pytest.importorskip("coal", reason="coal comes with pin")


def place(x, y, z):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


OBSTACLES = (
    sphere([0.4, 0.3, 0.5], 0.1, "sphere"),
    box(place(0, 0, -0.2), [2, 2, 0.1], "table"),
    capsule([-0.5, 0.4, 0], [-0.5, 0.4, 0.8], 0.05, "post"),
)


@pytest.fixture(scope="module", params=["ur5e", "stanford", "excavator"])
def space(request):
    robot = chasles.load(request.param)
    return configuration_space(robot, OBSTACLES, radius=0.05)


def configurations(space, rng, count):
    q = rng.uniform(
        np.maximum(space.lower, -np.pi), np.minimum(space.upper, np.pi), (count, space.robot.n)
    )
    return q[space.is_free(q)]


def test_free_segments_stay_free_at_finer_sampling(space):
    rng = np.random.default_rng(1)
    free = 0
    for q in configurations(space, rng, 40):
        other = np.clip(q + rng.normal(0, 0.2, len(q)), space.lower, space.upper)
        if space.is_free_segment(q, other):
            points = q + np.linspace(0, 1, 100)[:, None] * (other - q)
            assert space.is_free(points).all()
            free += 1
        if free == 6:
            break
    assert free >= 5


def test_distance_change_stays_within_approach_bound(space):
    rng = np.random.default_rng(2)
    checked = 0
    for q in configurations(space, rng, 40):
        step = rng.normal(0, 0.05, len(q))
        here, there = space.distances(q), space.distances(q + step)
        apart = (here > 0) & (there > 0)
        middle = space._approach(q - step, q + step)
        assert (np.abs(here - there) <= middle + 1e-6)[apart].all()
        checked += apart.sum()
    assert checked > 100


def sampled(corners):
    parts = np.linspace(0, 1, 81)
    if len(corners) == 2:
        return corners[0] + parts[:, None] * (corners[1] - corners[0])
    u, v = (grid.ravel()[:, None] for grid in np.meshgrid(parts, parts))
    return np.concatenate(
        [(1 - u) * a + u * ((1 - v) * b + v * c) for a, b, c in combinations(corners, 3)]
    )


@pytest.mark.parametrize("name", ["ur5e", "excavator", "stewart_gough", "delta"])
def test_sphere_distances_match_sampled_shapes(name):
    robot = chasles.load(name)
    radii = np.linspace(
        0.01, 0.03, len(configuration_space(robot, OBSTACLES[:1], radius=0.01).bodies)
    )
    space = configuration_space(robot, OBSTACLES[:1], radius=radii)
    rng, checked = np.random.default_rng(3), 0
    for q in configurations(space, rng, 12):
        found = dict(zip(space.checks, space.distances(q), strict=True))
        corners = space.hulls.corners(robot.configuration(q) if robot.loops else q)
        for k, hull in enumerate(space.hulls.hulls):
            if (k, 0) not in found:
                continue
            away = np.linalg.norm(sampled(corners[k]) - [0.4, 0.3, 0.5], axis=1).min()
            rounded = 0.1 + radii[space.bodies.index(hull.part)]
            assert found[k, 0] == pytest.approx(away - rounded, abs=1e-3 if away < 1 else 1e-2)
            checked += 1
        if checked >= 40:
            break
    assert checked >= 40


def test_allowed_collisions_disable_only_checks_of_named_pair():
    robot = chasles.load("board_installer")
    space = configuration_space(robot, OBSTACLES[:1], radius=0.01)
    pair = ("greater_arm", "rotating_frame")
    other = configuration_space(robot, OBSTACLES[:1], radius=0.01, allowed_collisions=[pair])
    left = set(space.checks) - set(other.checks)
    bodies = [{space.hulls.hulls[a].part, space.hulls.hulls[b - 1].part} for a, b in left]
    assert bodies
    assert all(own == set(pair) for own in bodies)
    q = np.random.default_rng(7).uniform(space.lower, space.upper, (100, robot.n))
    assert space.is_free(q).sum() < other.is_free(q).sum()
    with pytest.raises(InputValueError, match="board_installer has no body 'arm', only r"):
        configuration_space(robot, radius=0.01, allowed_collisions=[("arm", "crank")])


def test_roadmap_paths_of_arm_stay_free_after_shortcutting():
    robot = chasles.load("ur5e")
    space = configuration_space(robot, OBSTACLES, radius=0.05)
    q = configurations(space, np.random.default_rng(4), 60)
    found = 0
    for start, goal in zip(q[:6:2], q[1:6:2], strict=True):
        plan = prm(space, 150, neighbors=8).plan(start, goal)
        if plan.found:
            short = shortcut(space, plan, attempts=30)
            assert space.is_free(short.at(np.linspace(0, 1, 1000))).all()
            assert short.length <= plan.length
            found += 1
    assert found


def test_rrt_connect_finds_free_arm_path_silently(capfd):
    pytest.importorskip("ompl")
    space = configuration_space(chasles.load("scara"), OBSTACLES[:1], radius=0.03)
    start, goal = configurations(space, np.random.default_rng(5), 60)[:2]
    for key in (1, 2):
        plan = rrt_connect(space, start, goal, time_limit=SECONDS, rng=key)
        assert plan.found, plan.reason
        assert space.is_free(plan.at(np.linspace(0, 1, 1000))).all()
    assert "".join(capfd.readouterr()) == ""


def test_blocked_start_names_touching_bodies_or_exceeded_limit():
    robot = chasles.load("ur5e")
    stretched = np.zeros(6)
    p = robot.fk(stretched)[:3, 3]
    space = configuration_space(robot, [sphere(p, 0.05, "cup")], radius=0.04)
    plan = prm(space, 3).plan(stretched, stretched + 1)
    assert "the start is not free: link5 and cup" in plan.reason
    assert plan.reason.endswith("and cup touch")
    beyond = prm(space, 3).plan(robot.upper + 1, stretched)
    assert beyond.reason == "the start is not free: shoulder_pan is beyond its limits"


def test_mesh_obstacle_matches_equal_box_obstacle(tmp_path):
    corners = np.array([[x, y, z] for x in (0, 0.2) for y in (0, 0.2) for z in (0, 0.2)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {a + 1} {b + 1} {c + 1}\nf {a + 1} {c + 1} {d + 1}" for a, b, c, d in faces]
    (tmp_path / "cube.obj").write_text("\n".join(lines) + "\n")
    robot = chasles.load("ur5e")
    meshed = configuration_space(
        robot, [mesh(tmp_path / "cube.obj", place(0.5, 0.1, 0.3))], radius=0.05
    )
    blocked = configuration_space(robot, [box(place(0.6, 0.2, 0.4), [0.2] * 3)], radius=0.05)
    q = np.random.default_rng(6).uniform(-3, 3, (50, 6))
    apart = np.array([[s.distances(x)[:6].min() for s in (meshed, blocked)] for x in q])
    outside = (apart > 0.01).all(1)
    assert outside.sum() > 20
    np.testing.assert_allclose(apart[outside, 0], apart[outside, 1], atol=1e-4)


def test_invalid_obstacles_and_radii_are_rejected():
    robot = chasles.load("ur5e")
    with pytest.raises(ShapeError, match=r"radius: expected one number, or 5 for 0, link2, link3"):
        configuration_space(robot, OBSTACLES, radius=[0.1, 0.1])
    with pytest.raises(InputValueError, match="radius: expected values above 0"):
        configuration_space(robot, OBSTACLES, radius=0)
    for made, message in (
        (lambda: sphere([0, 0], 0.1), r"sphere: center: expected shape \(3,\), got \(2,\)"),
        (lambda: box(np.eye(3), [1, 1, 1]), r"T_0_box: expected shape \(4, 4\), got \(3, 3\)"),
    ):
        with pytest.raises(ShapeError, match=message):
            made()
    for made, message in (
        (
            lambda: sphere([0, 0, 0], -1),
            "sphere: radius: expected a finite value above 0",
        ),
        (
            lambda: box(np.eye(4), [1, 0, 1]),
            "box: size: expected a finite value above 0",
        ),
        (lambda: capsule([0, 0, 0], [0, 0, 1], np.nan), "capsule: radius: expected a finite"),
        (lambda: capsule([0, 0, 0], [0, 0, np.inf], 1), "capsule: end: expected finite numbers"),
        (lambda: mesh("nowhere.stl"), "mesh: path: nowhere.stl: No such file"),
        (lambda: box(2 * np.eye(4), [1, 1, 1]), "box: T_0_box is no pose: its last row is 0 0 0 2"),
    ):
        with pytest.raises(InputValueError, match=message):
            made()


def test_why_explains_limit_and_loop_closure():
    space = configuration_space(chasles.load("excavator"), OBSTACLES[:1], radius=0.05)
    q = np.array(space.robot.reference.q)
    assert space.explain(q * np.nan) == "swing is beyond its limits"
    wide = replace(space, lower=q - 9, upper=q + 9)
    assert wide.explain(q + np.array([0, 5, 0, 0])) == "the loops do not close"
