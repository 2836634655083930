"""The link poses of random URDF files agree with Pinocchio's reader."""

from pathlib import Path
from tempfile import TemporaryDirectory

from tests.support.generators.random_urdf import POSES, compare

from .campaign import Campaign, Outcome

FILES = 10
"""Number of random files per trial."""


def trial(number: int) -> Outcome:
    with TemporaryDirectory() as folder:
        for seed in range(number * FILES, (number + 1) * FILES):
            compare(Path(folder) / f"{seed}.urdf", seed)
    return Outcome({"files": FILES, "poses": FILES * POSES})


CAMPAIGN = Campaign(
    "urdf",
    "Link poses of random URDF files agree with Pinocchio's reader.",
    trial,
)
