"""Random tests of the inverse kinematics of arms that belong to no closed-form family.

Trials alternate between arms with six revolute joints, with seven revolute joints, and with seven
to ten joints, of which up to two are prismatic. The target poses are computed from random joint
angles and from multiples of 90 degrees. Each pose must have a solution, and every solution must
reach its pose. The solutions must include every nonsingular configuration from which a target pose
was computed.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import chasles
from chasles.derive import SerialRobot, derive
from chasles.derive.build.generate import files_of, put
from chasles.derive.emit.languages import emitters_of
from chasles.derive.inverse.general.elimination_choice import slides_of
from chasles.derive.inverse.general.raghavan_roth import numbers
from tests.support.fixed import fixed_at
from tests.support.generators.random_arms import long_arm, random_arm

from .campaign import Campaign, Outcome

RANDOM, RIGHT = 2000, 1000
"""Number of random configurations per arm, and number of configurations at multiples of 90 degrees.
"""
OTHERS, COUNTED = 200, 10
"""Number of poses with different fixed joint values, and number of poses for which Newton's method
counts the solutions."""
PART = 1000
"""Number of poses per batch."""
SAME = 1e-6
"""Maximum difference (rad) at which two solutions count as equal."""
WRONG = 1e-8
"""Maximum pose error of a correct solution (meter, or rotation matrix entry), larger than the limit
1e-9 of the runtime."""
REGULAR = 1e-5
"""Minimum singular value (m or rad per rad) of the Jacobian at a regular configuration."""
STARTS, STEPS = 1500, 60
"""Number of random start configurations, and maximum number of steps of Newton's iteration."""
STILL = 1e-12
"""Step size (rad) below which Newton's iteration ends."""
SIX = 6
SLIDE = 0.5
"""Maximum displacement of a prismatic joint in either direction [m]."""
DERIVED = ["fk", "ik", "fk_jacobian_mixed"]
ITERATED = [*DERIVED, "hessian_mixed"]
"""Functions required by ``ik_numeric``."""
LANGUAGES = emitters_of(("c", "python"))


