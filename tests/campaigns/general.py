"""``python -m bench general``: arms without a structure, judged and timed one by one.

Random arms of six joints (--arms), of seven (--sevens) and of seven to ten of which some may slide
(--longs), from number --first on, and the arms of URDF files. Each is derived into a temporary
folder. For random poses (--poses) and right angles (--right), a line tells

    lost     poses of which the configuration that made them is not among the solutions
    none     poses without any solution
    wrong    solutions called valid whose pose, in extended precision, is off by more than 1e-8
    counts   poses (--counted) whose number of solutions differs from that of Newton's iteration
    single, batch   microseconds a pose, on one thread

Arms of seven joints are asked for the same poses at other given values (--others): those of
configurations to which Levenberg and Marquardt's iteration leads from a random start, and, for the
counts, any values.

A configuration at which the Jacobian is singular is not looked for: solutions are not isolated.
"""

import argparse
import re
import tempfile
import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import chasles
from bench.report import out
from chasles.derive import Robot, write
from chasles.derive.description.urdf import from_urdf
from chasles.derive.inverse.general.raghavan_roth import numbers
from chasles.derive.inverse.general.split_choice import slides_of
from tests.support.generators.random_arms import long_arm, random_arm

SAME = 1e-6
"""rad: solutions closer than this are one."""
WRONG = 1e-8
"""m or an entry of a rotation: a solution further off is wrong; the runtime allows 1e-9."""
REGULAR = 1e-5
"""Least singular value (m or rad per rad) of a Jacobian whose solution is isolated."""
STARTS, STEPS = 1500, 60
STILL = 1e-12
"""rad: an iteration whose step is smaller has ended."""
SINGLES = 200
SIX = 6
SLIDE = 0.5
"""Metres by which slides move to either side."""
DERIVED = ["fk", "ik", "fk_jacobian_mixed"]
ITERATED = [*DERIVED, "hessian_mixed"]
"""With what the iteration to other configurations of a pose takes."""


