"""``python -m bench mutants``: mutated URDFs keep their structure, and poses stay in their bounds.

The URDFs of a folder and the shipped serial robots, written as URDFs in doubles, are mutated (see
``bench/cases/mutated_urdfs.py``), read and classified. The pose of the tool is compared with
Pinocchio's on the file as it stands.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.report import out
from chasles.derive import Robot, from_urdf, load
from chasles.derive.inverse.classify import Attempt, Classification, classify
from chasles.derive.model.placements import Placement, Rotation
from chasles.derive.model.tolerances import EXACT_STRUCTURE
from chasles.derive.terms.terms import Terms
from tests.support.generators.mutated_urdfs import Mutant, arm_of_robot, arm_of_urdf, mutated
from tests.support.oracles.screws import ROBOTS

POSES = 20
ORACLE = 1e-12
"""Difference of two computations of the same pose [m and rad]."""
UNLIMITED = 3.0
"""Range of random values of joints without limits [rad]."""


@dataclass(frozen=True)
class Finding:
    """What became of a mutant.

    Attributes:
        mutant: The mutant.
        cleaning: The robot's line on its cleaned numbers.
        excess: Largest part of the stated pose error that the poses differ by; above 1 is wrong.
        kept: Whether the structure is that of the arm, exactly or within measured errors as well.
        missed: The conditions of the arm's structure that the mutant misses, in words; empty
            where it misses none.
    """

    mutant: Mutant
    cleaning: str
    excess: float
    kept: bool
    missed: str

    @property
    def is_good(self) -> bool:
        """Whether poses are in bounds, and the structure is kept or the miss is said."""
        return self.excess <= 1 and (self.kept or bool(self.missed))

    def __str__(self) -> str:
        """The finding in one line."""
        structure = "structure kept" if self.kept else f"structure missed: {self.missed or '?'}"
        made = ", ".join(self.mutant.made)
        return (
            f"{self.mutant.arm} ({made}): {self.cleaning or 'nothing cleaned'}; "
            f"{self.excess:.2g} of the bound; {structure}"
        )


def run(folder: Path | None, count: int, first: int) -> int:
    """Prints the findings that are not clean, and the counts; returns 1 if one is not good.

    Args:
        folder: A folder of URDFs.
        count: Number of mutants.
        first: Number of the first mutant.
    """
    arms = [*urdfs(folder), *shipped()]
    found = []
    for finding in findings(arms, range(first, first + count)):
        found.append(finding)
        if not (finding.kept and finding.is_good):
            out.print(str(finding), markup=False, soft_wrap=True)
    made = Counter(name for finding in found for name in finding.mutant.made)
    out.print(f"{len(found)} mutants of {len(arms)} arms: {dict(made)}", markup=False)
    out.print(f"structure kept by {sum(f.kept for f in found)}, the miss is said of the others")
    out.print(f"largest part of a stated pose error: {max(f.excess for f in found):.3g}")
    return int(not all(finding.is_good for finding in found))


def urdfs(folder: Path | None) -> list[Mutant]:
    """The arms of a folder of URDFs."""
    paths = sorted(folder.glob("*.urdf")) if folder else []
    return [arm_of_urdf(path.stem, path.read_text(encoding="utf-8")) for path in paths]


def shipped() -> list[Mutant]:
    """The shipped serial robots that a URDF can hold, as an exporter writes them."""
    robots = [load(path) for path in sorted(ROBOTS.glob("*.toml"))]
    return [
        arm_of_robot(robot)
        for robot in robots
        if isinstance(robot, Robot)
        and all(j.kind != "helical" and j.mimic is None for j in robot.joints)
    ]


def findings(arms: Sequence[Mutant], numbers: Iterable[int]) -> Iterator[Finding]:
    """The findings of mutants by their numbers, the arms in turn."""
    structures: dict[str, Classification] = {}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "mutant.urdf"
        for k in numbers:
            arm = arms[k % len(arms)]
            if arm.arm not in structures:
                structures[arm.arm] = classified(read(path, arm))
            mutant = mutated(arm, k)
            yield judged(mutant, read(path, mutant), structures[arm.arm], path)


def read(path: Path, mutant: Mutant) -> Robot:
    """The robot of a mutant's file."""
    path.write_text(mutant.text, encoding="utf-8")
    return from_urdf(path, tip=mutant.tip)


