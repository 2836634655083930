"""Mutated URDF files keep the robot's structure, and pose errors stay within the stated error.

Each trial writes a shipped serial robot as a URDF and mutates the file (see
``tests/support/generators/mutated_urdfs.py``). The mutated robot must keep the structure of the
original robot, or chasles must state which structural conditions are violated. For comparison,
Pinocchio computes the tool pose from the same mutated URDF file.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from chasles.derive import SerialRobot, read
from chasles.derive.inverse.classify import Attempt, Classification, classify
from chasles.derive.model.placements import Placement, Rotation
from chasles.derive.model.tolerances import EXACT_STRUCTURE
from chasles.derive.terms.terms import Terms
from tests.support.derivations import NAMES, ROBOTS
from tests.support.generators.mutated_urdfs import Mutant, arm_of_robot, mutated

from .campaign import Campaign, Outcome

MUTANTS = 20
"""Number of mutated URDF files per trial."""
POSES = 20
ORACLE = 1e-12
"""Maximum difference between two computations of the same pose [m and rad]."""
UNLIMITED = 3.0
"""Maximum absolute value of a random coordinate of a joint without limits [rad]."""


@dataclass(frozen=True)
class Finding:
    """Structure and pose error of the robot in a mutated URDF file.

    Attributes:
        mutant: The mutant.
        cleaning: Summary of the numbers that noise removal snapped to exact values.
        excess: Ratio of the maximum pose difference to the stated pose error. If the ratio exceeds
            1, the stated pose error is too small.
        kept: Whether the mutated robot keeps the structure and the solution method of the original
            robot.
        missed: Description of the violated structural conditions.
    """

    mutant: Mutant
    cleaning: str
    excess: float
    kept: bool
    missed: str

    @property
    def is_good(self) -> bool:
        return self.excess <= 1 and (self.kept or bool(self.missed))

    def __str__(self) -> str:
        structure = "structure kept" if self.kept else f"structure missed: {self.missed or '?'}"
        made = ", ".join(self.mutant.made)
        return (
            f"{self.mutant.arm} ({made}): {self.cleaning or 'nothing cleaned'}; "
            f"{self.excess:.2g} of the bound; {structure}"
        )


def trial(number: int) -> Outcome:
    robots = serial_robots()
    arm = arm_of_robot(robots[number % len(robots)])
    found = list(findings([arm], range(number * MUTANTS, (number + 1) * MUTANTS)))
    return Outcome(
        {
            "mutants": len(found),
            "structures kept": sum(finding.kept for finding in found),
            "misses stated": sum(bool(finding.missed) for finding in found),
        },
        tuple(str(finding) for finding in found if not finding.is_good),
        {"part of the pose error": max(finding.excess for finding in found)},
    )


def serial_robots() -> list[SerialRobot]:
    """Return the shipped robots that URDF can represent."""
    robots = [read(ROBOTS / f"{name}.toml") for name in NAMES]
    return [
        robot
        for robot in robots
        if not robot.couplings and all(j.kind != "helical" for j in robot.joints)
    ]


def findings(arms: Sequence[Mutant], numbers: Iterable[int]) -> Iterator[Finding]:
    """Yield the test results of mutated URDF files of several arms."""
    structures: dict[str, Classification] = {}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "mutant.urdf"
        for k in numbers:
            arm = arms[k % len(arms)]
            if arm.arm not in structures:
                structures[arm.arm] = classified(read_mutant(path, arm))
            mutant = mutated(arm, k)
            yield judged(mutant, read_mutant(path, mutant), structures[arm.arm], path)


def read_mutant(path: Path, mutant: Mutant) -> SerialRobot:
    """Write a mutated URDF file, and return the robot that the file describes."""
    path.write_text(mutant.text, encoding="utf-8")
    return read(path, tip=mutant.tip)


def classified(robot: SerialRobot) -> Classification:
    return classify(robot, Terms({p.symbol: p.value for p in robot.parameters}))


def judged(mutant: Mutant, robot: SerialRobot, wanted: Classification, path: Path) -> Finding:
    """Compare a mutated arm's structure with the original arm, and its poses with Pinocchio."""
    found = classified(robot)
    kept = (_name(found.found), found.method) == (_name(wanted.found), wanted.method)
    missed = "" if kept or wanted.found is None else in_words(found, wanted.found)
    return Finding(mutant, robot.cleaning.line, excess(robot, path), kept, missed)


def in_words(found: Classification, wanted: Attempt) -> str:
    """Describe the structural conditions that a chain violates."""
    for attempt in found.attempts:
        if _name(attempt) == _name(wanted):
            off = [r for r in attempt.requirements if r.deviation > EXACT_STRUCTURE]
            return "; ".join(f"{r.text} (off by {r.deviation:.3g})" for r in off)
    return found.missing


def _name(attempt: Attempt | None) -> tuple[object, ...]:
    return (attempt.family.title, attempt.reading, len(attempt.given)) if attempt else ()


def excess(robot: SerialRobot, path: Path) -> float:
    """Return the maximum pose difference from Pinocchio, relative to the stated pose error."""
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


def pose(robot: SerialRobot, q: Sequence[float]) -> np.ndarray:
    """Return the tool pose (4, 4) of a robot without symbolic parameters."""
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
    """Return a placement as a matrix (4, 4).

    The angle ``more`` is added to each rotation angle of the placement.
    """
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


CAMPAIGN = Campaign(
    "mutants",
    "A mutated URDF keeps its structure or states what it misses, and poses stay in their bounds.",
    trial,
)
