"""Every peer of the benchmarks computes the same poses and Jacobians as we do."""

import numpy as np
import pytest

import chasles
from bench.cases.arms import ARMS
from bench.peers.forward import INSTALL, SLOW_TO_BUILD, absent, is_built, setups
from tests.support.tolerances import AGREEMENT

POSES = 20
CASES = [(arm, peer) for arm in ARMS for peer in INSTALL]
IDS = [f"{arm.name}-{peer}" for arm, peer in CASES]
MISSING = absent()


def found(kind, arm, peer):
    """The set-ups of a peer, or a skip that tells why there are none."""
    if peer in MISSING:
        pytest.skip(f"not installed: pip install {MISSING[peer]}")
    if peer in SLOW_TO_BUILD and not is_built(peer):
        pytest.skip("takes long to compile; `make bench` does it once")
    return setups(kind, arm, only=(peer,))


def expected(arm):
    q = np.random.default_rng(5).uniform(-np.pi, np.pi, (POSES, arm.joints))
    return q, *chasles.load(arm.name).fk_jacobian_mixed(q)


def close(*pairs):
    for result, wanted in pairs:
        assert np.shape(result) == np.shape(wanted)
        assert np.abs(np.asarray(result) - wanted).max() <= AGREEMENT


@pytest.mark.parametrize(("arm", "peer"), CASES, ids=IDS)
def test_peer_agrees(arm, peer):
    checked = 0
    for call in found("calls", arm, peer):
        for q, T, J in zip(*expected(arm), strict=True):
            close(*zip(call.read(call.fk(q)), (T,), strict=True))
            close(*zip(call.read(call.fk_jacobian(q)), (T, J), strict=True))
        checked += 1
    for loop in found("loops", arm, peer):
        q, T, J = expected(arm)
        poses, both = np.zeros_like(T), np.zeros_like(T)
        jacobians = np.zeros((POSES, arm.joints, 6) if loop.by_columns else J.shape)
        loop.fk(q, poses)
        loop.fk_jacobian(q, both, jacobians)
        close((poses, T), (both, T))
        close((jacobians.transpose(0, 2, 1) if loop.by_columns else jacobians, J))
        checked += 1
    for batch in found("batches", arm, peer):
        q, T, J = expected(arm)
        close((batch.fk(q), T), *zip(batch.fk_jacobian(q), (T, J), strict=True))
        checked += 1
    assert checked
