"""A one-line error names an input file that is a pipe, a folder or missing."""

import os
import shutil
import sys
from pathlib import Path

import pytest

import chasles
from chasles.library.derived import SUFFIXES

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="named pipes")
KINDS = {
    "pipe": os.mkfifo,
    "folder": Path.mkdir,
    "missing": lambda _: None,
}


def load_error(path):
    """Load a robot, which must fail, and return the error message."""
    with pytest.raises(chasles.ChaslesError) as caught:
        chasles.load(path)
    assert caught.value.__suppress_context__ or caught.value.__context__ is None
    return str(caught.value)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_description_that_is_no_file_is_refused(suffix, kind, tmp_path):
    path = tmp_path / f"arm{suffix}"
    KINDS[kind](path)
    message = load_error(path)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message


def test_too_long_description_is_refused(tmp_path):
    path = tmp_path / "arm.toml"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    assert "larger than 1000000 bytes" in load_error(path)


@pytest.mark.parametrize("kind", KINDS)
def test_generated_file_that_is_no_file_is_refused(kind, folder, cache):
    files = [path.name for path in folder.path.iterdir() if path.is_file()]
    assert len(files) > 2
    for name in files:
        path = folder.path / name
        content = path.read_bytes()
        path.unlink()
        KINDS[kind](path)
        message = load_error(folder.path)
        assert str(folder.path) in message
        assert "\n" not in message
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        path.write_bytes(content)
    assert chasles.load(folder.path).name == folder.path.name


@pytest.mark.parametrize("kind", ["pipe", "folder"])
def test_cached_library_that_is_no_file_is_an_error(kind, folder, cache):
    chasles.load(folder.path)
    (library,) = cache.glob("*.so")
    library.unlink()
    KINDS[kind](library)
    assert str(library) in load_error(folder.path)