def classified(robot: Robot) -> Classification:
    """The structure of a robot's axes."""
    return classify(robot, Terms({p.symbol: p.value for p in robot.parameters}))


def judged(mutant: Mutant, robot: Robot, wanted: Classification, path: Path) -> Finding:
    """The finding of a mutant of an arm with a wanted structure."""
    found = classified(robot)
    kept = (_name(found.found), found.tier) == (_name(wanted.found), wanted.tier)
    missed = "" if kept or wanted.found is None else in_words(found, wanted.found)
    return Finding(mutant, robot.cleaning.line, excess(robot, path), kept, missed)


def in_words(found: Classification, wanted: Attempt) -> str:
    """The conditions of a wanted structure that a chain misses, and by how much."""
    for attempt in found.attempts:
        if _name(attempt) == _name(wanted):
            off = [r for r in attempt.requirements if r.deviation > EXACT_STRUCTURE]
            return "; ".join(f"{r.text} (off by {r.deviation:.3g})" for r in off)
    return found.missing


def _name(attempt: Attempt | None) -> tuple[object, ...]:
    return (attempt.family.title, attempt.reading, len(attempt.given)) if attempt else ()


def excess(robot: Robot, path: Path) -> float:
    """Largest difference to Pinocchio's poses of a file, as a part of the stated pose error."""
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    tip = len(model.frames) - 1
    dice = np.random.default_rng(len(robot.joints))
    worst = 0.0
    for _ in range(POSES):
        q = [dice.uniform(*_range(joint.limits)) for joint in robot.coordinates]
        full = np.concatenate(
            [
                [np.cos(value), np.sin(value)] if model.joints[k].nq == 2 else [value]
                for k, value in enumerate(q, 1)
            ]
        )
        pin.framesForwardKinematics(model, data, full)
        T, E = data.oMf[tip].homogeneous, pose(robot, q)
        shift = float(np.linalg.norm(T[:3, 3] - E[:3, 3]))
        turn = 2 * np.arcsin(min(1.0, float(np.linalg.norm(T[:3, :3] - E[:3, :3])) / np.sqrt(8)))
        worst = max(
            worst,
            shift / (robot.cleaning.position + ORACLE),
            turn / (robot.cleaning.orientation + ORACLE),
        )
    return worst


def _range(limits: tuple[object, object]) -> tuple[float, float]:
    lower, upper = limits
    return (-UNLIMITED, UNLIMITED) if lower is None else (float(lower), float(upper))


def pose(robot: Robot, q: Sequence[float]) -> np.ndarray:
    """The tool's pose (4, 4) of a robot without parameters, in doubles."""
    T = matrix(robot.base)
    values = iter(q)
    for joint in robot.joints:
        T = T @ matrix(joint.before)
        if joint.kind == "revolute":
            T = T @ matrix((Rotation("z", 0),), next(values))
        elif joint.kind == "prismatic":
            T[:3, 3] += T[:3, 2] * next(values)
        T = T @ matrix(joint.after)
    return T @ matrix(robot.tool)


def matrix(placement: Placement, more: float = 0.0) -> np.ndarray:
    """A placement (4, 4) in doubles, with more added to its angles."""
    T = np.eye(4)
    for motion in placement:
        step = np.eye(4)
        if isinstance(motion, Rotation):
            j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
            c, s = np.cos(float(motion.angle) + more), np.sin(float(motion.angle) + more)
            step[j, j], step[j, k], step[k, j], step[k, k] = c, -s, s, c
        else:
            step[:3, 3] = [float(x) for x in motion.vector]
        T = T @ step
    return T
