"""Fast compilation: the code of the campaign tests runs only once."""

import pytest

from tests.support.compiling import own_robots_compiled_quickly


@pytest.fixture(autouse=True)
def quickly():
    with own_robots_compiled_quickly():
        yield
