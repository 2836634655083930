"""The notebooks print their stored output."""

import pytest

from docs.notebooks import FOLDER, executed, read
from tests.support.compiling import deriving_only


@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.glob("*.ipynb")))
def test_notebook_prints_its_stored_output(name, tmp_path, monkeypatch):
    if name == "calibration.ipynb":
        pytest.importorskip("scipy")
    stored = read(FOLDER / name)
    monkeypatch.chdir(tmp_path)
    with deriving_only("fk", "ik"):
        assert executed(stored) == stored, "run python docs/notebooks.py"
