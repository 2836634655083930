"""Modes of random planar platforms, compared with Newton's iteration.

A platform on three legs of revolute and prismatic joints is derived and compiled. Its modes at the
reference and at random inputs near it must be sure, must include every mode that Newton's
iteration on all joints finds from random starts, and must be modes that Newton's iteration keeps.
Modes with a margin below 1e-4 are not compared, because Newton's iteration converges slowly there.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import read_text, write
from tests.support.generators.planar_platforms import CLOSED, DrawnPlatform, drawn_platform

from .campaign import Campaign, Outcome

STARTS, INPUTS = 1_000, 4
FUNCTIONS, LANGUAGES = ("modes",), ("c", "python")
SAME, REGULAR = 1e-6, 1e-4
"""Distance of modes that count as the same, and minimum margin. Platforms are of size 1."""
AGAIN = 100
"""Starts from a mode of the platform, with random passive joints of all three legs."""
STEPS, LONGEST_STEP = 50, 0.5
SLIDE = 2.0
"""Standard deviation of passive prismatic joints at the starts, relative to the poses' size."""
NEAR = 0.3
"""Radian or metre: maximum distance of inputs from the reference."""


@dataclass(frozen=True)
class Compared:
    """The modes of a platform at one input.

    Attributes:
        missed: Modes of Newton's iteration that the platform's function does not find.
        wrong: Modes of the function from which Newton's iteration leads elsewhere.
        unsure: Whether the function reports that a mode may be missing.
        modes: Number of modes of the function.
    """

    missed: int
    wrong: int
    unsure: bool
    modes: int


def trial(number: int) -> Outcome:
    """Compares the modes of one random platform at some inputs."""
    rng = np.random.default_rng(number)
    platform = drawn_platform(rng)
    with tempfile.TemporaryDirectory() as folder:
        robot = derived(platform, Path(folder))
    shifts = rng.uniform(-NEAR, NEAR, (INPUTS - 1, 3))
    q = robot.reference.q + np.vstack([np.zeros(3), shifts])
    found = [compared(robot, platform, row, rng, STARTS) for row in q]
    legs = ", ".join(f"{leg.kinds} with joint {leg.actuated} actuated" for leg in platform.legs)
    failures = [
        f"{legs}, q = {row.tolist()}: {c}"
        for row, c in zip(q, found, strict=True)
        if c.missed or c.wrong or c.unsure
    ]
    return Outcome({"inputs": INPUTS, "modes": sum(c.modes for c in found)}, tuple(failures))


def derived(
    platform: DrawnPlatform, folder: Path, functions: tuple[str, ...] = FUNCTIONS
) -> chasles.Robot:
    """Derive and load some functions of a platform."""
    path = folder / "platform"
    write(read_text(platform.text("platform")), path, functions=functions, languages=LANGUAGES)
    return chasles.load(path)


def compared(
    robot: chasles.Robot,
    platform: DrawnPlatform,
    q: np.ndarray,
    rng: np.random.Generator,
    starts: int,
) -> Compared:
    """Compare the modes of a platform at one input with the modes of Newton's iteration."""
    theta, margin, unsure = robot.modes(q)
    theta, margin = theta[np.isfinite(margin)], margin[np.isfinite(margin)]
    size = _size(theta)
    begun = np.concatenate(
        [rng.normal(size=(starts, 2)) * size, rng.uniform(-np.pi, np.pi, (starts, 1))],
        1,
    )
    others = newton(platform, q, begun, rng)
    stays = np.array([_stays(platform, q, row, rng) for row in theta], bool)
    near = _apart(others, theta)
    # Where modes nearly meet, Newton's iteration ends a little off.
    regular = margin > REGULAR
    missed = ~(near < SAME).any(1)
    meeting = (near[:, ~regular] < np.sqrt(SAME)).any(1)
    return Compared(
        int((missed & ~meeting).sum()),
        int((~stays & regular).sum()),
        bool(unsure[0]),
        len(theta),
    )


def _stays(
    platform: DrawnPlatform, q: np.ndarray, pose: np.ndarray, rng: np.random.Generator
) -> bool:
    """Whether Newton's iteration from a mode, with random passive joints, returns to it."""
    found = newton(platform, q, np.repeat(pose[None], AGAIN, 0), rng)
    return bool((_apart(pose[None], found) < SAME).any())


def newton(
    platform: DrawnPlatform, q: np.ndarray, poses: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Distinct modes (n, 3) that Newton's iteration finds from poses and random passive joints."""
    slides = np.array([leg.kinds[leg.passive] == "P" for leg in platform.legs])
    size = _size(poses)
    passive = rng.uniform(-np.pi, np.pi, (len(poses), 3))
    passive[:, slides] = rng.normal(size=(len(poses), sum(slides))) * SLIDE * size
    x = np.concatenate([poses, passive], 1)
    units = np.concatenate([[size, size, 1.0], np.where(slides, size, 1.0)])
    found = []
    for _ in range(STEPS):
        gaps, facing = platform.excess(x, q)
        closed = np.abs(gaps).max(1) < CLOSED
        found.append(x[closed & (facing > 0).all(1), :3])
        x, gaps = x[~closed], gaps[~closed]
        if not len(x):
            break
        J = platform.slopes(x, q)
        step = np.linalg.solve(J + 1e-13 * np.eye(6), -gaps[..., None])[..., 0]
        longest = np.abs(step / units).max(1, keepdims=True)
        x = x + step * np.minimum(1, LONGEST_STEP / np.maximum(longest, LONGEST_STEP / 2))
    return _distinct(np.concatenate(found))


def _size(poses: np.ndarray) -> float:
    """One plus the maximum distance of poses from the origin along an axis (metre)."""
    return float(1 + np.abs(poses[:, :2]).max(initial=0.0))


def _distinct(poses: np.ndarray) -> np.ndarray:
    kept = np.empty((0, 3))
    while len(poses):
        kept = np.vstack([kept, poses[:1]])
        poses = poses[_apart(poses[:1], poses)[0] > SAME]
    return kept


def _apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n, m) distances of modes, the larger of position and angle."""
    d = one[:, None] - other[None]
    d[..., 2] = np.angle(np.exp(1j * d[..., 2]))
    return np.asarray(np.abs(d).max(-1))


CAMPAIGN = Campaign(
    "planar",
    "The modes of a random planar platform are the modes that Newton's iteration finds.",
    trial,
)
