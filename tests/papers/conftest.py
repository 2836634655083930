"""Fixtures for the tests of the paper tables."""

import board_installer
import pytest

from tests.support.compiling import deriving_only


@pytest.fixture(autouse=True)
def few_functions():
    with deriving_only():
        yield


@pytest.fixture(scope="session")
def length_errors():
    """Return the tool errors of the board installer for an error of 0.1 mm in each length."""
    with deriving_only():
        return board_installer.errors()
