"""``python -m bench field``: arms of the field, each derived, judged and timed beside ssik.

For each arm: random poses and poses at right angles, all reachable. A pose is missed if no claimed
solution reaches it, an answer is wrong if it is claimed and does not reach its pose, and random
coordinates are lost if they are regular and not among the solutions. ssik solves some of the same
poses. Redundant arms are asked with the given value at which the coordinates are a solution; ssik
chooses this value itself.
"""

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bench.cores import one_core
from bench.report import out, save, seconds, table, text
from tests.support.generators.field_arms import FieldArm, FieldCase, arms, derived, prebuilt
from tests.support.generators.poses import PoseSet
from tests.support.oracles.verdict import Verdict, judged
from tests.support.peers.interface import Answers, gathered

SIX = 6
MICRO = 1e6
QUARTER = np.pi / 2
CALLS = 200
"""Poses that are timed one by one."""
PEER_CALLS = 50
BATCH = 20_000
ROUNDS = 3
COLUMNS = (
    *("arm", "tier", "derive s", "missed", "wrong", "lost", "right missed", "wrong"),
    *("us", "p99", "batch", "ssik us", "ratio", "ssik missed", "lost", "right missed"),
)
RESULT = "field"


@dataclass(frozen=True)
class Row:
    """What was found for an arm; times in microseconds a pose, None where there is no inverse.

    Attributes:
        arm: Its name.
        tier: How its inverse is solved, or why there is none.
        derived: Processor time of the derivation with everything it writes [s].
        random: The verdict on random poses.
        right: The verdict on poses at right angles.
        single: Median time of a call with one pose.
        slowest: The 99th percentile of these times.
        batch: Time of a pose in a batch on one thread.
        peer: Median time of ssik's call.
        peer_random: The verdict on ssik at random poses.
        peer_right: The verdict on ssik at right angles.
    """

    arm: str
    tier: str
    derived: float | None = None
    random: Verdict | None = None
    right: Verdict | None = None
    single: float | None = None
    slowest: float | None = None
    batch: float | None = None
    peer: float | None = None
    peer_random: Verdict | None = None
    peer_right: Verdict | None = None

    @property
    def holds(self) -> bool:
        """Whether no pose is missed or answered wrongly, and at most 1 in 10,000 lost."""
        if self.random is None or self.right is None:
            return False
        failed = (self.random.missed, self.random.wrong, self.right.missed, self.right.wrong)
        return not any(failed) and (self.random.lost or 0) <= self.random.poses / 10_000


def run(quick: bool, only: str | None) -> int:
    """Prints the table, saves it after a full run; returns 1 if an arm is not solved wholly."""
    poses, some = (100, 10) if quick else (2_000, 200)
    chosen = [arm for arm in arms() if only is None or only in arm.name]
    chosen = chosen[:: len(chosen) // 3] if quick and only is None else chosen
    with tempfile.TemporaryDirectory() as folder, one_core():
        rows = [judgement(arm, Path(folder), poses, some) for arm in chosen]
    table("Arms of the field", COLUMNS, [_printed(row) for row in rows])
    if not quick and only is None:
        save(RESULT, {"rows": [asdict(row) for row in rows]})
    return int(not all(row.holds for row in rows))


def judgement(arm: FieldArm, folder: Path, poses: int, some: int) -> Row:
    """The row of an arm, judged at so many random poses and half as many at right angles.

    Args:
        arm: Its numbers.
        folder: Where its files are written.
        poses: Number of random poses.
        some: Number of poses of each kind that ssik solves.
    """
    try:
        taken = derived(arm, folder)
    except RuntimeError as error:
        out.print(f"{arm.name}: not derived: {error}")
        return Row(arm.name, "not derived")
    case = FieldCase(arm.name, arm=arm, folder=folder / arm.name)
    if "ik" not in case.robot.functions:
        out.print(f"{arm.name}: no ik")
        return Row(arm.name, "no ik", taken)
    unknown = [name for name in case.given if not case.has_value(name)]
    if unknown:
        out.print(f"{arm.name}: no function gives the {', '.join(unknown)} of a configuration")
        return Row(arm.name, f"no {', '.join(unknown)}", taken)
    rng = np.random.default_rng(0)
    drawn = PoseSet("random", rng.uniform(-np.pi, np.pi, (poses, case.robot.n)), regular=True)
    right = PoseSet("right angles", QUARTER * rng.integers(-1, 3, (poses // 2, case.robot.n)))
    single = singly(case.robot.ik, inputs(case, drawn.q[:CALLS]))
    many = inputs(case, np.resize(drawn.q, (BATCH, case.robot.n)))
    row = Row(
        arm.name,
        case.tier,
        taken,
        judged(case, drawn, lambda q: own(case, q)),
        judged(case, right, lambda q: own(case, q)),
        float(np.median(single)),
        float(np.percentile(single, 99)),
        least(lambda: case.robot.ik(*many)) / BATCH * MICRO,
    )
    row = beside(case.raw(), row, (drawn, right), some)
    out.print(" ".join(text(cell) for cell in _printed(row)))
    return row


def beside(case: FieldCase, row: Row, sets: Sequence[PoseSet], some: int) -> Row:
    """The row with what ssik does on some of the poses, if ssik has this arm."""
    module = prebuilt().get(case.name)
    if module is None:
        return row
    solve = partial(module.solve, respect_limits=False)
    few = [replace(poses, q=poses.q[:some], regular=case.robot.n <= SIX) for poses in sets]
    verdicts = [judged(case, poses, lambda q: theirs(case, solve, q)) for poses in few]
    taken = singly(solve, (case.pose(sets[0].q[:PEER_CALLS]),))
    return replace(
        row, peer=float(np.median(taken)), peer_random=verdicts[0], peer_right=verdicts[1]
    )


def own(case: FieldCase, q: np.ndarray) -> Answers:
    """The answers of chasles to the poses at q (m, n)."""
    found = case.robot.ik(*inputs(case, q))
    return Answers(found.q, found.valid)


def theirs(case: FieldCase, solve: Callable[[np.ndarray], list[Any]], q: np.ndarray) -> Answers:
    """The answers of ssik to the same poses."""
    found = ([solution.q for solution in solve(T)] for T in case.pose(q))
    return gathered(((rows, [True] * len(rows)) for rows in found), q.shape[-1])


def inputs(case: FieldCase, q: np.ndarray) -> tuple[np.ndarray, ...]:
    """The poses at q (m, n), and the given values at which q is among the solutions."""
    return case.pose(q), *case.others(q)


def singly(solve: Callable[..., object], given: Sequence[np.ndarray]) -> list[float]:
    """The times of calls with one pose each [us], each the least of some rounds."""
    rows = list(zip(*given, strict=True))
    return [MICRO * min(seconds(partial(solve, *row)) for _ in range(ROUNDS)) for row in rows]


def least(work: Callable[[], object]) -> float:
    """The least processor time of some rounds [s]."""
    return min(seconds(work, time.process_time) for _ in range(ROUNDS))


def _printed(row: Row) -> tuple[object, ...]:
    random, right = row.random, row.right
    own = (None,) * 5
    if random is not None and right is not None:
        own = (random.missed, random.wrong, random.lost, right.missed, right.wrong)
    peer = (None,) * 3
    if row.peer_random is not None and row.peer_right is not None:
        peer = (row.peer_random.missed, row.peer_random.lost, row.peer_right.missed)
    ratio = row.peer / row.single if row.peer and row.single else None
    times = (row.single, row.slowest, row.batch, row.peer, ratio)
    return (row.arm, row.tier, row.derived, *own, *times, *peer)
