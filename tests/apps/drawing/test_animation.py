"""Animations have one picture per configuration and a constant size."""

import itertools
import shutil
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import chasles
from chasles.drawing import animation, skeleton
from chasles.errors import ChaslesError, InputValueError, ShapeError
from chasles.study.motion import Motion, joint_line, time_scaling
from tests.support.optional import requires

image = pytest.importorskip("PIL.Image")
pytestmark = requires("matplotlib")


def motion(robot, n):
    return np.array(robot.reference.q) + np.linspace(0, 0.3, n)[:, None]


def pictures(file):
    with image.open(file) as found:
        for k in range(found.n_frames):
            found.seek(k)
            yield np.asarray(found.convert("RGB")).astype(int)


def test_gif_has_changing_frame_for_each_configuration(tmp_path):
    robot = chasles.load("four_bar")
    file = chasles.animate(robot, motion(robot, 3), tmp_path / "turn.gif", fps=10)
    with image.open(file) as found:
        assert found.n_frames == 3
        assert found.info["duration"] == 100
    every = list(pictures(file))
    assert {picture.shape for picture in every} == {every[0].shape}
    changed = [np.abs(a - b).sum() for a, b in itertools.pairwise(every)]
    assert min(changed) > 0
    # The axes and the objects on the ground do not move.
    still = np.ptp(np.array(every), axis=0).sum(-1) == 0
    assert still.mean() > 0.8


def test_gif_shows_trajectory_at_its_times(tmp_path, monkeypatch):
    """The test records the configuration in each image of the animation."""
    robot = chasles.load("four_bar")
    q = np.array(robot.reference.q)
    curve = joint_line(q, q + 0.2)
    scaling = time_scaling("quintic", curve.length, duration=0.4)
    moved = Motion(robot, curve, scaling, q)
    rows, shown = moved.sample(10).q, []

    def recorded(robot, rows, views):
        shown.append(rows)
        return [np.zeros((2, 2, 3), dtype=np.uint8)]

    assert len(rows) == 5
    monkeypatch.setattr(animation, "_pictures", recorded)
    for trajectory in (rows, moved, moved.sample(1000)):
        chasles.animate(robot, trajectory, tmp_path / "move.gif", fps=10)
        np.testing.assert_allclose(shown[-1], rows, atol=1e-6)


def test_mp4_has_frame_for_each_configuration(tmp_path, monkeypatch):
    """The test reads the video again with ffmpeg."""
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    robot = chasles.load("four_bar")
    monkeypatch.setattr(shutil, "which", lambda _: None)
    file = chasles.animate(robot, motion(robot, 2), tmp_path / "turn.mp4", fps=10)
    assert imageio_ffmpeg.count_frames_and_secs(file) == (2, pytest.approx(0.2))
    # The video has a lower color resolution than the GIF.
    gif = list(pictures(chasles.animate(robot, motion(robot, 2), tmp_path / "turn.gif", fps=10)))
    read = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", file, "-f", "rawvideo"]
    data = subprocess.run([*read, "-pix_fmt", "rgb24", "-"], capture_output=True, check=True).stdout
    film = np.frombuffer(data, np.uint8).reshape(-1, *gif[0].shape).astype(int)
    off = np.array([[np.abs(a - b).mean() for b in gif] for a in film])
    assert off.shape == (2, 2)
    assert np.diag(off).max() < 5 < off[~np.eye(2, dtype=bool)].min()


def test_mp4_without_ffmpeg_gives_install_hint(tmp_path, monkeypatch):
    robot = chasles.load("four_bar")
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ChaslesError, match=r"pip install 'chasles\[film\]'"):
        chasles.animate(robot, motion(robot, 2), tmp_path / "turn.mp4")


