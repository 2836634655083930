"""Short runs of the benchmarks."""

import runpy
import sys
from pathlib import Path

import pytest

from bench.measures import one_call

ROOT = Path(__file__).parents[1]
WRITTEN = (*sorted((ROOT / "bench" / "results").iterdir()), ROOT / "docs" / "performance.md")


def test_quick_run_prints_its_table_and_saves_nothing(monkeypatch, capsys):
    """One arm is measured, without the Robotics Toolbox, whose import takes long."""
    before = [file.read_bytes() for file in WRITTEN]
    monkeypatch.setitem(sys.modules, "roboticstoolbox", None)
    monkeypatch.setattr(one_call, "ARMS", one_call.ARMS[:1])
    monkeypatch.setattr(sys, "argv", ["bench", "--quick", "--only", "one_call"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("bench", run_name="__main__", alter_sys=True)
    printed = capsys.readouterr().out
    assert ended.value.code == 0
    assert "toolbox is not installed and not compared" in printed
    assert "One call from Python" in printed
    assert "ur5e fk_jacobian" in printed
    assert [file.read_bytes() for file in WRITTEN] == before
