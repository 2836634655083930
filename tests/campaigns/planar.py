"""``python -m bench planar``: modes of random planar platforms beside Newton's iteration.

Random platforms (--count) on three legs of joints that turn or slide are derived, and asked for
their modes at the reference and at three random inputs near it. Newton's iteration on all joints,
from random starts (--starts), finds the modes independently. A line for each platform with an
error, and one for all, tells

    missed   modes of Newton's iteration that are not found
    wrong    modes that are found and that Newton's iteration leaves
    unsure   inputs at which a mode may be missing
    modes    by number, 0 to 6

Modes with a margin below 1e-4 are not compared: Newton's iteration converges slowly there.
"""

import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import chasles
from bench.report import out, paced
from chasles.derive import loads, write
from chasles.derive.emit.languages import EMITTERS
from tests.support.generators.planar_platforms import CLOSED, DrawnPlatform, drawn_platform

COUNT, STARTS, INPUTS = 100, 1_000, 4
FUNCTIONS, LANGUAGES = ("modes",), ("c", "python")
SAME, REGULAR = 1e-6, 1e-4
"""Distance of modes that are one; least margin. Platforms are of size 1."""
AGAIN = 100
"""Starts from a mode that is found: they guess the passive joints of all three legs at once."""
STEPS, LONGEST_STEP = 50, 0.5
SLIDE = 2.0
"""Standard deviation of slides at the starts, in parts of the poses' size."""
NEAR = 0.3
"""Radian or metre: how far inputs are from the reference."""


@dataclass(frozen=True)
class Compared:
    """The modes of a platform at one input."""

    missed: int
    wrong: int
    unsure: bool
    modes: int

    @property
    def is_faulty(self) -> bool:
        """Whether a mode is missed, wrong or unsure."""
        return bool(self.missed or self.wrong or self.unsure)


def run(count: int, starts: int, seed: int) -> int:
    """Judges random platforms; prints a line for each with an error, and one for all."""
    found = paced(_judged(range(seed, seed + count), starts), count, _so_far)
    out.print(f"{count} platforms: {_so_far(found)}")
    return int(any(row.is_faulty for rows in found for row in rows))


def _judged(seeds: Iterable[int], starts: int) -> Iterator[list[Compared]]:
    """Judges platforms one after the other, and prints those with an error."""
    for seed in seeds:
        generator = np.random.default_rng(seed)
        platform = drawn_platform(generator)
        rows = judged(platform, generator, starts)
        if any(row.is_faulty for row in rows):
            out.print(f"platform {seed}: {', '.join(map(str, platform.legs))}: {rows}")
        yield rows


def _so_far(found: Sequence[list[Compared]]) -> str:
    rows = [row for of in found for row in of]
    kinds = Counter(row.modes for row in rows)
    return (
        f"{len(rows)} inputs, missed {sum(r.missed for r in rows)}, wrong "
        f"{sum(r.wrong for r in rows)}, unsure {sum(r.unsure for r in rows)}, modes "
        + " ".join(str(kinds[k]) for k in range(7))
    )


def judged(platform: DrawnPlatform, generator: np.random.Generator, starts: int) -> list[Compared]:
    """The modes of a platform at its reference and at random inputs, compared."""
    with tempfile.TemporaryDirectory() as folder:
        robot = derived(platform, Path(folder))
    q = robot.reference.q + generator.uniform(-NEAR, NEAR, (INPUTS, 3)) * (
        np.arange(INPUTS) > 0
    ).reshape(-1, 1)
    return [compared(robot, platform, row, generator, starts) for row in q]


def derived(
    platform: DrawnPlatform, folder: Path, functions: tuple[str, ...] = FUNCTIONS
) -> chasles.Robot:
    """Some functions of a platform, compiled."""
    emitters = [emitter for emitter in EMITTERS if emitter.language in LANGUAGES]
    path = folder / "platform"
    write(loads(platform.text("platform")), path, functions, emitters=emitters)
    return chasles.load(path)


def compared(
    robot: chasles.Robot,
    platform: DrawnPlatform,
    q: np.ndarray,
    generator: np.random.Generator,
    starts: int,
) -> Compared:
    """The modes of a platform at one input beside those of Newton's iteration."""
    theta, margin, unsure = robot.modes(q)
    theta, margin = theta[np.isfinite(margin)], margin[np.isfinite(margin)]
    size = _size(theta)
    begun = np.concatenate(
        [generator.normal(size=(starts, 2)) * size, generator.uniform(-np.pi, np.pi, (starts, 1))],
        1,
    )
    others = newton(platform, q, begun, generator)
    stays = np.array([_stays(platform, q, row, generator) for row in theta], bool)
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
    platform: DrawnPlatform, q: np.ndarray, pose: np.ndarray, generator: np.random.Generator
) -> bool:
    """Whether Newton's iteration from a mode, with random passive joints, finds it again."""
    found = newton(platform, q, np.repeat(pose[None], AGAIN, 0), generator)
    return bool((_apart(pose[None], found) < SAME).any())


def newton(
    platform: DrawnPlatform, q: np.ndarray, poses: np.ndarray, generator: np.random.Generator
) -> np.ndarray:
    """(n, 3) the distinct modes that starts at poses, with random passive joints, lead to."""
    slides = np.array([leg.kinds[leg.passive] == "P" for leg in platform.legs])
    size = _size(poses)
    passive = generator.uniform(-np.pi, np.pi, (len(poses), 3))
    passive[:, slides] = generator.normal(size=(len(poses), sum(slides))) * SLIDE * size
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
    """How far poses are from the origin, the platform's size of 1 at least (metre)."""
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
