"""Features of the current processor, such as avx2."""

from collections.abc import Iterable
from pathlib import Path

import pytest


def features() -> set[str]:
    """Return the processor features that Linux lists."""
    path = Path("/proc/cpuinfo")
    return set(path.read_text(encoding="utf-8").split()) if path.exists() else set()


def require_features(needed: Iterable[str]) -> None:
    """Skip the test if the processor lacks a feature."""
    missing = set(needed) - features()
    if missing:
        pytest.skip(f"this processor has no {', '.join(sorted(missing))}")
