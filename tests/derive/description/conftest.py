"""Reads robot files in the test process."""

import pytest

from chasles.derive.description.importers import chains

ISOLATED = {"test_crafted_corpus", "test_crafted_files", "test_known_files", "test_checking"}
"""Modules that read files in a separate process, as users do."""


@pytest.fixture(autouse=True)
def read_here(request, monkeypatch):
    """Reads files without a separate process, except in the modules ISOLATED.

    A test process holds many derived robots, and its fork takes 0.1 s. ISOLATED modules and
    test_isolation.py check the separate process and its limits.
    """
    if request.module.__name__.rsplit(".")[-1] not in ISOLATED:
        monkeypatch.setattr(chains, "isolated", lambda work, limits: work())
