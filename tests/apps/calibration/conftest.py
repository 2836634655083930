"""Fixtures for calibration tests: a parametric arm and its measurements."""

from functools import cache

import pytest

from chasles.derive import read
from tests.support.compiling import IDENTIFICATION, compiled
from tests.support.derivations import description
from tests.support.measured_arms import drawn


@pytest.fixture(scope="session")
def loaded(tmp_path_factory):
    @cache
    def by_name(name):
        folder = tmp_path_factory.mktemp("parametric") / name
        return compiled(read(description(name)), folder, IDENTIFICATION, ["c"])

    return by_name


@pytest.fixture(scope="session")
def arm(loaded):
    return loaded("ur5e")


@pytest.fixture
def truth(arm, request):
    """Return an arm with errors of up to 1 mm and 1 mrad, and 60 configurations."""
    return drawn(arm, getattr(request, "param", 0))
