"""A failed allocation of compiled code raises a MemoryError, and later calls work."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.tools import needs

SUPPORT = Path(__file__).parents[2] / "support"

pytestmark = [
    needs("gcc"),
    pytest.mark.skipif(sys.platform != "linux", reason="LD_PRELOAD needs Linux"),
]


def test_each_failed_allocation_is_a_memory_error(tmp_path):
    library = tmp_path / "failing_allocations.so"
    source = SUPPORT / "native" / "failing_allocations.c"
    subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "-o", library, source], check=True)
    settings = {"LD_PRELOAD": str(library), "PYTHONMALLOC": "malloc"}
    command = [sys.executable, "-m", "tests.support.failing_allocations"]
    pipes = {"capture_output": True, "text": True, "cwd": SUPPORT.parents[1]}
    done = subprocess.run(command, env={**os.environ, **settings}, check=True, **pipes)
    found = json.loads(done.stdout)
    assert len(found) > 10
    assert all(set(ends) == {"MemoryError"} for ends in found.values()), found
