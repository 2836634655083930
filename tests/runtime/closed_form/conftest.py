"""The arm of `tests/support/displaced_arm.py`, derived and compiled once for several test files."""

import pytest

from chasles.derive import read
from tests.support.compiling import compiled
from tests.support.derivations import description
from tests.support.displaced_arm import SEED, SIZE
from tests.support.generators.geometric_errors import displaced


@pytest.fixture(scope="session")
def displaced_robot():
    return displaced(read(description("irb120")), SIZE, SEED)


@pytest.fixture(scope="session")
def displaced_arm(displaced_robot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("displaced") / displaced_robot.name
    functions = ("fk", "fk_jacobian_mixed", "ik")
    return compiled(displaced_robot, folder, functions, ["c", "casadi"])
