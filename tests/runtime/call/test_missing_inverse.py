"""The message for a coupled arm without inverse names other functions that solve the task."""

import numpy as np
import pytest

import chasles
from chasles.derive import read_text
from tests.support.compiling import compiled
from tests.support.palletizer import PALLETIZER


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    text = PALLETIZER.replace("[couplings]", "tool = { xyz = [0.1, 0, 0] }\n[couplings]")
    return compiled(read_text(text), tmp_path_factory.mktemp("arm"), None, ["c"])


def test_message_names_inverses_and_no_map_from_joints_to_motors(arm):
    with pytest.raises(chasles.MissingFunctionError) as raised:
        _ = arm.ik_position
    instead = str(raised.value).partition("nearest functions")[0]
    assert "ik, which takes a pose; ik_numeric, which finds one solution" in instead
    assert "task_weights= leaves components of the pose free" in instead
    assert "actuators" not in instead
    assert "--fixed" not in instead


def test_named_method_reaches_the_position(arm):
    T = arm.fk([0.3, -0.4, 0.6, 0.2])
    turned = T @ chasles.se3.exp([0, 0, 0, 0.2, 0, 0])
    found = arm.ik_numeric(turned, task_weights=[1, 1, 1, 0, 0, 0], frame="base")
    assert found.valid
    np.testing.assert_allclose(arm.fk(found.q)[:3, 3], T[:3, 3], atol=1e-9)
