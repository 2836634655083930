"""Reading a malicious file runs no command, reads no other file and writes no file.

Placeholders in the malicious files: ``@MARK@`` is the path of a file that no command may create,
``@PIPE@`` a named pipe without a writer, and ``@URL@`` a network address. In archives, the
placeholder ``@MARK@`` is not replaced by a path. If a reader ran a command in an archive, the
command would create a file named ``@MARK@`` in the current folder.
"""

import os
import socket
import sys
from pathlib import Path

import pytest

import chasles
from chasles.calibration import read_measurements
from chasles.derive import ChaslesError, apply_calibration, read
from chasles.derive.description.importers.chains import SUFFIXES
from chasles.study.motion import Trajectory
from tests.support.counting import stopped_after

FOLDER = Path(__file__).parent / "crafted"
CANARY = "73917391"
MAX_CALLS = 5_000_000
"""Maximum number of function calls that a reader may make for one file."""
OUTSIDE = {
    "secret.txt": CANARY,
    "secret.yaml": f"key: {CANARY}",
    "secret.xml": f'<robot><link name="s{CANARY}"/><joint name="s{CANARY}"/></robot>',
    "secret.mjcf.xml": f'<mujoco><worldbody><body name="s{CANARY}"/></worldbody></mujoco>',
    "secret.toml": f'name = "s{CANARY}"',
}


def calibration(file):
    return apply_calibration(read("ur5e"), file)


@pytest.fixture(scope="module", autouse=True)
def imported():
    """Import the Python packages of the file readers once instead of once per file."""
    for package in ("mujoco", "xacro", "yaml"):
        pytest.importorskip(package)


READERS = {
    **dict.fromkeys((".yaml", ".conf"), calibration),
    ".csv": lambda file: read_measurements(file, chasles.load("ur5e")),
    ".npz": lambda file: Trajectory.load(file, chasles.load("ur5e")),
}


@pytest.fixture
def address():
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setblocking(False)
        yield server


@pytest.fixture
def outer(tmp_path):
    folder = tmp_path / "outer"
    folder.mkdir()
    for name, text in OUTSIDE.items():
        (folder / name).write_text(text)
    return folder


def content(name, words):
    data = (FOLDER / name).read_bytes()
    for word, value in words.items():
        data = data.replace(word.encode(), str(value).encode())
    return data


def outcome(file):
    """Read a file, and return the text of the result or error and whether an error was raised."""
    reader = READERS.get(file.suffix, read)
    try:
        if file.suffix in SUFFIXES:
            return repr(vars(reader(file))), False
        return repr(vars(stopped_after(MAX_CALLS, lambda: reader(file)))), False
    except ChaslesError as error:
        return str(error), True


@pytest.mark.skipif(sys.platform == "win32", reason="named pipes")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.iterdir()))
def test_crafted_file_has_no_effect(name, tmp_path, outer, address, monkeypatch):
    os.mkfifo(outer / "pipe.toml")
    inner = tmp_path / "inner"
    inner.mkdir()
    monkeypatch.chdir(inner)
    port = address.getsockname()[1]
    words = {"@MARK@": tmp_path / "mark", "@OUT@": outer, "@PIPE@": outer / "pipe.toml"}
    file = inner / f"case{Path(name).suffix}"
    file.write_bytes(content(name, words | {"@URL@": f"http://127.0.0.1:{port}/a.xml"}))
    before = sorted(tmp_path.rglob("*"))
    shown, is_refused = outcome(file)
    assert CANARY not in shown
    assert "takes longer than" not in shown
    assert str(file) in shown or not is_refused
    assert sorted(tmp_path.rglob("*")) == before
    with pytest.raises(BlockingIOError):
        address.accept()
