"""A smoke run of the benchmarks."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WRITTEN = (*sorted((ROOT / "bench" / "results").iterdir()), ROOT / "docs" / "performance.md")


def test_quick_run_prints_its_table_and_saves_nothing():
    before = [file.read_bytes() for file in WRITTEN]
    command = [sys.executable, "-m", "bench", "--quick", "--only", "one_call"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "One call from Python" in done.stdout
    assert "ur5e fk_jacobian" in done.stdout
    assert [file.read_bytes() for file in WRITTEN] == before
