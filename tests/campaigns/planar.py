"""Assembly modes of random planar platforms agree with Newton's method.

Each platform has three legs with revolute and prismatic joints. At the reference and at nearby
inputs, the function ``modes`` must report a complete list of assembly modes. The list must include
every assembly mode that Newton's method finds from random start values. Newton's method, started at
the platform pose of a listed mode, must converge back to this mode. Assembly modes with a margin
below 1e-4 are not compared, because Newton's method converges slowly to such modes.
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
"""The tests treat modes closer than `SAME` as equal, and ignore modes with a margin below
`REGULAR`."""
AGAIN = 100
"""Number of Newton starts from each assembly mode, with random passive joint values of all three
legs."""
STEPS, LONGEST_STEP = 50, 0.5
SLIDE = 2.0
"""Standard deviation of the start values of passive prismatic joints, relative to 1 plus the
largest absolute position coordinate (meter)."""
NEAR = 0.3
"""Maximum difference between an actuator input and its reference value (radian or meter)."""


@dataclass(frozen=True)
class Compared:
    """Comparison of the assembly modes of a platform with Newton's method, at one input.

    Attributes:
        missed: Number of assembly modes that only Newton's method finds.
        wrong: Number of returned assembly modes to which Newton's method does not converge back.
        unsure: Whether the list of assembly modes may be incomplete.
        modes: Number of assembly modes that the function ``modes`` returns.
    """

    missed: int
    wrong: int
    unsure: bool
    modes: int


def trial(number: int) -> Outcome:
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
    """Derive the given functions of a platform, and load the robot."""
    path = folder / "platform"
    # The option `exact` prevents a random number from being taken for a rounded angle.
    described = read_text(platform.text("platform"), exact=True)
    write(described, path, functions=functions, languages=LANGUAGES)
    return chasles.load(path)


def compared(
    robot: chasles.Robot,
    platform: DrawnPlatform,
    q: np.ndarray,
    rng: np.random.Generator,
    starts: int,
) -> Compared:
    """Compare the assembly modes at one input with the results of Newton's method."""
    theta, margin, unsure = robot.functions["modes"](q)
    theta, margin = theta[np.isfinite(margin)], margin[np.isfinite(margin)]
    size = _size(theta)
    begun = np.concatenate(
        [rng.normal(size=(starts, 2)) * size, rng.uniform(-np.pi, np.pi, (starts, 1))],
        1,
    )
    others = newton(platform, q, begun, rng)
    stays = np.array([_stays(platform, q, row, rng) for row in theta], bool)
    near = _apart(others, theta)
    # Near double solutions, Newton's method is less accurate.
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
    """Test whether Newton's method, started at the pose of an assembly mode, finds it again."""
    found = newton(platform, q, np.repeat(pose[None], AGAIN, 0), rng)
    return bool((_apart(pose[None], found) < SAME).any())


def newton(
    platform: DrawnPlatform, q: np.ndarray, poses: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Return the distinct modes (n, 3) that Newton's method finds."""
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
    """Return one plus the largest absolute position coordinate (meter)."""
    return float(1 + np.abs(poses[:, :2]).max(initial=0.0))


def _distinct(poses: np.ndarray) -> np.ndarray:
    kept = np.empty((0, 3))
    while len(poses):
        kept = np.vstack([kept, poses[:1]])
        poses = poses[_apart(poses[:1], poses)[0] > SAME]
    return kept


def _apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the distances (n, m) between two sets of assembly modes.

    A distance is the larger of position difference and angle difference.
    """
    d = one[:, None] - other[None]
    d[..., 2] = np.angle(np.exp(1j * d[..., 2]))
    return np.asarray(np.abs(d).max(-1))


CAMPAIGN = Campaign(
    "planar",
    "The modes of a random planar platform are the modes that Newton's iteration finds.",
    trial,
)
