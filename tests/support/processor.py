"""Features of this processor, such as avx2."""

from collections.abc import Iterable
from pathlib import Path

import pytest


def features() -> set[str]:
    """The features of the processor, as Linux lists them; none on other systems."""
    path = Path("/proc/cpuinfo")
    return set(path.read_text(encoding="utf-8").split()) if path.exists() else set()


def require_features(needed: Iterable[str]) -> None:
    """Skips the test if the processor lacks a feature."""
    missing = set(needed) - features()
    if missing:
        pytest.skip(f"this processor has no {', '.join(sorted(missing))}")
