"""The command `chasles actuators` reports joint values at which the loops cannot close."""

import json

import numpy as np
import pytest

import chasles
from tests.support.command_line import run
from tests.support.loops.loader_arm import LOADER, TWIN

OPEN = [2.2, -2.1]


@pytest.fixture(scope="module")
def loader(tmp_path_factory):
    return _written(tmp_path_factory.mktemp("one"), LOADER)


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    """A loader (a bucket on a lift arm) with two lift cylinders for one degree of freedom."""
    return _written(tmp_path_factory.mktemp("two"), TWIN)


def _written(folder, text):
    path = folder / "loader.toml"
    path.write_text(text)
    return path, chasles.load(path)


def test_chain_closes_agrees_with_iterated_forward_kinematics(loader):
    _, arm = loader
    theta = arm.chain(arm.random_q(100, rng=0))
    assert arm.chain_closes(theta).all()
    assert not arm.chain_closes(theta + np.array([0, 0.01])).any()
    np.testing.assert_array_equal(arm.chain_closes([OPEN, [np.nan, 0.0]]), False)
    assert np.isnan(arm.actuator_branches(OPEN).q).all()


def test_chain_closes_without_forward_kinematics(twin):
    _, arm = twin
    assert "fk" not in arm.functions
    closed = arm.reference.z[:2]
    np.testing.assert_array_equal(arm.chain_closes([closed, OPEN]), [True, False])
    np.testing.assert_array_equal(arm.actuator_branches([closed, OPEN]).valid, [[True], [False]])


@pytest.mark.parametrize("name", ["loader", "twin"])
def test_open_loop_is_stated_with_exit_status(name, request):
    path, arm = request.getfixturevalue(name)
    closed = run("actuators", path, "--theta", _stated(arm, arm.reference.z[:2]), "--json")
    assert (closed.exit_code, closed.stderr) == (0, "")
    assert json.loads(closed.stdout)["actuators"]["lift"] == pytest.approx(0.765, abs=1e-9)
    done = run("actuators", path, "--theta", _stated(arm, OPEN))
    assert done.exit_code == 1
    assert done.stderr.startswith("the loops do not close at these joints")


def test_all_joints_are_required_without_forward_kinematics(twin):
    done = run("actuators", twin[0], "--theta", "rear=2")
    assert "loader: --theta requires all joints of the main chain: rear, arm" in done.output


def _stated(arm, theta):
    return ",".join(f"{one.name}={x}" for one, x in zip(arm.chain_joints, theta, strict=True))
