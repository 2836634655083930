"""Compiled IK functions return NaN for NaN targets, in scalar code and in vector code."""

import numpy as np
import pytest

import chasles
from tests.support.compiling import compiled
from tests.support.derivations import robot_of

NAMES = ("scara", "bricklaying_planar")
"""Arms for which some joints affect only the position, and other joints only the orientation."""


@pytest.fixture(scope="module", params=NAMES)
def robot(request, tmp_path_factory):
    if request.param != "scara":
        return chasles.load(request.param)
    folder = tmp_path_factory.mktemp("generated") / request.param
    return compiled(robot_of(request.param), folder, ["fk", "ik"], ["c"])


@pytest.mark.parametrize("count", [1, 64])
def test_pose_with_nan_entry_has_no_valid_slot(robot, count):
    q = np.random.default_rng(0).uniform(-0.1, 0.1, (count, robot.n))
    T = robot.fk(q)
    assert robot.ik(T).valid.any(axis=-1).all()
    for row in range(3):
        for column in range(4):
            broken = T.copy()
            broken[:, row, column] = np.nan
            assert not robot.ik(broken).valid.any()
            if count == 1:
                assert not robot.ik(broken[0]).valid.any()
