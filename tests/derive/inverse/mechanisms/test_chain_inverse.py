"""Inverse kinematics of robots with loops whose main chain is a general arm."""

from pathlib import Path

import numpy as np
import pytest

from chasles.derive import derive, explain, read
from tests.support.compiling import compiled

FILE = Path(__file__).with_name("skew_boom.toml")
POSES = 300


@pytest.fixture(scope="module")
def boom(tmp_path_factory):
    return compiled(read(FILE), tmp_path_factory.mktemp("boom"), ["fk", "ik", "chain"], ["c"])


@pytest.fixture(scope="module")
def solutions(boom):
    rng = np.random.default_rng(0)
    q = np.array([boom.random_q(rng=rng) for _ in range(POSES)])
    T = boom.fk(q)
    return q, T, boom.ik(T)


def test_ik_recovers_generating_configuration_of_general_chain(solutions):
    q, _, found = solutions
    apart = np.abs(np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi).max(-1)
    assert (np.where(found.valid, apart, np.inf).min(-1) < 1e-6).all()


def test_valid_slots_reach_the_pose(boom, solutions):
    _, T, found = solutions
    target = np.broadcast_to(T[:, None], (*found.valid.shape, 4, 4))[found.valid]
    np.testing.assert_allclose(boom.fk(found.q[found.valid]), target, atol=1e-9)


def test_valid_slots_differ(solutions):
    _, _, found = solutions
    for q in (rows[valid] for rows, valid in zip(found.q, found.valid, strict=True)):
        apart = np.abs(np.remainder(q[:, None] - q + np.pi, 2 * np.pi) - np.pi).max(-1)
        assert (apart[~np.eye(len(q), dtype=bool)] > 1e-7).all()


def test_explanation_names_the_method_and_the_slots():
    found = explain(read(FILE))
    assert found.max_solutions == 16
    assert "by the roots of a determinant" in str(found)
    assert "The actuators follow from the main chain in closed form" in str(found)


def test_inverse_calls_chain_actuators_and_forward_kinematics():
    (chain, ik) = derive(read(FILE), functions=["ik"]).written
    assert (chain.name, ik.name) == ("ik_chain", "ik")
    assert ik.calls == ("ik_chain", "actuators_all", "fk")
