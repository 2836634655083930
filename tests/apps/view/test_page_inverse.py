"""The IK function on the page agrees with the robot's functions and follows mouse drags."""

import json

import numpy as np
import pytest

import chasles
from chasles.drawing import skeleton
from chasles.view.display import Display
from chasles.view.tool_branches import branches
from tests.support.viewed_pages import asked, coordinates, message, on_page, opened, walk
from tests.support.waiting import until

TRUE = 1e-9
"""Largest tool error, in radians and relative to the robot's size."""
SAME = 1e-6
"""Below this coordinate difference (radian or meter), two configurations are equal."""
REDUNDANT = {"iiwa14", "panda", "photo_robot", "well_manipulator"}
BRANCHED = ("ur5e", "puma560", "jaco2", "lynxmotion", "scara", "planar_3rrr", "five_bar", "delta")
STEPS = 4
"""Number of configurations per robot on the path that the tool follows."""
ALONG, RING = 0.8, 0.72
"""Positions at which the mouse grips an arrow and a ring, in arrow lengths."""


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    """Open a browser with the scripts of a page."""
    opened(browser, tmp_path_factory.mktemp("page"), chasles.load("ur5e"))
    return browser


def show(browser, folder, robot):
    """Show a robot in its first configuration."""
    if not browser.run("location.href").endswith(f"/{robot.name}.html"):
        opened(browser, folder, robot)
    assert browser.run(f"setCoordinates({Display(robot).start.q.tolist()})")


def wrapped(robot, apart):
    """Wrap differences of revolute coordinates to [-pi, pi]."""
    turns = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    return np.where(turns, np.remainder(apart + np.pi, 2 * np.pi) - np.pi, apart)


def test_page_inverse_follows_tool_for_all_robots(page):
    checked = 0
    for name in chasles.robots():
        robot = chasles.load(name)
        display = Display(robot)
        way = walk(display, STEPS, seed=4, part=0.04)
        goals = [displayed.tool.ravel().tolist() for displayed in way]
        q = "k.driven.map((j, i) => k.z[j] / k.robot.sliders[i].ratio)"
        follow = f"{goals}.map((T) => {{ const f = inverse.follow(k.z, T); k.z = f.z;"
        out = asked(page, display, f"{follow} return [{q}, f.position, f.turn, k.poses()]; }})")
        for displayed, (found, position, turn, poses) in zip(way, out, strict=True):
            assert max(position, turn) < TRUE, name
            bodies = np.array(poses, dtype=float).reshape(-1, 4, 4)
            off = np.abs(display.skeleton.tip_poses(bodies) - displayed.tool)
            assert off[:3, :3].max() < TRUE, name
            assert off[:3, 3].max() < TRUE * display.skeleton.size, name
            assert (np.array(found) > robot.lower - SAME).all(), name
            assert (np.array(found) < robot.upper + SAME).all(), name
            if name not in REDUNDANT:
                near = wrapped(robot, np.array(found) - displayed.q)
                assert np.abs(near).max() < SAME * max(1, display.skeleton.size), name
            checked += 1
    assert checked == STEPS * len(chasles.robots())
    assert page.complaints() == []


@pytest.mark.parametrize("name", BRANCHED)
def test_page_ghosts_show_all_closed_form_branches(page, name):
    robot = chasles.load(name)
    display = Display(robot)
    displayed = walk(display, 3, seed=8)[-1]
    seek = "[...inverse.others(k.z)].filter((z) => z)"
    q = ".map((z) => k.driven.map((j, i) => z[j] / k.robot.sliders[i].ratio))"
    script = f"(k.moveTo({displayed.q.tolist()}), {seek}{q})"
    found = np.array(asked(page, display, script), dtype=float).reshape(-1, robot.n)
    assert len(found) > 0
    T = displayed.tool
    # The delta's closed form omits poses that share their actuator values with another pose.
    for row in found if name != "delta" else ():
        expected = branches(robot, T, row).q
        assert np.abs(wrapped(robot, expected - row)).max(-1).min() < SAME, (name, row)
    own = branches(robot, T, displayed.q).q
    for row in own:
        every = np.vstack([found, displayed.q])
        assert np.abs(wrapped(robot, every - row)).max(-1).min() < SAME, (name, row)


