"""Fixtures for several tests of the tables of papers."""

import board_installer
import pytest

from tests.support.compiling import deriving_only, own_robots_compiled_quickly


@pytest.fixture(autouse=True)
def own_robots():
    with own_robots_compiled_quickly(), deriving_only():
        yield


@pytest.fixture(scope="session")
def length_errors():
    """Returns the board installer with each length 0.1 mm too long."""
    with deriving_only():
        return board_installer.errors()
