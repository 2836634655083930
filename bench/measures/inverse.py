"""Times of the inverse kinematics with all solutions, in Python, in batches and in C."""

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import read, write
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.screws import ROBOTS, screws
from tests.support.peers.interface import Inverse, inverses
from tests.support.peers.interface import absent as absent_peers

from ..agreement import CONFIGURATIONS, require_same
from ..cores import one_core
from ..native.kernel import kernel
from ..report import Limit, Plan, Ratio, alternated, out, ratio, seconds
from .one_call import VECTORS, repeated

OWN = "chasles"
ARMS = ("ur5e", "puma560", "irb6640")
IN_C = ("ur5e", "puma560")
CALL_BAR, BATCH_BAR, GENERAL_BAR = 6.0, 50.0, 3.0
SLOW = "ssik"
"""Slow library."""
C_BAR_NS = 150
AVX2 = ("-march=x86-64", "-mavx2", "-mfma")
DERIVED_BAR_S = 10.0
ERRORS = 1e-3
"""Geometry errors of a calibrated arm [m, rad]."""
CALIBRATED, ROUNDS = 1000, 4
CALIBRATED_BAR_US, CALIBRATED_BATCH_US = 50.0, 2.0
BATCH = 100_000
PEERS_BATCH = 2_000
"""Number of poses in the batch for other libraries.

The time of these libraries per pose does not depend on the number of poses.
"""
GENERAL = "jaco2"


def run(plan: Plan) -> list[Ratio | Limit]:
    """Return times relative to other libraries, times of the C code, and derivation times."""
    with one_core():
        found: list[Ratio | Limit] = []
        for name in ARMS:
            found += [*calls(plan, name), *batches(plan, name)]
        return [*found, *general(plan), *calibrated(plan), *in_C(plan), derived()]


def poses(name: str, count: int) -> np.ndarray:
    """Return random reachable poses (count, 4, 4)."""
    robot = chasles.load(name)
    return robot.fk(np.random.default_rng(0).uniform(-np.pi, np.pi, (count, robot.n)))


def peers(name: str) -> list[Inverse]:
    """Return the inverse kinematics of a robot in all other libraries.

    Each library must return as many solutions as chasles, and each solution must reach its pose.

    Raises:
        DisagreementError: A library misses a solution or returns a wrong solution.
    """
    robot, found, T = chasles.load(name), inverses(screws(name)), poses(name, CONFIGURATIONS)
    for peer in found:
        for pose, valid in zip(T, robot.ik(T).valid, strict=True):
            q, claimed = map(np.asarray, peer.found(pose))
            expected = np.broadcast_to(pose, (np.count_nonzero(valid), 4, 4))
            reached = robot.fk(q[claimed.astype(bool)])
            require_same(f"{peer.name} for {name}", (reached,), (expected,))
    return found


