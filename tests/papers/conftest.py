"""What several tests of the papers' pages need."""

import board_installer
import pytest

from tests.support.compiling import compiled_quickly


@pytest.fixture(scope="session")
def length_errors():
    """The board installer with each length 0.1 mm too long; its kernels take a minute at -O3."""
    with compiled_quickly():
        return board_installer.errors()
