"""Studies on a cluster of local processes: the same bits as here, also after a killed worker."""

import os
import signal
import threading

import numpy as np
import pytest

import chasles
from chasles.study import evenly, reach, workspace
from chasles.study.samples import PIECE

distributed = pytest.importorskip("distributed", reason="dask is in the extra `test`")
pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]


@pytest.fixture(scope="module")
def client():
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_workspace(client):
    robot = chasles.load("scara")
    count = 130 * PIECE + 77
    here = workspace(robot, count, finest=50, quality=("directions",), threads=1)
    there = workspace(robot, count, finest=50, quality=("directions",), client=client)
    assert np.array_equal(here.hits, there.hits)
    assert np.array_equal(here.directions, there.directions)
    assert here.measure == there.measure


def test_reach(client):
    robot = chasles.load("ur5e")
    places = np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    here, there = reach(robot, places, evenly(5)), reach(robot, places, evenly(5), client=client)
    assert np.array_equal(here.solutions, there.solutions)


def test_a_killed_worker(client):
    robot = chasles.load("scara")
    count = 260 * PIECE
    expected = workspace(robot, count, finest=50, threads=1)
    pid = next(iter(client.run(os.getpid).values()))
    killer = threading.Timer(0.5, os.kill, (pid, signal.SIGKILL))
    killer.start()
    found = workspace(robot, count, finest=50, threads=1, client=client)
    killer.join()
    assert pid not in client.run(os.getpid).values()
    assert np.array_equal(found.hits, expected.hits)
