"""Reads and derives texts that nobody chose, and counts how each attempt ends.

A text must end in a robot or in an error of chasles, which for a wrong file names the file, within
its time. Every other exception is a crash.
"""

import random
import time
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from bench.report import out, table
from chasles.derive import DescriptionError, RobotError, artifacts, from_urdf, load
from chasles.derive.build.time_limit import OutOfTime, at_most
from chasles.derive.cli import ROBOTS
from tests.support.generators.mutated_texts import mutated
from tests.support.generators.round_arms import round_arm

READ_SECONDS = 2.0
"""CPU seconds that reading a file may take."""
DERIVE_SECONDS = 10.0
"""CPU seconds that deriving an arm may take."""
BUSY = 20
"""Seconds on the clock for one CPU second, on a machine that others use."""
End = Literal["made", "refused", "late", "crashed"]
Texts = Iterable[tuple[str, str]]
"""The ending of each file's name, and its text."""


@dataclass(frozen=True)
class Attempt:
    """The end of one attempt.

    Attributes:
        name: The file's name.
        end: How it ended.
        seconds: CPU seconds.
        message: The error, with the place of a crash.
    """

    name: str
    end: End
    seconds: float
    message: str = ""


def run(folder: Path, files: int, derived: int, arms: int, seed: int) -> int:
    """Prints how all attempts end; returns 1 if one crashes or is late.

    Args:
        folder: A folder of .toml and .urdf files that are mutated beside the shipped ones, and
            receives the mutated file of each crash.
        files: Number of mutated files to read.
        derived: Number of mutated files that are robots to derive.
        arms: Number of arms of round numbers to derive.
        seed: Of the random numbers.
    """
    texts = wounded([*sources(ROBOTS), *sources(folder)], random.Random(seed))
    arm_texts = ((".toml", round_arm(seed + k)) for k in range(arms))
    rows = [
        _counted("mutated, read", _take(texts, files), folder, derive=False),
        _counted("mutated, derived", _robots(texts, derived, folder), folder, derive=True),
        _counted("round arms, derived", arm_texts, folder, derive=True),
    ]
    columns = ("what", "made", "refused", "late", "crashed", "most CPU s", "mean CPU s")
    table("Texts that nobody chose", columns, rows)
    return int(any(late or crashed for _, _, _, late, crashed, *_ in rows))


def sources(folder: Path) -> list[tuple[str, str]]:
    """The ending and the text of every robot file in a folder."""
    paths = sorted(path for path in folder.glob("*") if path.suffix in (".toml", ".urdf"))
    return [(path.suffix, path.read_text(encoding="utf-8")) for path in paths]


def wounded(texts: list[tuple[str, str]], dice: random.Random) -> Iterator[tuple[str, str]]:
    """Endless mutations of texts."""
    while True:
        suffix, text = dice.choice(texts)
        yield suffix, mutated(text, dice)


def attempt(path: Path, *, derive: bool) -> Attempt:
    """Reads a file, and derives it where asked to."""
    limit = DERIVE_SECONDS if derive else READ_SECONDS
    started = time.process_time()
    try:
        with at_most(BUSY * limit):
            robot = from_urdf(path) if path.suffix == ".urdf" else load(path)
            if derive:
                artifacts(robot)
        end, message = "made", ""
    except OutOfTime as error:
        end, message = "late", str(error)
    except DescriptionError as error:
        end, message = "refused", str(error)
        if str(path) not in message:
            end, message = "crashed", f"no file in the error: {message}"
    except RobotError as error:
        end, message = ("refused" if derive else "crashed"), str(error)
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        end = "crashed"
        message = f"{type(error).__name__}: {error} ({place.filename}:{place.lineno})"
    seconds = time.process_time() - started
    if end != "crashed" and seconds > limit:
        end, message = "late", f"{seconds:.1f} s {message}"
    return Attempt(path.name, end, seconds, message)


def _counted(
    title: str, texts: Texts, folder: Path, *, derive: bool
) -> tuple[str | int | float, ...]:
    """The title, how often each end occurs, and the most and the mean of the CPU seconds."""
    stage = title.replace(", ", "_").replace(" ", "_")
    made = []
    for k, (suffix, text) in enumerate(texts):
        path = folder / f".{stage}_{k}{suffix}"
        path.write_text(text, encoding="utf-8")
        made.append(attempt(path, derive=derive))
        if made[-1].end in ("late", "crashed"):
            out.print(f"{path}: {made[-1].end}: {made[-1].message[:300]}", markup=False)
        else:
            path.unlink()
    counts = [sum(one.end == end for one in made) for end in ("made", "refused", "late", "crashed")]
    seconds = [one.seconds for one in made] or [0.0]
    return title, *counts, max(seconds), sum(seconds) / len(seconds)


def _robots(texts: Iterator[tuple[str, str]], count: int, folder: Path) -> Texts:
    """The next mutated files that are robots."""
    found = 0
    while found < count:
        suffix, text = next(texts)
        path = folder / f".candidate{suffix}"
        path.write_text(text, encoding="utf-8")
        good = attempt(path, derive=False).end == "made"
        path.unlink()
        if good:
            found += 1
            yield suffix, text


def _take(texts: Iterator[tuple[str, str]], count: int) -> Texts:
    return (next(texts) for _ in range(count))
