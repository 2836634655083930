"""The examples in the pages about workspaces, motions and plans run."""

import numpy as np
import pytest

from tests.support.pages import run

pytest.importorskip("coal", reason="coal comes with pin")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    yield
    matplotlib.pyplot.close("all")


def test_workspace_page_examples_run(capsys):
    names = run("how-to/workspace.md")
    assert names["fraction"].max() == 1
    assert names["found"].fraction_grid().shape == (20, 20, 11)
    assert "volume 3." in capsys.readouterr().out


def test_motion_page_examples_run():
    names = run("how-to/motion.md")
    assert 0.5 < names["fast"].duration < names["motion"].duration
    assert len(names["bricks"].t) > 1000
    lengths = 1000 * np.ptp(names["lengths"], axis=0)
    np.testing.assert_allclose(lengths, [348.9, 302.7, 318.9, 123.2], atol=0.05)


def test_planning_page_examples_run():
    assert run("how-to/planning.md")["path"].found
