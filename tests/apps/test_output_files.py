"""Files are written completely or not at all, and errors name the file."""

import errno
import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles import InputValueError
from chasles.contract import make_folder
from chasles.study import workspace
from chasles.study.motion import MotionSequence
from chasles.view import write_html
from tests.support.faults import check_writes

ARM = chasles.load("ur5e")
TRAJECTORY = (
    MotionSequence(ARM, ARM.q_reference)
    .move(ARM.q_reference + 0.1, "quintic", duration=1)
    .sample(20)
)


@cache
def region():
    return workspace(ARM, 2000, resolution=5, progress=False)


WRITERS = {
    "region.npz": lambda file: region().save(file),
    "trajectory.npz": TRAJECTORY.save,
    "trajectory.csv": TRAJECTORY.save,
    "robot.pdf": lambda file: chasles.draw(ARM, views=["front"], file=file),
    "motion.gif": lambda file: chasles.animate(ARM, TRAJECTORY.q[:1], file, views=["front"]),
    "robot.html": lambda file: write_html(ARM, file),
}


@pytest.mark.parametrize("name", WRITERS)
def test_write_that_fails_leaves_the_former_file(name, tmp_path):
    file = tmp_path / name
    file.write_text("former")
    check_writes(lambda: WRITERS[name](file), tmp_path, name)
    assert file.read_bytes() != b"former"


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("kind", ["missing folder", "folder", "file as folder", "null"])
def test_impossible_target_is_named(name, kind, tmp_path):
    (tmp_path / name).mkdir()
    (tmp_path / "file").touch()
    target = {
        "missing folder": tmp_path / "missing" / name,
        "folder": tmp_path / name,
        "file as folder": tmp_path / "file" / name,
        "null": f"{tmp_path}/\0{name}",
    }[kind]
    with pytest.raises(InputValueError, match=name):
        WRITERS[name](target)


def test_permissions_and_links_are_kept(tmp_path):
    file, link = tmp_path / "result.npz", tmp_path / "link.npz"
    file.touch()
    file.chmod(0o640)
    link.symlink_to(file)
    TRAJECTORY.save(link)
    assert link.is_symlink()
    assert file.stat().st_mode & 0o777 == 0o640
    assert np.array_equal(type(TRAJECTORY).load(file).q, TRAJECTORY.q)


def test_device_is_written_directly():
    with pytest.raises(InputValueError, match=os.strerror(errno.ENOSPC)):
        TRAJECTORY.to_csv("/dev/full")
    assert Path("/dev/full").is_char_device()


def test_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").touch()
    for path in (tmp_path / "file", tmp_path / "file" / "folder"):
        with pytest.raises(InputValueError, match=str(path)):
            make_folder(path)
