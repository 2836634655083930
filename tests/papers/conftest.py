"""Fixtures for several tests of the paper pages."""

import board_installer
import pytest

from tests.support.compiling import BOARD, compiled_quickly, own_robots_compiled_quickly
from tests.support.locking import locked


@pytest.fixture(autouse=True)
def own_robots():
    """Compiles the robots of the papers with fast compiler flags."""
    with own_robots_compiled_quickly():
        yield


@pytest.fixture(scope="session")
def length_errors():
    """The board installer with each length 0.1 mm too long; its functions take a minute at -O3."""
    with compiled_quickly(), locked(BOARD):
        return board_installer.errors()
