"""Creates a separate cache for each test, and the test robot `tiny`."""

import gc

import pytest

import chasles
from tests.support.handwritten.tiny import Folder, manifest


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """Return the folder of an empty cache, and remove the developer's compiler settings."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("CHASLES_CACHE", str(folder))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("CHASLES_CFLAGS", raising=False)
    return folder


@pytest.fixture
def few_objects():
    """Exclude all existing objects from garbage collection, for tests that collect often.

    A full garbage collection that scans the expressions of earlier tests takes 0.4 s.
    """
    gc.collect()
    gc.freeze()


@pytest.fixture
def folder(tmp_path, cache):
    """Return the folder of the tiny robot before compilation."""
    folder = Folder(tmp_path / "tiny", manifest())
    folder.write()
    return folder


@pytest.fixture(scope="session")
def robot(tmp_path_factory):
    """Return the tiny robot, loaded once for all tests that only call its functions."""
    root = tmp_path_factory.mktemp("robot")
    folder = Folder(root / "tiny", manifest())
    folder.write()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(root / "cache"))
        patch.delenv("CC", raising=False)
        patch.delenv("CHASLES_CFLAGS", raising=False)
        return chasles.load(folder.path)
