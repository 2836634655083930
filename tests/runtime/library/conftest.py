"""Derives robots on first use without a separate compiler process."""

import pytest

from tests.support import compiling


@pytest.fixture(scope="session")
def compiler_in_process():
    return compiling.compiler_in_process()
