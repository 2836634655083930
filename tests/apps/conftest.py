"""Fast compilation of robots that are not shipped."""

import pytest

from tests.support.compiling import own_robots_compiled_quickly


@pytest.fixture(scope="module", autouse=True)
def own_robots():
    with own_robots_compiled_quickly():
        yield
