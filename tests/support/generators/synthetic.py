"""Random arms with a specified axis structure, and their inverse kinematics functions in CasADi.

A text describes the axes and the relations between adjacent axes, from the base to the last axis:

    `R`:  A revolute joint.
    `r`:  A revolute joint whose axis intersects both adjacent axes in one point.
    `P`:  A prismatic joint.
    `p`:  A prismatic joint that no rotation follows.
    `=`:  Parallel axes.
    `x`:  Intersecting axes.
    `+`:  Axes that intersect at right angles.
    `/`:  Skew axes.
    `L`:  Skew axes at right angles.

For example, "R+R=R/RxrxR" describes a Puma. NumPy computes test poses from the screws,
independently of the compiler.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from types import SimpleNamespace
from zlib import crc32

import casadi as ca
import numpy as np

from chasles.derive import SerialRobot, read_text
from chasles.derive.inverse.serial_inverse import Inverses, inverses
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import SymbolicFunction
from chasles.derive.terms.terms import Terms
from tests.support.generators.poses import Case
from tests.support.oracles.screws import Screws, turned
from tests.support.oracles.verdict import VALID
from tests.support.peers.interface import Answers

DEGREE = np.pi / 180


@dataclass(frozen=True)
class Row:
    """A Denavit-Hartenberg row with decimal numbers, in meter and degree."""

    kind: str
    a: str
    alpha: str
    d: str
    theta: str


def rows_of(chain: str, *, right: bool, seed: int = 0) -> tuple[Row, ...]:
    """Return a random chain with a specified structure."""
    of_chain = crc32(chain.encode()) + right
    rng = np.random.default_rng([of_chain, seed] if seed else of_chain)
    axes, between = chain[::2], chain[1::2] + "/"
    rows = []
    for axis, link in zip(axes, between, strict=True):
        across = right or link in "+L"
        alpha = rng.choice((90, -90)) if across else rng.choice((-1, 1)) * rng.integers(25, 156)
        theta = 0 if right or axis == "p" else int(rng.integers(-170, 171))
        rows.append(
            Row(
                axis.upper(),
                "0" if link in "x+" else f"{rng.choice((-1, 1)) * rng.uniform(0.2, 0.6):.3f}",
                str(rng.choice((0, 180)) if link == "=" else alpha),
                "0" if axis in "rPp" else f"{rng.choice((-1, 1)) * rng.uniform(0.1, 0.4):.3f}",
                str(theta),
            )
        )
    return tuple(rows)


def described(rows: tuple[Row, ...]) -> str:
    lines = ['name = "arm"', 'convention = "dh"', 'units = { length = "m", angle = "deg" }']
    kinds = {"R": "revolute", "P": "prismatic"}
    for k, row in enumerate(rows):
        values = {"a": row.a, "alpha": row.alpha, "d": row.d, "theta": row.theta}
        lines += ["[[joints]]", f'name = "j{k + 1}"', f'type = "{kinds[row.kind]}"']
        lines += [f'{name} = "{value}"' for name, value in values.items() if float(value)]
    return "\n".join(lines)


def screws_of(rows: tuple[Row, ...]) -> Screws:
    T, frames = np.eye(4), []
    for row in rows:
        frames.append(T)
        T = T @ _screw(2, float(row.theta) * DEGREE, float(row.d))
        T = T @ _screw(0, float(row.alpha) * DEGREE, float(row.a))
    turns = np.array([[row.kind == "R"] for row in rows])
    z = np.array([F[:3, 2] for F in frames])
    axes, origins = np.where(turns, z, 0.0), np.array([F[:3, 3] for F in frames])
    points = origins - np.sum(origins * axes, axis=1, keepdims=True) * axes
    return Screws(axes, points, np.where(turns, 0.0, z), T)


def _screw(axis: int, angle: float, shift: float) -> np.ndarray:
    """Return the pose (4, 4) of a rotation about and a shift along the same coordinate axis."""
    T = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[i, i] = T[j, j] = np.cos(angle)
    T[j, i], T[i, j] = np.sin(angle), -np.sin(angle)
    T[axis, 3] = shift
    return T


@dataclass(frozen=True)
class Found:
    """Solutions of m targets with k slots each: q (m, k, n), residual and margin (m, k)."""

    q: np.ndarray
    residual: np.ndarray
    margin: np.ndarray

    @property
    def valid(self) -> np.ndarray:
        """Whether each solution slot contains a solution, (m, k)."""
        return self.residual <= VALID


class Function:
    """A derived function, evaluated on arrays with CasADi."""

    def __init__(self, function: SymbolicFunction) -> None:
        self.inputs, self.outputs, self.signs = function.inputs, function.outputs, function.signs
        self.kernel = lower([function], "arm")[0]

    def __call__(self, *arguments: np.ndarray) -> Found | np.ndarray:
        """Evaluate the function.

        The result of an inverse kinematics function contains all solution slots.
        """
        sizes = [len(argument.shape) for argument in self.inputs]
        lead = np.shape(arguments[0])[: np.ndim(arguments[0]) - sizes[0]]
        columns = [
            ca.DM(np.reshape(value, (-1, argument.size)).T)
            for value, argument in zip(arguments, self.inputs, strict=True)
        ]
        slots = list(product((1.0, -1.0), repeat=len(self.signs)))
        values = [self._outputs(columns, signs) for signs in slots]
        whole = [
            np.stack(of, axis=1).reshape(*lead, len(slots), -1) for of in zip(*values, strict=True)
        ]
        if len(whole) == 1:
            return whole[0].reshape(lead)
        return Found(whole[0], whole[1][..., 0], whole[2][..., 0])

    def _outputs(self, columns: list[ca.DM], signs: tuple[float, ...]) -> list[np.ndarray]:
        count = columns[0].shape[1]
        chosen = [np.tile(np.array(signs)[:, None], (1, count))] if signs else []
        found = self.kernel(*columns, *chosen)
        return [np.array(of).T for of in (found if isinstance(found, tuple) else (found,))]


def jacobian(chain: Screws, q: np.ndarray) -> np.ndarray:
    """Return the mixed Jacobian (..., 6, n), with the linear velocity rows first."""
    n = len(chain.axes)
    at_zero = np.stack([chain.axes, chain.slides, chain.points], axis=1).reshape(-1, 3)
    at_zero = np.vstack([at_zero, chain.home[:3, 3]]).T
    is_point = np.array([0, 0, 1] * n + [1])
    columns = np.broadcast_to(at_zero, (*q.shape[:-1], 3, 3 * n + 1)).copy()
    # Each joint moves the tip and all later joints with their axes, slide directions and points.
    for k in reversed(range(n)):
        after, value = columns[..., 3 * k + 3 :], q[..., k, None, None]
        where = is_point[3 * k + 3 :]
        shift, travel = (part[k, :, None] * where for part in (chain.points, chain.slides))
        after[...] = turned(after - shift, chain.axes[k], value) + shift + value * travel
    h, u, points = (columns[..., part : 3 * n : 3] for part in range(3))
    velocity = np.cross(h, columns[..., -1:] - points, axis=-2) + u
    return np.concatenate([velocity, h], axis=-2)


def robot_of(chain: str, *, right: bool = False, seed: int = 0) -> SerialRobot:
    """Return a random chain with a specified structure."""
    robot = read_text(described(rows_of(chain, right=right, seed=seed)))
    assert isinstance(robot, SerialRobot)
    return robot


@dataclass(frozen=True)
class Arm(Case):
    """A random chain as a benchmark case.

    The name of the case is the name of the arm's kinematic structure.

    Attributes:
        right: Whether the angles between skew axes are right angles.
    """

    right: bool = False

    @cached_property
    def inverses(self) -> Inverses:
        robot = robot_of(self.name, right=self.right)
        return inverses(robot, Terms({p.symbol: p.value for p in robot.parameters}))

    @cached_property
    def screws(self) -> Screws:
        return screws_of(rows_of(self.name, right=self.right))

    @cached_property
    def robot(self) -> SimpleNamespace:
        """The robot interface that the benchmarks require."""
        kinds = self.name[::2].upper()
        unlimited = np.full(len(kinds), np.inf)
        return SimpleNamespace(
            n=len(kinds),
            loops=(),
            coordinates=[
                SimpleNamespace(name=f"j{k + 1}", unit="rad" if kind == "R" else "m")
                for k, kind in enumerate(kinds)
            ],
            lower=-unlimited,
            upper=unlimited,
            functions={name: Function(f) for name, f in self.inverses.functions.items()},
            fk=self.screws.fk,
            jacobian_mixed=lambda q: jacobian(self.screws, q),
        )

    def found(self, q: np.ndarray) -> Found:
        """Return all solution slots for the targets computed from the coordinates q (m, n)."""
        return self.robot.functions[self.function](self.targets(q), *self.others(q))

    def answers(self, q: np.ndarray) -> Answers:
        found = self.found(q)
        return Answers(found.q, found.valid)
