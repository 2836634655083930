"""Reads and derives mutated robot files and random arms with round numbers.

Reading a file or deriving a robot must end within the time limit, with a robot or a chasles error
as the result. An error message about a file must contain the name of the file.
"""

import random
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from chasles.derive import DescriptionError, files, read
from chasles.derive.build.time_limit import OutOfTime, at_most
from tests.support.derivations import ROBOTS
from tests.support.generators.field_arms import calibrated
from tests.support.generators.mutated_texts import mutated
from tests.support.generators.round_arms import round_arm

from .campaign import Campaign, Outcome

READ, DERIVED, ARMS = 200, 2, 6
"""Numbers per trial of mutated files to read, of mutated files to derive, and of random arms to
derive."""
READ_SECONDS, DERIVE_SECONDS = 40.0, 200.0
"""Time limits for reading a robot file and for deriving a robot [s]."""
KEPT = Path(__file__).parents[2] / "build" / "robust"
"""Folder that keeps each robot file whose test failed."""
URDF = """<robot name="arm">
  <link name="base"/><link name="one"/><link name="two"/><link name="tool"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="one"/>
    <origin xyz="0.1 0 0.08920113858084797" rpy="0 1.5707963267948966 0.2"/>
    <axis xyz="0.57735026918962 0.57735026918963 0.577350269189626"/>
    <limit lower="-3.14159" upper="3.14159"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="one"/><child link="two"/>
    <origin xyz="-0.4251460319702735 0 0.2" rpy="3.1351985141209435 0 0.0000942"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.5"/>
  </joint>
  <joint name="flange" type="fixed">
    <parent link="two"/><child link="tool"/><origin xyz="0 0 0.1" rpy="0 0 0"/>
  </joint>
</robot>
"""
URDFS = 5
"""Number of copies of each URDF among the source files."""
Text = tuple[str, str]
"""Suffix and text of a robot file."""


@dataclass(frozen=True)
class Attempt:
    """Result of one attempt to read or derive a robot, with the message of an error."""

    end: Literal["made", "refused", "endless", "crashed"]
    message: str = ""

    @property
    def is_good(self) -> bool:
        """Test whether the attempt returned a robot or a chasles error in time."""
        return self.end in ("made", "refused")


def trial(number: int) -> Outcome:
    with TemporaryDirectory() as folder:
        attempts = list(_attempts(number, Path(folder)))
    counts = dict.fromkeys(("read", "derived", "refused"), 0)
    failures = []
    for path, derive, found in attempts:
        what = "refused" if found.end == "refused" else "derived" if derive else "read"
        counts[what] += found.is_good
        if not found.is_good:
            failures.append(f"{KEPT / path.name}: {found.end}: {found.message[:300]}")
    return Outcome(counts, tuple(failures))


def _attempts(number: int, folder: Path) -> Iterator[tuple[Path, bool, Attempt]]:
    """Yield the robot file, a derivation flag and the result of each attempt.

    The derivation flag is True if the attempt includes the derivation of the robot.
    """
    derived = 0
    for k, text in enumerate(islice(mutants(random.Random(number)), READ)):
        path = written(folder / f"{number}_mutant_{k}", text)
        yield path, False, (found := attempt(path, derive=False))
        if found.end == "made" and derived < DERIVED:
            derived += 1
            yield path, True, attempt(path, derive=True)
    for k in range(number * ARMS, (number + 1) * ARMS):
        path = written(folder / f"round_arm_{k}", (".toml", round_arm(k)))
        yield path, True, attempt(path, derive=True)


def sources() -> list[Text]:
    """Return the shipped robot files, a URDF and a calibrated arm."""
    shipped = [
        (".toml", path.read_text(encoding="utf-8")) for path in sorted(ROBOTS.glob("*.toml"))
    ]
    return [*shipped, *[(".urdf", URDF), (".urdf", calibrated().urdf())] * URDFS]


def mutants(dice: random.Random) -> Iterator[Text]:
    """Yield mutated robot files endlessly."""
    texts = sources()
    while True:
        suffix, text = dice.choice(texts)
        yield suffix, mutated(text, dice)


def written(stem: Path, text: Text) -> Path:
    """Write a text to a file and return its path."""
    path = stem.with_name(stem.name + text[0])
    path.write_text(text[1], encoding="utf-8")
    return path


def attempt(path: Path, *, derive: bool) -> Attempt:
    """Read a file and optionally derive its robot.

    Files that cause a failure are copied to the folder `KEPT`.
    """
    found = _attempt(path, derive=derive)
    if not found.is_good:
        KEPT.mkdir(parents=True, exist_ok=True)
        (KEPT / path.name).write_bytes(path.read_bytes())
    return found


def _attempt(path: Path, *, derive: bool) -> Attempt:
    try:
        with at_most(DERIVE_SECONDS if derive else READ_SECONDS):
            robot = read(path)
            if derive:
                files(robot)
    except OutOfTime as error:
        return Attempt("endless", str(error))
    except DescriptionError as error:
        if not error.file:
            return Attempt("refused" if derive else "crashed", str(error))
        if str(path) not in str(error):
            return Attempt("crashed", f"no file in the error: {error}")
        return Attempt("refused", str(error))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({place.filename}:{place.lineno})"
        return Attempt("crashed", text)
    return Attempt("made")


CAMPAIGN = Campaign(
    "robust",
    "A mutated robot file results in a robot or in an error that states the file.",
    trial,
)
