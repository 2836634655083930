"""Ctrl-C and other signals end a long batch early."""

import signal
import subprocess
import sys

import numpy as np
import pytest

import chasles
from tests.support.waiting import SECONDS

INTERRUPTED = """
import os, signal, sys, threading, time
import numpy as np, chasles
# A shell starts background commands with SIGINT ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
arm = chasles.load("ur5e")
n = 600_000
T = arm.fk(np.random.default_rng(0).uniform(-3, 3, (n, 6)))
results = np.full((n, 8, 6), np.nan)
def interrupt():
    while np.isnan(results[:1000]).all(axis=(1, 2)).any():
        time.sleep(0.0001)
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt, daemon=True).start()
try:
    arm.ik(T, out=(results, *np.empty((2, n, 8))), threads=int(sys.argv[1]))
except KeyboardInterrupt:
    print("stopped", np.isnan(results).mean())
"""


@pytest.mark.parametrize("threads", [1, 2])
def test_interrupt_stops_batch_early(threads):
    command = [sys.executable, "-c", INTERRUPTED, str(threads)]
    finished = subprocess.run(command, capture_output=True, text=True, check=True, timeout=SECONDS)
    said, missing = finished.stdout.split()
    assert said == "stopped"
    assert float(missing) > 0.5


ROWS = 100_000
CHECKS = 80
"""Number of signals after which the signal handler raises an error."""


class Stopped(Exception):
    """Error that the signal handler raises for the last signal."""


@pytest.fixture
def stop_signal():
    """Send signals at short intervals."""
    handled = []

    def handle(*_):
        handled.append(None)
        if len(handled) == CHECKS:
            raise Stopped

    former = signal.signal(signal.SIGALRM, handle)
    yield lambda: signal.setitimer(signal.ITIMER_REAL, 1e-4, 1e-4)
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, former)


@pytest.mark.skipif(sys.platform == "win32", reason="interval timers of POSIX")
@pytest.mark.parametrize(
    "method",
    ["joint_rates", "manipulability_gradient", "sorted_by_distance", "within_limits", "track"],
)
def test_signals_are_handled_during_long_call(method, stop_signal):
    arm, rng = chasles.load("ur5e"), np.random.default_rng(42)
    q, V = rng.uniform(-2, 2, (2, ROWS, 6))
    path = arm.fk(arm.q_reference + np.linspace(0, 0.5, ROWS)[:, None])
    slots, limits = arm.ik(arm.fk(q)), np.tile([-np.inf, np.inf], (6, 1))
    limits[0] = -20, 20
    calls = {
        "joint_rates": lambda: arm.joint_rates(q, V),
        "manipulability_gradient": lambda: arm.manipulability_gradient(q),
        "sorted_by_distance": lambda: slots.sorted_by_distance(q),
        "within_limits": lambda: slots.within_limits(limits),
        "track": lambda: arm.track(path, arm.q_reference, dt=0.01),
    }
    stop_signal()
    with pytest.raises(Stopped):
        calls[method]()