def test_dragged_tool_respects_limits_at_local_minimum(page):
    """At a local minimum, no small move within the limits reduces the error."""
    robot, rng = chasles.load("irb6640"), np.random.default_rng(1)
    display = Display(robot)
    size, at_limits = display.skeleton.size, 0
    for displayed in walk(display, 12, seed=6, part=0.5):
        T = displayed.tool.copy()
        T[:3, 3] += 0.5 * size * rng.normal(size=3)
        goal = T.ravel().tolist()
        script = f"(k.moveTo({displayed.q.tolist()}), "
        script += "(() => { let z = k.z, f; for (let i = 0; i < 20; i++)"
        script += f" {{ f = inverse.follow(z, {goal}); z = f.z; }} return [z, f.position]; }})())"
        q, position = asked(page, display, script)
        q = np.array(q, dtype=float)
        inside = (robot.lower, robot.upper)
        assert (q >= inside[0] - 1e-9).all()
        assert (q <= inside[1] + 1e-9).all()
        error = weighted(robot, q[None], T, size)[0]
        assert position <= error + TRUE
        near = np.clip(q + 1e-3 * rng.normal(size=(500, robot.n)), *inside)
        assert weighted(robot, near, T, size).min() > error - 1e-4 * (1 + error)
        at_limits += bool((np.minimum(q - inside[0], inside[1] - q) < 1e-9).any())
    assert at_limits >= 3


def weighted(robot, q, T, size):
    """Return the tool error that the page minimizes while a user drags the tool position."""
    from scipy.spatial.transform import Rotation

    found = robot.fk(q)
    turns = Rotation.from_matrix(T[:3, :3] @ found[:, :3, :3].transpose(0, 2, 1)).as_rotvec()
    off = np.hstack([(T[:3, 3] - found[:, :3, 3]) / size, 0.02 * turns])
    return np.linalg.norm(off, axis=1)


def seen(browser, pose, point):
    """Project a point in tool coordinates to the page [pixels]."""
    T = json.dumps(pose.ravel().tolist())
    script = f"""(() => {{
      const v = new THREE.Vector3(...moved({T}, {json.dumps(list(point))})).project(camera);
      return [(v.x + 1) / 2 * innerWidth, (1 - v.y) / 2 * innerHeight];
    }})()"""
    return np.array(browser.run(script), dtype=float)


def tool(browser, robot):
    return skeleton(robot).tip_poses(on_page(browser))


def test_dragged_ring_rotates_tool_about_its_axis(page, tmp_path):
    robot, browser = chasles.load("ur5e"), page
    show(browser, tmp_path, robot)
    T, length = tool(browser, robot), browser.run("handle.length")
    around = [np.array([0, np.cos(a), np.sin(a)]) for a in (0.7, 0.9)]
    browser.drag(*(seen(browser, T, RING * length * point) for point in around))
    until(lambda: browser.run("handle.drag === null"))
    moved = np.linalg.solve(T, tool(browser, robot))
    np.testing.assert_allclose(moved[:3, 3], 0, atol=1e-8)
    np.testing.assert_allclose(moved[0, :3], [1, 0, 0], atol=1e-8)
    assert np.arctan2(moved[2, 1], moved[1, 1]) == pytest.approx(0.2, abs=0.05)


def test_page_shows_ghosts_and_reports_unreachable_tool(page, tmp_path):
    robot, browser = chasles.load("ur5e"), page
    show(browser, tmp_path, robot)
    expected = robot.ik(robot.fk(coordinates(browser))).count - 1
    shown = "ghosts.places.filter((place) => place.group.visible).length"
    until(lambda: browser.run(shown) == expected)
    far = tool(browser, robot)
    far[:3, 3] *= 3
    browser.run(f"dragTo({far.ravel().tolist()}, 'position')")
    assert "The pose is out of reach" in message(browser)
    browser.click(browser.middle("document.getElementById('ghosts')"))
    until(lambda: browser.run(shown) == 0)
    browser.click(browser.middle("document.getElementById('ghosts')"))
    assert browser.complaints() == []


@pytest.mark.parametrize("name", ["ur5e", "planar_3rrr"])
def test_dragged_arrow_moves_tool_along_its_axis(page, tmp_path, name):
    robot, browser = chasles.load(name), page
    show(browser, tmp_path, robot)
    q, T = coordinates(browser), tool(browser, robot)
    length = browser.run("handle.length")
    parts = (ALONG, ALONG + 0.3)
    ways = [[seen(browser, T, part * length * axis) for part in parts] for axis in np.eye(3)[:2]]
    k = int(np.argmax([np.linalg.norm(end - start) for start, end in ways]))
    browser.drag(*ways[k])
    until(lambda: browser.run("handle.drag === null"))
    moved = np.linalg.solve(T, tool(browser, robot))
    assert moved[k, 3] == pytest.approx(0.3 * length, rel=0.1)
    np.testing.assert_allclose(np.delete(moved[:3, 3], k), 0, atol=1e-8)
    np.testing.assert_allclose(moved[:3, :3], np.eye(3), atol=1e-8)
    there = coordinates(browser)
    expected = branches(robot, tool(browser, robot), q).followed
    np.testing.assert_allclose(there, expected, atol=1e-6)
    assert message(browser) == ""
    assert browser.complaints() == []