def test_unwritable_mp4_path_is_reported(tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    robot = chasles.load("four_bar")
    with pytest.raises(ChaslesError, match="cannot be written \\(no folder"):
        chasles.animate(robot, motion(robot, 1), tmp_path / "absent" / "turn.mp4")


def test_invalid_animation_arguments_are_rejected(tmp_path):
    robot = chasles.load("four_bar")
    with pytest.raises(InputValueError, match=r"expected \.gif or \.mp4, got 'turn\.avi'"):
        chasles.animate(robot, motion(robot, 2), tmp_path / "turn.avi")
    with pytest.raises(ShapeError, match="animate: trajectory"):
        chasles.animate(robot, robot.reference.q, tmp_path / "turn.gif")
    other = SimpleNamespace(robot="five_bar", q=motion(robot, 2))
    with pytest.raises(
        InputValueError, match="expected a motion of robot four_bar, got robot five_bar"
    ):
        chasles.animate(robot, other, tmp_path / "turn.gif")


def test_labels_keep_their_distance_from_the_joint_in_every_frame(monkeypatch):
    robot = chasles.load("excavator")
    figures, of_figure = [], animation.figure_of

    def recorded(shown, *args, **kwargs):
        figures.append((shown[0], of_figure(shown, *args, **kwargs)))
        return figures[-1][1]

    monkeypatch.setattr(animation, "figure_of", recorded)
    rows = robot.q_reference + np.linspace(0, 0.5, 4)[:, None] * [1.0, 0.1, 0.1, 0.1]
    list(animation._pictures(robot, rows, ("axonometric",)))
    offsets, scales = [], []
    for scene, figure in figures:
        texts = {text.get_text(): np.array(text.get_position()) for text in figure.axes[0].texts}
        offsets.append([texts[f"$q_{{{a.coordinate + 1}}}$"] - a.point for a in scene.anchors])
        scales.append(next(place for text, place in texts.items() if text.endswith(" m")))
    assert len(offsets) == 4
    assert np.ptp(offsets, axis=0).max() < 1e-9
    assert np.ptp(scales, axis=0).max() < 1e-9


@pytest.mark.parametrize("name", ["scara", "excavator", "planar_3rrr"])
def test_film_without_trajectory_moves_every_coordinate_within_its_limits(name):
    robot = chasles.load(name)
    bodies = skeleton(robot)
    rows = animation._sweep(bodies, fps=5)
    moved = np.ptp(rows, axis=0)
    assert (moved > 1e-3 * robot.unit_length).all()
    assert all(robot.is_within_limits(q) for q in rows)
    assert np.isfinite(bodies.poses(rows)).all()
    # One coordinate moves at a time, and the animation ends where it starts.
    assert ((np.abs(rows - bodies.q_drawn) > 1e-12).sum(axis=1) <= 1).all()
    np.testing.assert_allclose(rows[[0, -1]], bodies.q_drawn[None].repeat(2, 0), atol=1e-12)


def test_crank_makes_a_full_turn_at_constant_speed():
    crank, slider = (skeleton(chasles.load(name)) for name in ("four_bar", "slider_crank"))
    rows = animation._sweep(crank, fps=20)
    assert len(rows) == 80
    np.testing.assert_allclose(np.diff(rows[:, 0]), 2 * np.pi / 80, rtol=1e-9)
    np.testing.assert_allclose(rows[0], crank.q_drawn)
    rows = animation._sweep(slider, fps=20)
    assert len(rows) == 80
    assert slider.robot.is_within_limits(rows).all()
    assert np.isfinite(slider.poses(rows)).all()


def test_labels_have_a_halo_that_separates_them_from_links(monkeypatch):
    robot, figures, of_figure = chasles.load("four_bar"), [], animation.figure_of

    def recorded(*args, **kwargs):
        figures.append(of_figure(*args, **kwargs))
        return figures[-1]

    monkeypatch.setattr(animation, "figure_of", recorded)
    list(animation._pictures(robot, motion(robot, 2), None))
    labels = [text for one in figures for text in one.axes[0].texts if text.get_text()]
    assert len(labels) >= 4
    assert all(label.get_path_effects() for label in labels)


def test_legend_and_color_of_the_path_start_with_the_path(tmp_path):
    robot = chasles.load("four_bar")
    rows = np.array(robot.reference.q) + np.linspace(0, 1, 4)[:, None]
    first, second, *_, last = pictures(chasles.animate(robot, rows, tmp_path / "a.gif", fps=5))
    legend = slice(int(0.93 * len(first)), None)
    assert np.ptp(first[legend]) == 0
    assert np.ptp(second[legend]) > 0
    is_pink = (last[..., 0] - last[..., 1] > 50) & (last[..., 2] - last[..., 1] > 30)
    assert is_pink.sum() > 50
