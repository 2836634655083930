"""One Chromium browser for all tests of a process."""

import pytest

from tests.support.tools import path_of


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Start a Chromium with software rendering, or skip tests without Chromium."""
    program = path_of("chromium")
    pytest.importorskip("websockets", reason="websockets comes with viser, which is not installed")
    from tests.support.chromium import Chromium

    found = Chromium(program, tmp_path_factory.mktemp("chromium"))
    yield found
    found.close()
