"""The live view in a browser: sliders, mouse drags of the tool, and playback."""

import socket

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study.motion import Trajectory
from chasles.view import LiveView
from chasles.view.display import Display
from tests.support.optional import requires
from tests.support.waiting import until

pytestmark = requires("viser")
OF_VISER = ("THREE.Clock", "Detected chrome", "WebGL", "Performance")
"""Console messages that viser prints on every page, regardless of the page content."""
ROUTE = np.array([0.4, 0.05, 0.05, 0.05, -0.1, 0.1])
"""Coordinate change along the trajectory [rad]."""
GRIP = 0.8
"""Position of the mouse on the handle's arrow at the start of a drag, as a fraction of the arrow's
length."""


@pytest.fixture(scope="module")
def arm_view(browser, tmp_path_factory):
    """Open a view of an arm with a trajectory, once for all tests.

    Shadows, environment lights and the ground are slow in software rendering.
    """
    arm = chasles.load("ur5e")
    q = Display(arm).start.q
    trajectory = straight(tmp_path_factory.mktemp("view"), arm, q, q + ROUTE)
    view = LiveView(arm, trajectory=trajectory)
    scene = view._server.scene
    scene.configure_default_lights(enabled=True, cast_shadow=False)
    scene.configure_environment_map(None)
    scene.remove_by_name("/ground")
    browser.open(view.address)
    until(lambda: len(view._server.get_clients()) == 1)
    until(lambda: browser.run("!!document.querySelector('canvas')"))
    until(lambda: "workspace" in browser.run("document.body.innerText"))
    until(lambda: looks_at_the_robot(view))
    yield view
    view.close()


@pytest.fixture
def view(arm_view):
    """Return the live view, in which the arm is at its initial configuration again."""
    arm_view.set_q(arm_view._display.start.q)
    return arm_view


def straight(folder, robot, q_start, q_end):
    """Return a trajectory from time 1 s to time 3 s between two configurations."""
    np.savez(folder / "motion.npz", t=[1.0, 3.0], q=[q_start, q_end])
    return Trajectory.load(folder / "motion.npz", robot)


def looks_at_the_robot(view):
    (client,) = view._server.get_clients().values()
    return np.allclose(client.camera.position, view._server.initial_camera.position, atol=1e-3)


def seen(view, browser, point):
    """Project a point of the scene to the page [pixels]."""
    (client,) = view._server.get_clients().values()
    camera = client.camera
    w, (x, y, z) = camera.wxyz[0], camera.wxyz[1:]
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    p = R.T @ (np.asarray(point) - camera.position)
    box = browser.run("document.querySelector('canvas').getBoundingClientRect().toJSON()")
    focal = box["height"] / 2 / np.tan(camera.fov / 2)
    middle = np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])
    return middle + focal * p[:2] / p[2]


def complaints(browser):
    return [text for text in browser.complaints() if not any(own in text for own in OF_VISER)]


def field_of(label):
    labels = "[...document.querySelectorAll('label')]"
    own = f"{labels}.find((l) => l.textContent.startsWith('{label}')).htmlFor"
    return f"document.getElementById({own}).parentElement.querySelector('input[type=text]')"


def test_slider_moves_only_its_joint(view, browser):
    before = view.displayed.q.copy()
    browser.run(f"{field_of('elbow')}.focus()")
    browser.run(f"{field_of('elbow')}.select()")
    browser.write("33")
    until(lambda: view.displayed.q[2] != before[2])
    assert view.displayed.q[2] == pytest.approx(np.radians(33), abs=1e-9)
    np.testing.assert_array_equal(np.delete(view.displayed.q, 2), np.delete(before, 2))
    np.testing.assert_allclose(
        view.displayed.tool, chasles.load("ur5e").fk(view.displayed.q), atol=1e-12
    )
    x = f"{1000 * view.displayed.tool[0, 3]:.1f}"
    until(lambda: x in browser.run("document.body.innerText"))
    assert complaints(browser) == []


def test_dragged_arrow_moves_tool_along_axis_on_nearest_branch(view, browser):
    robot, T = chasles.load("ur5e"), view.displayed.tool.copy()
    q = view.displayed.q.copy()
    arrows = view.handle_size * T[:3, :2].T
    ways = [
        [seen(view, browser, T[:3, 3] + part * arrow) for part in (GRIP, GRIP + 0.3)]
        for arrow in arrows
    ]
    # Drag the arrow that is longest on the screen. An axis toward the viewer cannot be dragged.
    axis = int(np.argmax([np.linalg.norm(end - start) for start, end in ways]))
    browser.drag(*ways[axis])
    until(lambda: np.abs(view.displayed.q - q).max() > 1e-4)
    until(lambda: not view.is_dragged)
    moved = np.linalg.solve(T, view.displayed.tool)
    assert 0.1 * view.handle_size < moved[axis, 3] < view.handle_size
    np.testing.assert_allclose(np.delete(moved[:3, 3], axis), 0, atol=1e-6)
    np.testing.assert_allclose(moved[:3, :3], np.eye(3), atol=1e-6)
    # Dragging the tool selects the solution nearest to q among all branches.
    np.testing.assert_allclose(
        robot.ik(view.displayed.tool).nearest(q), view.displayed.q, atol=1e-6
    )
    assert np.abs(view.displayed.q - q).max() < 0.8
    assert complaints(browser) == []


def test_trajectory_is_played_back(view, browser):
    q = view.displayed.q.copy()
    view.step()
    first = view.displayed.q[0]
    until(lambda: (view.step(), view.displayed.q[0] != first)[1])
    part = (view.displayed.q[0] - q[0]) / ROUTE[0]
    assert 0 < part <= 1
    np.testing.assert_allclose(view.displayed.q, q + part * ROUTE, atol=1e-12)
    until(lambda: "time" in browser.run("document.body.innerText"))
    assert complaints(browser) == []


@pytest.mark.parametrize("name", ["planar_3rrr", "excavator"])
def test_view_of_loops_follows_target_and_trajectory(name, tmp_path):
    """The test needs only the server."""
    robot = chasles.load(name)
    start = Display(robot).start
    there = Display(robot).at(start.q + 0.02, start)
    trajectory = straight(tmp_path, robot, start.q, there.q)
    view = LiveView(robot, trajectory=trajectory)
    try:
        view.set_target(there.tool)
        np.testing.assert_allclose(view.displayed.tool, there.tool, atol=1e-7)
        shown = [T[:3, 3] for T in view.displayed.bodies]
        np.testing.assert_allclose([body.position for body in view._bodies], shown, atol=1e-12)
        view.step()
        part = (view.displayed.q - start.q) / (there.q - start.q)
        np.testing.assert_allclose(part, part[0], atol=1e-9)
        assert 0 <= part[0] <= 1
    finally:
        view.close()


def test_occupied_port_is_rejected():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputValueError, match="port"):
            LiveView(chasles.load("four_bar"), port=taken.getsockname()[1])
