"""The live view in a browser: sliders, the tool dragged by the mouse, playback."""

import socket

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.view import LiveView, Recording
from tests.support.waiting import until

viser = pytest.importorskip("viser", reason="viser is not installed")
OF_VISER = ("THREE.Clock", "Detected chrome", "WebGL", "Performance")
"""What viser's own page says, whatever is shown."""
GRIP = 0.8
"""Part of the length of the handle's arrow at which the mouse takes it."""


@pytest.fixture
def shown(browser):
    """Opens a view of a robot in the browser; it ends with the test."""
    views = []

    def show(name, **options):
        view = LiveView(chasles.load(name), **options)
        views.append(view)
        browser.open(view.address)
        until(lambda: len(view._server.get_clients()) == 1)
        until(lambda: browser.run("!!document.querySelector('canvas')"))
        until(lambda: "workspace" in browser.run("document.body.innerText"))
        until(lambda: looks_at_the_robot(view))
        return view

    yield show
    for view in views:
        view.close()


def looks_at_the_robot(view):
    """Whether the page has taken the camera that the view gave it."""
    (client,) = view._server.get_clients().values()
    return np.allclose(client.camera.position, view._server.initial_camera.position, atol=1e-3)


def seen(view, browser, point):
    """Where a point of the scene is on the page [pixels]."""
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
    """The number beside a slider, as an expression of the page."""
    labels = "[...document.querySelectorAll('label')]"
    own = f"{labels}.find((l) => l.textContent.startsWith('{label}')).htmlFor"
    return f"document.getElementById({own}).parentElement.querySelector('input[type=text]')"


def test_slider_moves_only_its_joint(shown, browser):
    view = shown("ur5e")
    before = view.posture.q.copy()
    browser.run(f"{field_of('elbow')}.focus()")
    browser.run(f"{field_of('elbow')}.select()")
    browser.write("33")
    until(lambda: view.posture.q[2] != before[2])
    assert view.posture.q[2] == pytest.approx(np.radians(33), abs=1e-9)
    np.testing.assert_array_equal(np.delete(view.posture.q, 2), np.delete(before, 2))
    np.testing.assert_allclose(
        view.posture.tool, chasles.load("ur5e").fk(view.posture.q), atol=1e-12
    )
    x = f"{1000 * view.posture.tool[0, 3]:.1f}"
    until(lambda: x in browser.run("document.body.innerText"))
    assert complaints(browser) == []


@pytest.mark.parametrize("name", ["ur5e", "planar_3rrr"])
def test_dragged_arrow_moves_tool_along_axis_on_nearest_branch(shown, browser, name):
    view = shown(name)
    robot, T = chasles.load(name), view.posture.tool.copy()
    q = view.posture.q.copy()
    arrows = view.handle_size * T[:3, :2].T
    ways = [
        [seen(view, browser, T[:3, 3] + part * arrow) for part in (GRIP, GRIP + 0.3)]
        for arrow in arrows
    ]
    # The axis that is longest on the page: one that points at the viewer cannot be dragged.
    axis = int(np.argmax([np.linalg.norm(end - start) for start, end in ways]))
    browser.drag(*ways[axis])
    until(lambda: np.abs(view.posture.q - q).max() > 1e-4)
    until(lambda: not view.is_dragged)
    moved = np.linalg.solve(T, view.posture.tool)
    assert 0.1 * view.handle_size < moved[axis, 3] < view.handle_size
    np.testing.assert_allclose(np.delete(moved[:3, 3], axis), 0, atol=1e-6)
    np.testing.assert_allclose(moved[:3, :3], np.eye(3), atol=1e-6)
    # The nearest of all branches that hold the tool there.
    found = robot.ik(view.posture.tool) if "ik" in dir(robot) else None
    if found is not None:
        np.testing.assert_allclose(found.nearest(q), view.posture.q, atol=1e-6)
    assert np.abs(view.posture.q - q).max() < 0.8
    assert complaints(browser) == []


def test_recording_is_played_back(shown, browser):
    robot = chasles.load("excavator")
    q = np.array(robot.reference.q)
    ways = np.array([q, q + np.array([0.4, 0.05, 0.05, 0.05])])
    view = shown("excavator", recording=Recording(np.array([0.0, 2.0]), ways))
    view.step()
    first = view.posture.q[0]
    until(lambda: (view.step(), view.posture.q[0] != first)[1])
    part = (view.posture.q[0] - q[0]) / 0.4
    np.testing.assert_allclose(view.posture.q, q + part * (ways[1] - q), atol=1e-12)
    until(lambda: "time" in browser.run("document.body.innerText"))
    assert complaints(browser) == []


def test_occupied_port_is_rejected():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputValueError, match="port"):
            LiveView(chasles.load("four_bar"), port=taken.getsockname()[1])
