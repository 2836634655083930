"""Robots, tasks and coordinate sets for tests of inverse kinematics functions.

Targets are computed from joint coordinates, so every target is reachable. A coordinate set contains
random values, multiples of 90 degrees, singular configurations, or values near such angles or
configurations. Bisection of a Jacobian determinant along a joint finds the singularities of any
robot.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np

import chasles
from tests.support.oracles.screws import Screws, screws
from tests.support.oracles.tasks import TASKS, Task

DECADES = tuple(10.0**-k for k in range(3, 13))
SINGULAR = 1e-12
"""A configuration is singular if its smallest singular value [m or 1] is below this limit."""
SAMPLES = 48
BISECTIONS = 60
STROKE = 1.0
"""Assumed range of an unlimited prismatic joint in either direction [m]."""


@dataclass(frozen=True)
class Singularity:
    """A type of singularity: at certain values of one joint, a Jacobian determinant is zero.

    Attributes:
        joint: Index of the joint that is moved to a singular configuration.
        rows: Rows of the task Jacobian that become linearly dependent, with () for all rows.
        columns: Columns of the task Jacobian that become linearly dependent, with () for all
            coordinates that the inverse kinematics solves.
    """

    joint: int
    rows: tuple[int, ...] = ()
    columns: tuple[int, ...] = ()


@dataclass(frozen=True)
class Case:
    """A robot and one of its inverse kinematics functions to test.

    Attributes:
        name: The robot's name.
        function: Name of the inverse kinematics function.
        singular: The singularities, keyed by type.
        free: Joints that the task does not determine.
        most: Maximum number of solutions per target.
    """

    name: str
    function: str = "ik"
    singular: dict[str, Singularity] = field(default_factory=dict)
    free: tuple[int, ...] = ()
    most: int = 8

    @cached_property
    def robot(self) -> chasles.Robot:
        return chasles.load(self.name)

    @cached_property
    def screws(self) -> Screws:
        return screws(self.name)

    @property
    def task(self) -> Task:
        return TASKS[self.function]

    @cached_property
    def given(self) -> tuple[str, ...]:
        """Names of all inputs of the inverse kinematics function except the target."""
        inputs = self.robot.functions[self.function].inputs
        return tuple(argument.name for argument in inputs[1:])

    @property
    def turns(self) -> np.ndarray:
        """Whether each coordinate is an angle, (n,)."""
        return np.array([c.unit == "rad" for c in self.robot.coordinates])

    def targets(self, q: np.ndarray) -> np.ndarray:
        """Return the task targets that the robot reaches at q (..., n)."""
        return self.task.target(self.pose(q))

    def pose(self, q: np.ndarray) -> np.ndarray:
        """Return poses (..., 4, 4) at q (..., n) by the product of exponentials."""
        return self.screws.fk(self.robot.chain(q) if self.robot.loops else q)

    def others(self, q: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the values of the additional inputs of the inverse kinematics at q (..., n)."""
        return tuple(self._other(name, q) for name in self.given)

    def _other(self, name: str, q: np.ndarray) -> np.ndarray:
        if name in self.robot.functions:
            return self.robot.functions[name](q)
        if self.coordinate(name) is not None:
            return q[..., self.coordinate(name)]
        chain = [joint.name for joint in self.robot.chain_joints]
        return self.robot.chain(q)[..., chain.index(name)]

    def coordinate(self, name: str) -> int | None:
        """Return the index of a coordinate from its name or its symbol, such as q7.

        Returns None for a main-chain joint that is not a coordinate, because the loops determine
        the value of this joint.
        """
        names = [coordinate.name for coordinate in self.robot.coordinates]
        if name in names:
            return names.index(name)
        number = name.removeprefix("q")
        return int(number) - 1 if number.isdigit() else None

    @property
    def solved(self) -> tuple[int, ...]:
        """Indices of the coordinates that the inverse kinematics solves."""
        given = [name for name in self.given if name not in self.robot.functions]
        known = {*self.free, *map(self.coordinate, given)}
        return tuple(k for k in range(self.robot.n) if k not in known)

    def error(self, q: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Return the larger of position error [m] and angle error [rad] at q (..., n)."""
        return self.task.error(self.pose(q), target)

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """Return the derivative (..., rows, n) of the task with respect to q."""
        return self.task.jacobian(self.robot.fk(q), self.robot.jacobian_mixed(q))

    def square(self, singularity: Singularity, q: np.ndarray) -> np.ndarray:
        """Return the square submatrix of the task Jacobian that becomes singular."""
        J = self.jacobian(q)
        rows = list(singularity.rows) or list(range(J.shape[-2]))
        return J[..., rows, :][..., list(singularity.columns or self.solved)]

    def random(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return random coordinates (count, n) at which all loops close."""
        found = np.empty((0, self.robot.n))
        while len(found) < count:
            q = rng.uniform(*self.range, (count, self.robot.n))
            q[:, list(self.free)] = 0.0
            found = np.concatenate([found, q[self.robot.loops_close(q)] if self.robot.loops else q])
        return found[:count]

    @property
    def range(self) -> tuple[np.ndarray, np.ndarray]:
        """The sampling range: lower bounds (n,) and upper bounds (n,)."""
        whole = np.where(self.turns, np.pi, STROKE)
        limited = ~self.turns | bool(self.robot.loops)
        lower, upper = self.robot.lower, self.robot.upper
        return (
            np.where(limited & np.isfinite(lower), lower, -whole),
            np.where(limited & np.isfinite(upper), upper, whole),
        )


@dataclass(frozen=True)
class PoseSet:
    """Coordinates that define reachable targets.

    Attributes:
        name: The name of the pose set in the benchmark.
        q: Coordinates (m, n).
        regular: Whether ``Verdict.lost`` is counted: the number of targets whose generating
            coordinates are missing from the solutions. If False, the set may contain singular
            configurations.
    """

    name: str
    q: np.ndarray
    regular: bool = False


@dataclass(frozen=True)
class Sizes:
    """Number of coordinate vectors of each kind."""

    random: int
    singular: int
    grid: int


FULL = Sizes(random=1_000_000, singular=10_000, grid=4**8)
SHORT = Sizes(random=2_000, singular=200, grid=4096)

ARM = {"wrist": Singularity(4), "elbow": Singularity(2), "shoulder": Singularity(1)}
ANGULAR = (3, 4, 5)
SEVEN = {
    "wrist": Singularity(5, ANGULAR, (4, 5, 6)),
    "elbow": Singularity(3, (), (0, 1, 3, 4, 5, 6)),
    "shoulder": Singularity(1, ANGULAR, (0, 1, 2)),
}
CASES = (
    Case("ur5e", singular=ARM),
    Case("puma560", singular=ARM),
    Case("irb6640", singular=ARM),
    Case("stanford", singular={kind: ARM[kind] for kind in ("wrist", "shoulder")}),
    Case("scara", singular={"elbow": Singularity(1, (0, 1, 2, 5))}),
    Case("iiwa14", singular=SEVEN),
    Case("panda", singular={**ARM, "elbow": Singularity(3)}),
    Case(
        "lynxmotion",
        "ik_position_pitch",
        {"wrist": Singularity(3), "elbow": Singularity(2), "shoulder": Singularity(1)},
        free=(4,),
    ),
    Case("bricklaying_planar", "ik_planar", {"elbow": Singularity(1)}),
    Case("photo_robot"),
    Case("board_installer"),
    Case("well_manipulator"),
)


def sets(case: Case, sizes: Sizes, seed: int = 0) -> Iterator[PoseSet]:
    """Yield sets of joint coordinates at which a function is tested."""
    rng = np.random.default_rng(seed)
    yield PoseSet("random", case.random(rng, sizes.random), regular=True)
    if not case.robot.loops:
        grid = _thinned(rng, right_angles(case, rng), sizes.grid)
        yield PoseSet("right angles", grid)
        yield PoseSet("near right angles", nearly(case, rng, grid))
    for kind, singularity in case.singular.items():
        at = singular(case, singularity, rng, sizes.singular)
        yield PoseSet(kind, at)
        near = [_moved(at, singularity.joint, by, rng) for by in DECADES]
        yield PoseSet(f"near {kind}", np.concatenate(near))


def right_angles(case: Case, rng: np.random.Generator) -> np.ndarray:
    """Return coordinates with all combinations of the angles -90, 0, 90 and 180 degrees."""
    quarters = np.arange(-1, 3) * (np.pi / 2)
    moving = [k for k in range(case.robot.n) if case.turns[k] and k not in case.free]
    angles = np.array(list(product(quarters, repeat=len(moving))))
    q = rng.uniform(*case.range, (len(angles), case.robot.n))
    q[:, list(case.free)] = 0.0
    q[:, moving] = angles
    return q


def nearly(case: Case, rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    steps = rng.choice([*DECADES, *(-step for step in DECADES)], q.shape)
    solved = case.turns & ~np.isin(np.arange(q.shape[1]), case.free)
    return q + steps * solved * rng.integers(0, 2, q.shape)


def singular(
    case: Case, singularity: Singularity, rng: np.random.Generator, count: int
) -> np.ndarray:
    """Return coordinates (count, n) with a zero determinant of the task Jacobian.

    Bisection moves one joint to a zero of the determinant. The coordinates of all other joints are
    random. The smallest singular value of the Jacobian at the returned coordinates is below
    SINGULAR.

    Raises:
        ValueError: The determinant does not change sign between the sampled values of the joint.
    """
    found = np.empty((0, case.robot.n))
    while len(found) < count:
        q, below, above = _brackets(case, singularity, rng, case.random(rng, count))
        if not len(q):
            raise ValueError(f"{case.name}: no singularity along joint {singularity.joint}")
        q[:, singularity.joint] = _bisected(case, singularity, q, below, above)
        least = np.linalg.svd(case.square(singularity, q), compute_uv=False)[:, -1]
        found = np.concatenate([found, q[least < SINGULAR]])
    return found[:count]


def _brackets(
    case: Case, singularity: Singularity, rng: np.random.Generator, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (q, low, high).

    The determinant of the task Jacobian changes its sign between the joint values low and high.
    """
    k = singularity.joint
    low, high = -np.pi, np.pi
    if not case.turns[k]:
        high = case.robot.upper[k] if np.isfinite(case.robot.upper[k]) else STROKE
        low = -high
    step = (high - low) / SAMPLES
    values = low + step * (rng.random((len(q), 1)) + np.arange(SAMPLES))
    many = np.repeat(q[:, None], SAMPLES, axis=1)
    many[..., k] = values
    signs = np.sign(np.linalg.det(case.square(singularity, many)))
    changes = signs[:, 1:] * signs[:, :-1] < 0
    chosen = np.argmax(changes * rng.random(changes.shape), axis=1)
    rows = np.flatnonzero(changes.any(axis=1))
    return q[rows], values[rows, chosen[rows]], values[rows, chosen[rows] + 1]


def _bisected(
    case: Case, singularity: Singularity, q: np.ndarray, below: np.ndarray, above: np.ndarray
) -> np.ndarray:
    q = q.copy()

    def determinant(values: np.ndarray) -> np.ndarray:
        q[:, singularity.joint] = values
        return np.linalg.det(case.square(singularity, q))

    sign = np.sign(determinant(below))
    for _ in range(BISECTIONS):
        middle = (below + above) / 2
        same = np.sign(determinant(middle)) == sign
        below, above = np.where(same, middle, below), np.where(same, above, middle)
    return np.where(np.abs(determinant(below)) < np.abs(determinant(above)), below, above)


def _moved(q: np.ndarray, joint: int, by: float, rng: np.random.Generator) -> np.ndarray:
    q = q.copy()
    q[:, joint] += by * rng.choice((-1.0, 1.0), len(q))
    return q


def _thinned(rng: np.random.Generator, q: np.ndarray, most: int) -> np.ndarray:
    return q if len(q) <= most else q[rng.permutation(len(q))[:most]]
