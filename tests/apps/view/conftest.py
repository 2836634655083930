"""One Chromium browser for all tests of a process, and fast compilation of robots."""

import pytest

from tests.support.compiling import own_robots_compiled_quickly
from tests.support.tools import path_of


@pytest.fixture(scope="module", autouse=True)
def own_robots():
    with own_robots_compiled_quickly():
        yield


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Starts a Chromium with software rendering, or skips tests without Chromium."""
    program = path_of("chromium")
    pytest.importorskip("websockets", reason="websockets comes with viser, which is not installed")
    from tests.support.chromium import Chromium

    found = Chromium(program, tmp_path_factory.mktemp("chromium"))
    yield found
    found.close()
