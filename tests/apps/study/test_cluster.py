"""Studies on a local cluster give bitwise equal results, even after a worker is killed."""

import os
import signal
import threading

import numpy as np
import pytest

import chasles
from chasles.study import reach, uniform_orientations, workspace
from chasles.study.samples import PIECE
from tests.support.optional import OptionalPackage

dask, distributed = OptionalPackage("dask"), OptionalPackage("distributed")
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]


@pytest.fixture(scope="module")
def client():
    """Return a client of two worker processes, forked from a server that has imported Dask."""
    with (
        dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_workspace_on_cluster_is_bitwise_equal(client):
    robot = chasles.load("scara")
    count = 3 * PIECE + 77
    here = workspace(robot, count, resolution=50, quality=("directions",), threads=1)
    there = workspace(robot, count, resolution=50, quality=("directions",), client=client)
    assert np.array_equal(here.hits, there.hits)
    assert np.array_equal(here.directions, there.directions)
    assert here.size == there.size


def test_workspace_is_bitwise_equal_for_any_worker_and_thread_count():
    robot, count = chasles.load("scara"), 2 * PIECE + 77
    quality = ("limit_margin", "directions")
    here = workspace(robot, count, resolution=30, quality=quality, threads=1)
    with (
        distributed.LocalCluster(
            n_workers=5, threads_per_worker=1, processes=False, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert len(cluster.workers) == 5
        there = workspace(robot, count, resolution=30, quality=quality, threads=2, client=client)
    for name in ("hits", *quality, "bounds"):
        assert np.array_equal(getattr(here, name), getattr(there, name)), name
    assert here.size == there.size


def test_reach_on_cluster_equals_local_result(client):
    robot = chasles.load("ur5e")
    places = np.random.default_rng(1).uniform(-1, 1, (500, 3))
    here, there = (
        reach(robot, places, uniform_orientations(5)),
        reach(robot, places, uniform_orientations(5), client=client),
    )
    assert np.array_equal(here.n_solutions, there.n_solutions)


def test_killed_worker_does_not_change_result(client):
    robot = chasles.load("scara")
    count = 16 * PIECE
    expected = workspace(robot, count, resolution=50, threads=1)
    pids, killed, done = client.run(os.getpid), [], threading.Event()

    def kill_busy_worker():
        while not killed and not done.is_set():
            busy = [address for address, tasks in client.processing().items() if tasks]
            for address in busy[:1]:
                os.kill(pids[address], signal.SIGKILL)
                killed.append(pids[address])

    killer = threading.Thread(target=kill_busy_worker)
    killer.start()
    try:
        found = workspace(robot, count, resolution=50, threads=1, client=client)
    finally:
        done.set()
        killer.join()
    assert killed
    assert killed[0] not in client.run(os.getpid).values()
    assert np.array_equal(found.hits, expected.hits)
