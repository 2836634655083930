"""``python -m bench tracker``: simulated sets of a tracker, from table to held-back errors.

Each arm has encoders zeroed wrongly by up to three degrees, axes off by 0.7 mm and 0.7 mrad, drives
with waves, and links that bend by 0.2 mm under their weight, which no model here describes. 36
configurations with three targets each are written as a table in mm and degrees, with the base and
the targets unknown, and read back. 200 further configurations judge the result.
"""

import csv
import tempfile
import time
from pathlib import Path

import numpy as np

import chasles
from bench.report import out
from chasles import screws
from chasles.calibration import best_model, identify, read_measurements
from chasles.calibration.observed.frames import register_points

ARMS = (
    "irb120",
    "puma560",
    "lrmate200id",
    "irb1200",
    "kr6_r700",
    "gp7",
    "vs060",
    "tx2_60",
    "ur5e",
    "ur10e",
    "iiwa14",
    "stanford",
)
MEASURED, HELD = 36, 200
ZERO, AXIS, WAVE, SAG, NOISE = np.radians(3), 7e-4, 2e-4, 2e-4, 2e-5
"""Largest error of a zero [rad] and of an axis [m, rad], of a wave of a drive [rad], sag of the
stretched arm [m], and standard deviation of the tracker [m]."""


HEADINGS = ("nominal", "offsets", "axes, free", "chosen", "left", "CPU s", "model")


def run(names: tuple[str, ...], seeds: int) -> int:
    """Prints a line for each drawn arm when it is done, and the whole at the end; returns 0."""
    out.print(f"{MEASURED} configurations of three targets; mean held-back errors in mm")
    out.print(f"{'arm':<14}" + "".join(f"{heading:>11}" for heading in HEADINGS))
    figures = []
    for name in names:
        robot = chasles.load(name, parametric=True)
        for seed in range(seeds):
            *found, model = _once(robot, np.random.default_rng([seed, 2]))
            out.print(f"{name:<14}" + "".join(f"{x:11.3f}" for x in found) + f"  {model}")
            figures.append(found)
    for what, row in (
        ("median", np.median(figures, axis=0)),
        ("largest", np.max(figures, axis=0)),
    ):
        out.print(f"{what:<14}" + "".join(f"{x:11.3f}" for x in row))
    return 0


def _once(robot, random: np.random.Generator) -> tuple:
    drawn = _Arm(robot, random)
    q, held = drawn.configurations(MEASURED), drawn.configurations(HELD)
    points = drawn.measured(q) + NOISE * random.normal(size=(MEASURED, 3, 3))
    points[random.random((MEASURED, 3)) < 0.05] = np.nan
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        q, observation = read_measurements(_written(Path(folder), robot, q, points), robot)
    chosen = best_model(robot, q, observation)
    seconds = time.process_time() - start
    true = drawn.measured(held)
    offsets = identify(robot, q, observation, vary=("offset",))
    free = identify(robot, q, observation)
    nominal = register_points(robot.fk(q), observation.points)
    first = _apart(nominal.T_W_base @ robot.fk(held), nominal.points, true)
    found = [first, *(_mean(c, held, true) for c in (offsets, free, chosen.calibration))]
    measured = chosen.calibration.observation
    left = 1e3 * measured.lengths(chosen.calibration.errors).mean()
    return (*(1e3 * x for x in found), left, seconds, chosen.model.name)


def _mean(found, held: np.ndarray, true: np.ndarray) -> float:
    return _apart(found.poses(held), found.unknowns.reshape(-1, 3), true)


def _apart(T: np.ndarray, targets: np.ndarray, true: np.ndarray) -> float:
    placed = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], targets)
    return float(np.linalg.norm(placed - true, axis=-1).mean())


class _Arm:
    """A drawn arm, its tracker and targets."""

    def __init__(self, robot, random: np.random.Generator) -> None:
        self.robot, self.random = robot, random
        self.p = np.array([g.value for g in robot.geometry])
        parts = np.array([g.part for g in robot.geometry])
        turns = np.array([g.unit == "rad" for g in robot.geometry])
        gains = np.array([g.unit not in ("rad", "m") for g in robot.geometry])
        for chosen, size in (
            ((parts == "offset") & turns, ZERO),
            (parts == "axis", AXIS),
            ((parts == "transmission") & ~gains, WAVE),
        ):
            self.p[chosen] += random.uniform(-size, size, chosen.sum())
        self.T_W_base = screws.exp(random.normal(size=6) * [2, 2, 2, 1, 1, 1])
        self.targets = random.uniform(-0.08, 0.08, (3, 3))
        self.reach = np.linalg.norm(robot.fk(self.configurations(500))[:, :2, 3], axis=-1).max()

    def configurations(self, count: int) -> np.ndarray:
        lower, upper = np.maximum(self.robot.lower, -2), np.minimum(self.robot.upper, 2)
        return self.random.uniform(lower, upper, (count, self.robot.n))

    def measured(self, q: np.ndarray) -> np.ndarray:
        T = self.robot.fk_p(q, self.p)
        placed = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], self.targets)
        # A stretched arm bends with the square of the distance from its first axis.
        placed[..., 2] -= SAG * (np.linalg.norm(placed[..., :2], axis=-1) / self.reach) ** 2
        return placed @ self.T_W_base[:3, :3].T + self.T_W_base[:3, 3]


def _written(folder: Path, robot, q: np.ndarray, points: np.ndarray) -> Path:
    path = folder / "measured.csv"
    turning = np.array([c.unit == "rad" for c in robot.coordinates])
    with path.open("w", newline="", encoding="utf-8") as stream:
        lines = csv.writer(stream, delimiter=";")
        angles = [f"q{k + 1}_{'deg' if t else 'mm'}" for k, t in enumerate(turning)]
        lines.writerow(["id", *(f"{a}{j} [mm]" for j in (1, 2, 3) for a in "xyz"), *angles])
        for k, (at, own) in enumerate(zip(q, points, strict=True)):
            cells = ["" if np.isnan(v) else f"{1e3 * v:.4f}".replace(".", ",") for v in own.ravel()]
            shown = np.where(turning, np.degrees(at), 1e3 * at)
            lines.writerow([k + 1, *cells, *(f"{v:.5f}".replace(".", ",") for v in shown)])
    return path
