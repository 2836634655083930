"""The offline page and the functions of the robot compute the same body poses."""

from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.derive import read
from chasles.view import write_html
from chasles.view.display import Display
from tests.support.compiling import compiled
from tests.support.robot_stand_in import RobotStandIn
from tests.support.viewed_pages import asked, coordinates, message, on_page, opened, walk

CLOSED = 1e-9
"""Largest error of a body pose (positions in meters, entries of direction vectors). Loop residuals
are 1e-12 of the robot size."""
STEPS = 3
"""Number of configurations per robot."""
HELD = Path(__file__).with_name("held.toml")
"""A robot with slider, weld and ball closures; the other robots have pins and struts."""

GEARED = Path(__file__).parents[2] / "derive" / "loops" / "geared_five_bar.toml"


def moved(T, point) -> np.ndarray:
    return T[:3, :3] @ point + T[:3, 3]


def test_page_kinematics_match_generated_functions(browser, tmp_path):
    opened(browser, tmp_path, chasles.load("four_bar"))
    checked, kinds = 0, set()
    functions = ["fk", "configuration", "constraint", "constraint_D_z"]
    own = [
        compiled(read(file), tmp_path / file.stem, functions, ("c", "python"))
        for file in (HELD, GEARED)
    ]
    for robot in (*map(chasles.load, chasles.robots()), *own):
        name = robot.name
        display = Display(robot)
        kinds |= {closure.kind for closure in display.skeleton.closures}
        configurations = walk(display, STEPS, seed=3)
        q = [displayed.q.tolist() for displayed in configurations]
        found = asked(browser, display, f"{q}.map((q) => [k.moveTo(q), k.poses()])")
        for displayed, (closes, poses) in zip(configurations, found, strict=True):
            assert closes, name
            size = display.skeleton.size
            off = np.abs(np.array(poses, dtype=float).reshape(-1, 4, 4) - displayed.bodies)
            assert off[:, :3, :3].max() < CLOSED, name
            assert off[:, :3, 3].max() < CLOSED * size, name
            checked += 1
    assert checked == STEPS * (len(own) + len(chasles.robots()))
    assert kinds == {"pin", "slider", "weld", "ball"}
    assert browser.complaints() == []


@pytest.mark.parametrize("name", ["ur5e", "stewart_gough"])
def test_page_slider_moves_only_its_joint(browser, tmp_path, name):
    robot = chasles.load(name)
    opened(browser, tmp_path, robot)
    before, q = on_page(browser), coordinates(browser)
    display = Display(robot)
    np.testing.assert_allclose(before, display.start.bodies, atol=1e-6)
    slider = "document.querySelectorAll('input[type=range]')[1]"
    x, y = browser.middle(slider)
    width = browser.run(f"{slider}.offsetWidth") - 16
    value, low, high = (float(browser.run(f"{slider}.{own}")) for own in ("value", "min", "max"))
    at = x + width * ((value - low) / (high - low) - 0.5)
    browser.drag((at, y), (at + 12, y))
    after = coordinates(browser)
    assert after[1] > q[1]
    np.testing.assert_allclose(np.delete(after, 1), np.delete(q, 1), atol=1e-12)
    expected = display.at(after, display.start)
    np.testing.assert_allclose(on_page(browser), expected.bodies, atol=1e-7)
    tool = display.skeleton.tip_poses(on_page(browser))
    np.testing.assert_allclose(tool[:3], expected.tool[:3], atol=1e-7)
    assert f"{1000 * tool[0, 3]:.1f}" in browser.run("document.getElementById('tool').textContent")
    # The base stays at rest, and the tool moves.
    moves = np.abs(on_page(browser) - before).max((-1, -2)) > 1e-4
    assert not moves[0]
    assert moves[display.skeleton.tip]
    if not robot.loops:
        assert moves.tolist() == [k > 1 for k in range(len(moves))]
    assert browser.complaints() == []


def test_page_reports_open_loop_and_recovers(browser, tmp_path):
    robot = chasles.load("planar_3rrr")
    opened(browser, tmp_path, robot)
    closes = browser.run("setCoordinates([3.1, 0.1, -3.1])")
    assert not closes
    assert "does not close" in message(browser)
    display = Display(robot)
    way = (coordinates(browser) - robot.reference.q) / np.subtract(
        [3.1, 0.1, -3.1], robot.reference.q
    )
    np.testing.assert_allclose(way, way[0], atol=1e-9)
    assert 0.1 < way[0] < 0.2
    poses = on_page(browser)
    for span in [body.span for body in display.skeleton.bodies if body.span]:
        lengths = [
            np.linalg.norm(np.subtract(*(moved(T[k], p) for k, p in ends)))
            for T in (poses, display.start.bodies)
            for ends in [list(zip(span.bodies, span.ends, strict=True))]
        ]
        assert lengths[0] == pytest.approx(lengths[1], abs=1e-9)
    browser.click(browser.middle("document.getElementById('home')"))
    np.testing.assert_allclose(coordinates(browser), robot.reference.q, atol=1e-12)
    assert message(browser) == ""


def test_page_loads_no_external_resources_and_escapes_title(browser, tmp_path):
    opened(browser, tmp_path, Renamed(chasles.load("delta")))
    assert browser.run("document.querySelector('h1').textContent") == Renamed.title
    script = "performance.getEntriesByType('resource').map((entry) => entry.name)"
    assert [name for name in browser.run(script) if not name.startswith("data:")] == []
    # A picture with many colors is not empty.
    script = """(() => {
      render();
      const gl = renderer.getContext(), size = [gl.drawingBufferWidth, gl.drawingBufferHeight];
      const pixels = new Uint8Array(4 * size[0] * size[1]);
      gl.readPixels(0, 0, ...size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return new Set(new Uint32Array(pixels.buffer)).size;
    })()"""
    assert browser.run(script) > 100
    assert browser.complaints() == []


class Renamed(RobotStandIn):
    """A robot whose title contains tags."""

    title = "</script><!--<script><b>{x}"

    def __init__(self, robot):
        self._robot = robot

    def __getattr__(self, name):
        return getattr(self._robot, name)

    def __dir__(self):
        return dir(self._robot)


def test_page_reports_missing_webgl(browser, tmp_path):
    blind = "<body><script>HTMLCanvasElement.prototype.getContext = () => null;</script>"
    file = tmp_path / "blind.html"
    write_html(chasles.load("four_bar"), file)
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("<body>", blind), encoding="utf-8")
    browser.open(file.as_uri())
    assert "no WebGL" in message(browser)
    browser.said.clear()
