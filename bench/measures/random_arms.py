"""The command ``python -m bench arms`` times the inverses of random arms.

The arms have geometry errors or no closed-form structure. ``tests/campaigns/displaced.py`` and
``tests/campaigns/general.py`` check the solutions of these arms.
"""

import time
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from chasles import InputValueError
from chasles.derive import SerialRobot
from tests.campaigns import displaced, general
from tests.campaigns.general import Judged, configurations, loaded

from ..report import out, seconds, table

SINGLES, BATCH = 1000, 10_000
"""Number of poses for single calls and for a batch of poses."""
ROUNDS = 3
MICRO = 1e6
MAX_P99 = 50.0
"""Limit [us] of the 99th percentile of the time of one ik call, for calibrated arms."""
COLUMNS = ("arm", "joints", "nominal", "single us", "p99 us", "batch us", "bar", "")


def run(count: int, first: int) -> int:
    """Print the times of ik for random arms. Return 1 if a calibrated arm is slower than MAX_P99.

    Args:
        count: Number of arms of each kind.
        first: Seed of the first random arm. The seed determines the geometry of the arm.
    """
    rows = []
    for number in range(first, first + count):
        for title, robot, bar in (
            ("errors", displaced.arm_of(number), MAX_P99),
            ("general", general.arm_of(number), None),
        ):
            name = f"{number}, {title}: {robot.title or robot.name}"
            try:
                rows.append((name, *times(robot, number, bar)))
            except InputValueError as error:
                out.print(f"{name} is left out: {error}", markup=False)
    table("Inverses of random arms, time of a pose", COLUMNS, rows)
    return int(any(row[-1] for row in rows))


def times(robot: SerialRobot, number: int, bar: float | None) -> tuple[object, ...]:
    """Return the table cells that contain the times of an arm.

    Args:
        robot: The arm.
        number: Seed of the random poses.
        bar: Maximum allowed 99th percentile of the time of one ik call, or None.
    """
    with TemporaryDirectory() as folder:
        arm = loaded(robot, Path(folder))
    q, _ = configurations(robot, BATCH, 0, np.random.default_rng(number))
    T, fixed = arm.fk(q), Judged(robot, arm).fixed(q)
    rows = [(T[k], {name: value[k] for name, value in fixed.items()}) for k in range(SINGLES)]
    single, p99 = np.percentile(
        [min(seconds(partial(arm.ik, pose, fixed=at)) for _ in range(ROUNDS)) for pose, at in rows],
        (50, 99),
    )
    batch = min(seconds(partial(arm.ik, T, fixed=fixed), time.process_time) for _ in range(ROUNDS))
    mark = "MISSED" if bar is not None and MICRO * p99 > bar else ""
    has_nominal = "yes" if "ik_nominal" in arm.functions else ""
    cells = (MICRO * single, MICRO * p99, MICRO * batch / BATCH)
    return (arm.n, has_nominal, *map(float, cells), bar, mark)
