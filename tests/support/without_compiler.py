"""Starts Python as on a machine without a C compiler."""

import os
import subprocess
import sys
from pathlib import Path


def started(code: str, *words: object, cache: Path, path: Path | None = None):
    """Run Python code without a compiler on PATH."""
    env = {k: v for k, v in os.environ.items() if k not in ("CC", "CHASLES_CFLAGS")}
    env |= {"PATH": "/nonexistent", "CHASLES_CACHE": str(cache)}
    env |= {"PYTHONPATH": str(path)} if path else {}
    command = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, env=env, check=False)