@dataclass(frozen=True)
class Judged:
    """A compiled arm, and its description `robot`, which is used to verify the solutions."""

    robot: SerialRobot
    arm: chasles.Robot

    def fixed(self, q: np.ndarray) -> dict[str, np.ndarray]:
        """Return the fixed joint values that ``ik`` requires."""
        return fixed_at(self.arm, q)

    def true_poses(self, q: np.ndarray) -> np.ndarray:
        """Compute tool poses (..., 4, 4) in extended precision from the joint placements."""
        before, *placed = (E.astype(np.longdouble) for E in numbers(self.robot))
        T = np.broadcast_to(before, (*q.shape[:-1], 4, 4))
        for k, (joint, E) in enumerate(zip(self.robot.moving, placed, strict=True)):
            along = q[..., k].astype(np.longdouble) * joint.direction
            zero = np.zeros_like(along)
            angle, height = (along, zero) if joint.kind == "revolute" else (zero, along)
            c, s = np.cos(angle), np.sin(angle)
            rows = [[c, -s, zero, zero], [s, c, zero, zero], [zero, zero, zero + 1, height]]
            motion = np.array([*rows, [zero, zero, zero, zero + 1]])
            T = T @ np.moveaxis(motion, (0, 1), (-2, -1)) @ E
        return T

    def lost(self, q: np.ndarray) -> tuple[int, ...]:
        """Count nonsingular configurations, missing ones, unsolved poses and wrong solutions."""
        parts = np.array_split(q, max(1, -(-len(q) // PART)))
        return tuple(map(int, np.sum([self._lost(part) for part in parts], axis=0)))

    def _lost(self, q: np.ndarray) -> list[int]:
        T, J = self.arm.fk_jacobian_mixed(q)
        solutions = self.arm.ik(T, fixed=self.fixed(q))
        there = solutions.valid & (apart(solutions.q, q[:, None], slides_of(self.robot)) < SAME)
        left = np.delete(J, [k for k in range(q.shape[1]) if self.is_fixed(k)], axis=2)
        regular = np.linalg.svd(left, compute_uv=False)[:, -1] > REGULAR
        off = np.abs(self.true_poses(solutions.q) - T[:, None]).max((-1, -2))
        wrong = solutions.valid & ~(off <= WRONG)
        marks = (regular, ~there.any(-1) & regular, solutions.count == 0, wrong)
        return [mark.sum() for mark in marks]

    def is_fixed(self, joint: int) -> bool:
        """Test whether the value of a joint is an input of ``ik``."""
        return any(joint == item.index for item in self.arm.redundancy)

    def elsewhere(self, q: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Find other configurations with the same poses by iteration from random start values."""
        found = self.arm.ik_numeric(self.arm.fk(q), random.uniform(-np.pi, np.pi, q.shape))
        return np.asarray(found.q[found.valid])

    def counts(self, T: np.ndarray, q: np.ndarray, random: np.random.Generator) -> int:
        """Count poses for which ``ik`` and Newton's method find different numbers of solutions.

        The configurations q (m, n) contain the values of the fixed joints.
        """
        own = self.arm.ik(T, fixed=self.fixed(q)).count
        others = [len(self.everywhere(*one, random)) for one in zip(T, q, strict=True)]
        return int((own != others).sum())

    def everywhere(
        self, T: np.ndarray, at: np.ndarray, random: np.random.Generator
    ) -> list[np.ndarray]:
        """Find the solutions of a pose by Newton's method from random start configurations."""
        n = len(at)
        free = [k for k in range(n) if not self.is_fixed(k)]
        q = np.tile(at, (STARTS, 1))
        q[:, free] = random.uniform(-np.pi, np.pi, (STARTS, len(free)))
        moving = np.arange(STARTS)
        for _ in range(STEPS):
            now, J = self.arm.fk_jacobian_mixed(q[moving])
            step = np.linalg.solve(J[..., free] + 1e-12 * np.eye(6), errors(T, now)[..., None])
            step = step[..., 0] / np.maximum(1, 2 * np.abs(step[..., 0]).max(-1, keepdims=True))
            q[np.ix_(moving, free)] += step
            moving = moving[np.abs(step).max(-1) > STILL]
            if not moving.size:
                break
        q = q[np.abs(self.arm.fk(q) - T).max((-1, -2)) < 1e-10]
        found: list[np.ndarray] = []
        for one in q:
            if all(apart(one, other, slides_of(self.robot)) > 1e-5 for other in found):
                found.append(one)
        return found


def configurations(
    robot: SerialRobot, count: int, right: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return ``count`` random configurations and ``right`` ones at multiples of 90 degrees."""
    n = len(robot.moving)
    q = rng.uniform(-np.pi, np.pi, (count, n))
    quarters = rng.integers(0, 4, (right, n)) * np.pi / 2
    for k in slides_of(robot):
        q[:, k] = rng.uniform(-SLIDE, SLIDE, count)
        quarters[:, k] = np.round(rng.uniform(-SLIDE, SLIDE, right), 1)
    return q, quarters


def apart(q: np.ndarray, other: np.ndarray, slides: Collection[int] = ()) -> np.ndarray:
    """Return the maximum joint difference (rad, m), modulo full turns of revolute joints."""
    turns = np.array([k not in slides for k in range(q.shape[-1])])
    difference = q - other
    wrapped = (difference + np.pi) % (2 * np.pi) - np.pi
    return np.asarray(np.abs(np.where(turns, wrapped, difference)).max(-1))


def errors(T: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Return pose errors (..., 6) in base axes: position error, and rotation axis times sine."""
    E = T[..., :3, :3] @ np.swapaxes(A[..., :3, :3], -1, -2)
    w = [E[..., 2, 1] - E[..., 1, 2], E[..., 0, 2] - E[..., 2, 0], E[..., 1, 0] - E[..., 0, 1]]
    return np.concatenate([T[..., :3, 3] - A[..., :3, 3], np.stack(w, -1) / 2], -1)


def trial(number: int) -> Outcome:
    robot, rng = arm_of(number), np.random.default_rng([number, 1])
    n = len(robot.moving)
    with TemporaryDirectory() as folder:
        arm = loaded(robot, Path(folder), ITERATED if n > SIX else DERIVED)
    judged = Judged(robot, arm)
    q = rng.uniform(-np.pi, np.pi, (RANDOM, n))
    sets = {"random": q, "right angles": rng.integers(0, 4, (RIGHT, n)) * np.pi / 2}
    some = q[:COUNTED]
    T = arm.fk(some)
    other_counts = judged.counts(T, some, rng)
    if n > SIX:
        sets["other fixed values"] = judged.elsewhere(q[:OTHERS], rng)
        other_counts += judged.counts(T, rng.uniform(-np.pi, np.pi, some.shape), rng)
    counts = {"poses": sum(map(len, sets.values())), "other counts by Newton": other_counts}
    found = {name: judged.lost(of) for name, of in sets.items()}
    failures = [
        f"{robot.name}, {n} joints, {name}: {text}"
        for name, of in found.items()
        for text in violations(*of)
    ]
    return Outcome(counts, tuple(failures))


def arm_of(number: int) -> SerialRobot:
    """Return a random arm, whose number of joints depends on the trial number."""
    kinds = (random_arm, lambda seed: random_arm(seed, "///////"), long_arm)
    return kinds[number % len(kinds)](number)


def loaded(
    robot: SerialRobot, folder: Path, functions: Sequence[str] = DERIVED, **families: tuple[()]
) -> chasles.Robot:
    """Derive, compile and load a robot."""
    put(files_of(derive(robot, functions=functions, **families), LANGUAGES), folder)
    return chasles.load(folder)


def violations(regular: int, lost: int, none: int, wrong: int, may_lose: float = 0) -> list[str]:
    """Return failure messages for lost configurations, unsolved poses and wrong solutions."""
    found = {"lost": lost * (lost > may_lose), "without a solution": none, "wrong": wrong}
    return [f"{count} {name}, {regular} regular" for name, count in found.items() if count]


CAMPAIGN = Campaign(
    "general",
    "The inverse of an arm without a structure finds every pose's configuration, and all solutions "
    "are true.",
    trial,
)