def calls(plan: Plan, name: str) -> list[Ratio]:
    """Compare calls of ik for a single pose with other libraries.

    Each call returns all solutions for the pose.
    """
    T = poses(name, VECTORS)
    repeats = max(plan.calls // VECTORS, 1)
    works = {OWN: repeated(chasles.load(name).ik, T, repeats)}
    for peer in peers(name):
        works[peer.name] = repeated(peer.call, peer.prepare(T), repeats)
    return _ratios(f"python {name} ik", works, plan, CALL_BAR, VECTORS * repeats)


def batches(plan: Plan, name: str) -> list[Ratio]:
    """Compare ik of a batch on one thread with other libraries.

    Other libraries solve only PEERS_BATCH poses. The times of other libraries are scaled to the
    number of poses that chasles solves.
    """
    T = poses(name, min(plan.batch, BATCH))
    some = T[: min(PEERS_BATCH, len(T))]
    robot = chasles.load(name)
    results = robot.ik(T)
    there = (results.q, results.residual, results.margin)
    found = []
    for peer in peers(name):
        prepared = peer.prepare(some)
        works = {
            OWN: lambda: robot.ik(T, out=there),
            peer.name: lambda peer=peer, prepared=prepared: peer.batch(prepared),
        }
        times = alternated(works, plan.rounds)
        times[peer.name] = [len(T) / len(some) * taken for taken in times[peer.name]]
        key, bar = f"batch {name} ik: {peer.name}", _bar(peer.name, BATCH_BAR)
        found.append(ratio(key, times, (OWN, peer.name), len(T), bar))
    return found


def _ratios(
    key: str, works: dict[str, Callable[[], object]], plan: Plan, bar: float, count: int
) -> list[Ratio]:
    times = alternated(works, plan.rounds)
    return [
        ratio(f"{key}: {name}", times, (OWN, name), count, _bar(name, bar))
        for name in works
        if name != OWN
    ]


def _bar(name: str, bar: float) -> float | None:
    return None if name == SLOW else bar


def general(plan: Plan) -> list[Ratio]:
    """Compare an arm without a closed-form structure with the arm's module in ssik.

    The arm model of ssik has rounded lengths, so its tool poses differ from the poses of chasles by
    up to 0.1 mm. Therefore, each library solves tool poses that its own forward kinematics
    computed.
    """
    if SLOW in absent_peers() or GENERAL not in chasles.robots():
        out.print(f"{GENERAL} or {SLOW} is missing: no comparison for a general arm")
        return []
    from ssik.prebuilt import jaco2_ik  # noqa: PLC0415

    robot = chasles.load(GENERAL)
    count = min(plan.calls // 10, VECTORS)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (count, robot.n))
    theirs = np.array([jaco2_ik.fk(row) for row in q])
    solve = partial(jaco2_ik.solve, respect_limits=False)
    works = {OWN: repeated(robot.ik, robot.fk(q), 1), SLOW: repeated(solve, theirs, 1)}
    times = alternated(works, plan.rounds)
    return [ratio(f"python {GENERAL} ik: {SLOW}", times, (OWN, SLOW), count, GENERAL_BAR)]


def calibrated(plan: Plan) -> list[Limit]:
    """Single calls for an arm with geometry errors. Some poses are near singularities."""
    robot = displaced(read(ROBOTS / f"{ARMS[0]}.toml"), ERRORS)
    with tempfile.TemporaryDirectory() as folder:
        write(robot, Path(folder) / robot.name, functions=("fk", "fk_jacobian_mixed", "ik"))
        arm = chasles.load(Path(folder) / robot.name)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (CALIBRATED, arm.n))
    T = arm.fk(q)
    # The minimum over several rounds excludes delays by other processes.
    rounds = [[seconds(partial(arm.ik, pose)) for pose in T] for _ in range(ROUNDS)]
    middle, late = 1e6 * np.quantile(np.min(rounds, axis=0), [0.5, 0.99])
    (batch,) = alternated({OWN: partial(arm.ik, T)}, plan.rounds).values()
    key = f"{ARMS[0]} calibrated ik"
    return [
        Limit(f"{key}, one call, median", float(middle), "us", CALIBRATED_BAR_US),
        Limit(f"{key}, one call, 99th percentile", float(late), "us", CALIBRATED_BAR_US),
        Limit(f"{key}, batch, a pose", min(batch) / len(T) * 1e6, "us", CALIBRATED_BATCH_US),
    ]


def in_C(plan: Plan) -> list[Limit]:
    """Measure the time per pose to compute all inverse solutions in C.

    The C code is compiled for AVX2 without AVX-512.
    """
    if not has_avx2():
        out.print("the processor has no AVX2: the inverse in C is not timed")
        return []
    found = []
    for name in IN_C:
        robot = chasles.load(name)
        work = kernel(robot, "ik", AVX2)
        for pose in poses(name, CONFIGURATIONS):
            (q, *in_c), (own_q, *own, _) = work.at(pose), robot.ik(pose)
            results, expected = (np.exp(1j * q), *in_c), (np.exp(1j * own_q), *own)
            require_same(f"{name} ik, C with AVX2", results, expected)
        repeats = max(plan.calls // VECTORS, 1)
        T = np.tile(poses(name, VECTORS).reshape(-1, 16), (repeats, 1))
        (taken,) = alternated({OWN: partial(work.run, T)}, plan.rounds).values()
        found.append(Limit(f"{name} ik, C with AVX2", min(taken) / len(T) * 1e9, "ns", C_BAR_NS))
    return found


def has_avx2() -> bool:
    """Return whether /proc/cpuinfo lists AVX2."""
    facts = Path("/proc/cpuinfo")
    return facts.exists() and " avx2 " in facts.read_text(encoding="utf-8")


def derived() -> Limit:
    """Return the time to derive an inverse kinematics function and to write its C and LaTeX."""
    with tempfile.TemporaryDirectory() as folder:
        path = ROBOTS / f"{ARMS[0]}.toml"
        taken = seconds(lambda: write(read(path), Path(folder), functions=("fk", "ik")))
    return Limit(f"{ARMS[0]} ik, derived and written", taken, "s", DERIVED_BAR_S)