@dataclass(frozen=True)
class Judged:
    """An arm, derived and loaded.

    Attributes:
        robot: Its description.
        arm: Its functions.
    """

    robot: Robot
    arm: chasles.Robot

    def given(self, q: np.ndarray) -> list[np.ndarray]:
        """The values of the joints that are given."""
        names = [joint.name for joint in self.robot.coordinates]
        wanted = [a.meaning for a in self.arm.redundancy]
        return [q[..., k] for k, name in enumerate(names) if f"of {name}," in " ".join(wanted)]

    def true_poses(self, q: np.ndarray) -> np.ndarray:
        """Poses (..., 4, 4) in extended precision, by the placements alone."""
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

    def lost(self, q: np.ndarray) -> tuple[int, int, int, int]:
        """Of these configurations' poses: regular ones, those lost, without any, and wrong."""
        T, J = self.arm.fk_jacobian_mixed(q)
        solutions = self.arm.ik(T, *self.given(q))
        there = solutions.valid & (apart(solutions.q, q[:, None], slides_of(self.robot)) < SAME)
        left = np.delete(J, [k for k in range(q.shape[1]) if self.is_given(k)], axis=2)
        regular = np.linalg.svd(left, compute_uv=False)[:, -1] > REGULAR
        off = np.abs(self.true_poses(solutions.q) - T[:, None]).max((-1, -2))
        lost = ~there.any(-1) & regular
        wrong = solutions.valid & (off > WRONG)
        return int(regular.sum()), int(lost.sum()), int((solutions.count == 0).sum()), wrong.sum()

    def is_given(self, joint: int) -> bool:
        """Whether a joint's value is given."""
        name = self.robot.coordinates[joint].name
        return any(f"of {name}," in argument.meaning for argument in self.arm.redundancy)

    def elsewhere(self, q: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Configurations (m, n) of the poses of others, reached by iteration from random starts."""
        found = self.arm.ik_numeric(self.arm.fk(q), random.uniform(-np.pi, np.pi, q.shape))
        return np.asarray(found.q[found.success])

    def counts(self, T: np.ndarray, q: np.ndarray, random: np.random.Generator) -> int:
        """How many poses have another number of solutions than Newton's iteration finds.

        Args:
            T: The poses (m, 4, 4).
            q: Configurations (m, n) whose given values are taken.
            random: Draws the starts.
        """
        own = self.arm.ik(T, *self.given(q)).count
        others = [len(self.everywhere(*one, random)) for one in zip(T, q, strict=True)]
        return int((own != others).sum())

    def everywhere(
        self, T: np.ndarray, at: np.ndarray, random: np.random.Generator
    ) -> list[np.ndarray]:
        """Solutions of a pose by Newton's iteration from random configurations."""
        n = len(at)
        free = [k for k in range(n) if not self.is_given(k)]
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

    def times(self, q: np.ndarray) -> tuple[float, float]:
        """Microseconds a pose: single calls, and in a batch on one thread."""
        T, given = self.arm.fk(q), self.given(q)
        some = [(T[k], *(values[k] for values in given)) for k in range(SINGLES)]
        single = min(_seconds(lambda: [self.arm.ik(*one) for one in some]) for _ in range(5))
        batch = min(_seconds(lambda: self.arm.ik(T, *given, threads=1)) for _ in range(5))
        return single / SINGLES * 1e6, batch / len(T) * 1e6


def configurations(
    robot: Robot, count: int, right: int, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """So many random configurations (count, n), and so many at right angles (right, n)."""
    random, n = np.random.default_rng(seed), len(robot.moving)
    q = random.uniform(-np.pi, np.pi, (count, n))
    quarters = random.integers(0, 4, (right, n)) * np.pi / 2
    for k in slides_of(robot):
        q[:, k] = random.uniform(-SLIDE, SLIDE, count)
        quarters[:, k] = np.round(random.uniform(-SLIDE, SLIDE, right), 1)
    return q, quarters


def apart(q: np.ndarray, other: np.ndarray, slides: Collection[int] = ()) -> np.ndarray:
    """The largest difference of a joint (rad, m), of one that turns the shorter way round."""
    turns = np.array([k not in slides for k in range(q.shape[-1])])
    difference = q - other
    wrapped = (difference + np.pi) % (2 * np.pi) - np.pi
    return np.asarray(np.abs(np.where(turns, wrapped, difference)).max(-1))


def errors(T: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Position, and axis times sine, from the poses A to T, (..., 6), in base axes."""
    E = T[..., :3, :3] @ np.swapaxes(A[..., :3, :3], -1, -2)
    w = [E[..., 2, 1] - E[..., 1, 2], E[..., 0, 2] - E[..., 2, 0], E[..., 1, 0] - E[..., 0, 1]]
    return np.concatenate([T[..., :3, 3] - A[..., :3, 3], np.stack(w, -1) / 2], -1)


def _seconds(work: object) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def arms(options: argparse.Namespace) -> Iterator[Robot]:
    """The arms that the command line asks for."""
    yield from (random_arm(seed) for seed in range(options.first, options.first + options.arms))
    first = options.first + 1000
    yield from (random_arm(first + seed, "///////") for seed in range(options.sevens))
    first = options.first + 2000
    yield from (long_arm(first + seed) for seed in range(options.longs))
    yield from (from_urdf(path) for path in options.urdf)


def line(robot: Robot, options: argparse.Namespace) -> str:
    """An arm's results in a line."""
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        write(robot, Path(folder), ITERATED if options.others else DERIVED)
        derived = time.process_time() - start
        arm = chasles.load(folder)
    if "ik" not in arm.functions:
        return f"{robot.name:24} no ik"
    judged, random = Judged(robot, arm), np.random.default_rng(options.seed)
    n = len(robot.coordinates)
    q = random.uniform(-np.pi, np.pi, (options.poses, n))
    right = random.integers(0, 4, (options.right, n)) * np.pi / 2
    parts = [f"{robot.name:24} derived {derived:4.1f} s"]
    sets = {"random": q, "right": right}
    if n > SIX and options.others:
        sets["elsewhere"] = judged.elsewhere(q[: options.others], random)
    for name, some in sets.items():
        regular, lost, none, wrong = judged.lost(some)
        parts.append(f"{name} {regular}/{len(some)}: lost {lost} none {none} wrong {wrong}")
    some = q[: options.counted]
    T = arm.fk(some)
    parts.append(f"counts {judged.counts(T, some, random)}/{len(some)}")
    if n > SIX and options.others:
        drawn = random.uniform(-np.pi, np.pi, some.shape)
        parts.append(f"at any value {judged.counts(T, drawn, random)}/{len(some)}")
    single, batch = judged.times(q[:2000])
    return "; ".join([*parts, f"single {single:.1f} batch {batch:.1f} us"])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command line."""
    parser.add_argument("urdf", nargs="*", type=Path)
    defaults = {"arms": 20, "sevens": 3, "longs": 3, "poses": 2000, "right": 1000}
    for name, default in defaults.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--counted", type=int, default=10)
    parser.add_argument("--others", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first arm")
    parser.add_argument("--seed", type=int, default=0)


def run(options: argparse.Namespace) -> int:
    """Prints a line for each arm; returns 1 if a solution is lost or wrong."""
    failed = False
    for robot in arms(options):
        found = line(robot, options)
        out.print(found, soft_wrap=True)
        failed |= re.search(r"(lost|none|wrong) [1-9]|no ik", found) is not None
    return int(failed)
