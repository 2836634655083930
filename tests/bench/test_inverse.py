"""The benchmarks of inverses do the work that they time."""

import numpy as np
import pytest

import chasles
from bench.measures import inverse
from bench.native.kernel import ROOM, kernel
from bench.report import Plan
from tests.support.tolerances import AGREEMENT


@pytest.mark.parametrize("name", inverse.IN_C)
@pytest.mark.parametrize("flags", [(), inverse.AVX2], ids=["native", "avx2"])
def test_kernel_solves_as_python_does(name, flags):
    if flags and not inverse.has_avx2():
        pytest.skip("a processor without AVX2")
    T = inverse.poses(name, 20)
    robot, alone = chasles.load(name), kernel(chasles.load(name), "ik", flags)
    checked = 0
    for pose, solutions in zip(T, robot.ik(T).q, strict=True):
        alone.run(np.ascontiguousarray(pose.reshape(1, 16)))
        found = alone.results[0, : solutions.size].reshape(solutions.shape)
        assert np.abs(np.exp(1j * found) - np.exp(1j * solutions)).max() <= AGREEMENT
        assert alone.results.shape == (3, ROOM)
        checked += 1
    assert checked == 20


def test_every_peer_is_timed():
    plan = Plan(rounds=1, calls=500, batch=1000)
    found = [*inverse.calls(plan, "ur5e"), *inverse.batches(plan, "ur5e")]
    peers = {peer.name for peer in inverse.inverses(inverse.screws("ur5e"))}
    assert {row.key.rpartition(": ")[2] for row in found} == peers
    assert len(found) == 2 * len(peers)
    assert all(row.own > 0 and row.peer > 0 for row in found)
