"""Short runs of the benchmarks."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WRITTEN = (*sorted((ROOT / "bench" / "results").iterdir()), ROOT / "docs" / "performance.md")
RUN = """
import runpy, sys
sys.modules["roboticstoolbox"] = None
from bench.cases import arms
arms.ARMS = tuple(arm for arm in arms.ARMS if arm.name == "ur5e")
sys.argv = ["bench", "--quick", "--only", "one_call"]
runpy.run_module("bench", run_name="__main__", alter_sys=True)
"""
"""Runs the benchmarks of one arm without the Robotics Toolbox, whose import takes long."""


def test_quick_run_prints_its_table_and_saves_nothing():
    before = [file.read_bytes() for file in WRITTEN]
    command = [sys.executable, "-c", RUN]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "toolbox is not installed and not compared" in done.stdout
    assert "One call from Python" in done.stdout
    assert "ur5e fk_jacobian" in done.stdout
    assert [file.read_bytes() for file in WRITTEN] == before
