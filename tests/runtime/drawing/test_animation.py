"""Moving drawings: a picture for each posture, one size, and errors that help."""

import itertools
import shutil

import numpy as np
import pytest

import chasles
from chasles.errors import ChaslesError, InputValueError, ShapeError

image = pytest.importorskip("PIL.Image")
pytest.importorskip("matplotlib")


def motion(robot, n):
    return np.array(robot.reference.q) + np.linspace(0, 0.3, n)[:, None]


def pictures(file):
    with image.open(file) as found:
        for k in range(found.n_frames):
            found.seek(k)
            yield np.asarray(found.convert("RGB")).astype(int)


def test_a_picture_for_each_posture_and_the_crank_moves(tmp_path):
    robot = chasles.load("four_bar")
    file = chasles.animate(robot, motion(robot, 4), tmp_path / "turn.gif", rate=10)
    with image.open(file) as found:
        assert found.n_frames == 4
        assert found.info["duration"] == 100
    every = list(pictures(file))
    assert {picture.shape for picture in every} == {every[0].shape}
    changed = [np.abs(a - b).sum() for a, b in itertools.pairwise(every)]
    assert min(changed) > 0
    # The axes and what is on the ground stay.
    still = np.ptp(np.array(every), axis=0).sum(-1) == 0
    assert still.mean() > 0.8


@pytest.mark.skipif(shutil.which("ffmpeg") is not None, reason="ffmpeg is installed")
def test_films_need_ffmpeg(tmp_path):
    robot = chasles.load("four_bar")
    with pytest.raises(ChaslesError, match="apt install ffmpeg"):
        chasles.animate(robot, motion(robot, 2), tmp_path / "turn.mp4")


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_a_film_is_written(tmp_path):
    robot = chasles.load("four_bar")
    file = chasles.animate(robot, motion(robot, 3), tmp_path / "turn.mp4")
    assert b"ftyp" in file.read_bytes()[:32]


def test_what_is_wrong_is_named(tmp_path):
    robot = chasles.load("four_bar")
    with pytest.raises(InputValueError, match=r"'turn\.avi', expected \.gif or \.mp4"):
        chasles.animate(robot, motion(robot, 2), tmp_path / "turn.avi")
    with pytest.raises(ShapeError, match="animate: motion"):
        chasles.animate(robot, robot.reference.q, tmp_path / "turn.gif")
