"""The all-branch function rejects inconsistent values of redundant joints."""

import numpy as np
import pytest

from chasles.derive import derive
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.drawn_mechanisms import drawn_mechanism
from tests.support.loops.mechanisms import delta, rsur
from tests.support.loops.solved import solved
from tests.support.oracles.multi_start import Multistart

OFF = 1e-4
"""Deviation (radian, or relative to the size) above rounding error, but too small to
be visible in a drawing."""
FAMILIES = {"four-bar": 0, "Watt": 2, "parallelograms": 7}


def every_actuator(mechanism):
    (function,) = derive(mechanism, functions=["actuators_all"]).functions
    (kernel,) = lower([function], mechanism.name)
    shape = function.outputs[0].shape
    return lambda theta: np.array(kernel(theta)[0]).reshape(shape)


@pytest.mark.parametrize("seed", FAMILIES.values(), ids=list(FAMILIES))
def test_inconsistent_chain_joints_give_nan_actuators(seed):
    drawn = drawn_mechanism(seed)
    numbers = Multistart(drawn.mechanism)
    assert len(numbers.chain) > len(numbers.actuated)
    actuators = every_actuator(drawn.mechanism)
    rng = np.random.default_rng(seed)
    q = np.vstack([drawn.q, numbers.random_q(rng, 6)])
    checked = 0
    for row, modes in zip(q, numbers.modes(q, numbers.actuated), strict=True):
        for mode in modes:
            theta = np.array([mode[name] for name in numbers.chain])
            found = actuators(theta)
            apart = numbers.wrapped(numbers.actuated, found - row)
            assert np.nanmin(np.abs(apart).max(-1)) < 1e-9
            aside = theta + OFF * numbers.scales(numbers.chain) * rng.choice((-1, 1), len(theta))
            left = numbers.residual(
                mode | dict(zip(numbers.chain, aside, strict=True)), [*numbers.chain]
            )
            if left > OFF / 10:
                assert np.isnan(actuators(aside)).all()
                checked += 1
    assert checked > 5


def test_inconsistent_universal_joint_angles_give_nan_actuators():
    mechanism = rsur()
    at = solved(mechanism).at_reference
    actuators = every_actuator(mechanism)
    theta = np.array([at[name] for name in ("rocker", "yoke", "swing")])
    assert np.nanmin(np.abs(actuators(theta) - at["crank"])) < 1e-12
    for k in range(3):
        assert np.isnan(actuators(theta + OFF * np.eye(3)[k])).all()


def test_rotated_delta_platform_gives_nan_actuators():
    actuators = every_actuator(delta())
    theta = np.array([0.01, 0.02, -0.7, 0, 0, 0])
    assert np.isfinite(actuators(theta)).all()
    for k in range(3, 6):
        assert np.isnan(actuators(theta + OFF * np.eye(6)[k])).all()


def test_independent_chain_joints_always_give_actuators():
    drawn = drawn_mechanism(8)
    theta = np.random.default_rng(0).uniform(-np.pi, np.pi, (20, 2))
    actuators = every_actuator(drawn.mechanism)
    assert all(np.isfinite(actuators(row)).any() for row in theta)
