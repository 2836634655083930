"""Random arms have the same poses after they are written to robot files, URDF files and tables."""

from collections import Counter
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from chasles.derive import SerialRobot, convert, read
from chasles.derive.conversion.conversions import FORMATS, TABLES, Conversion
from tests.support.generators.convertible_arms import convertible_arm
from tests.support.oracles.described_fk import distance, table_pose, tool_pose

from .campaign import Campaign, Outcome

ARMS, POSES = 5, 2
"""Number of random arms per trial, and number of configurations per arm."""
ACCURACY = 1e-12
"""Largest pose difference (meter, radian) that a format conversion may cause without reporting it.
"""


def trial(number: int) -> Outcome:
    counts: Counter[str] = Counter()
    failures, largest = [], 0.0
    for seed in range(number * ARMS, (number + 1) * ARMS):
        robot, draw = convertible_arm(seed), Random(seed)
        counts["arms"] += 1
        for form in FORMATS:
            conversion = convert(robot, form)
            stated = max(conversion.error)
            counts[f"stated errors of {form}"] += stated > ACCURACY
            for kind, found in differences(robot, conversion, draw).items():
                counts[kind] += 1
                if form == kind and found <= 2 * stated:
                    continue
                largest = max(largest, found)
                if found > ACCURACY:
                    failures.append(f"arm {seed} as {form} ({kind}): differs by {found:.1e}")
    return Outcome(counts, tuple(failures), {"difference": largest})


def differences(robot: SerialRobot, conversion: Conversion, draw: Random) -> dict[str, float]:
    """Return the largest pose differences of a robot from its saved file and from its CSV table."""
    form = conversion.format
    with TemporaryDirectory() as folder:
        path = Path(folder) / ("arm.urdf" if form == "urdf" else "arm.toml")
        conversion.save(path)
        read_back = {form: read(path), "numbers as written": read(path, exact=True)}
        table = ""
        if form in TABLES:
            conversion.save(path.with_suffix(".csv"))
            table = path.with_suffix(".csv").read_text(encoding="utf-8")
    largest: dict[str, float] = {}
    for _ in range(POSES):
        q = [draw.uniform(-2, 2) for _ in robot.coordinates]
        T = tool_pose(robot, q)
        poses = {kind: tool_pose(found, q) for kind, found in read_back.items()}
        if table:
            poses["csv"] = table_pose(table, form, q)
        for kind, other in poses.items():
            largest[kind] = max(largest.get(kind, 0.0), distance(T, other))
    return largest


CAMPAIGN = Campaign(
    "convert",
    "Random arms as robot file, URDF and tables have the same poses, up to the stated error.",
    trial,
)
