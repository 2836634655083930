"""Computes all real inverse kinematics solutions of a general arm for one pose.

The generated LaTeX article about the arm shows the real solutions for one pose as an example.

The equation M(theta) u = 0 for the suppressed angle theta is a quadratic eigenvalue problem in
tan(theta / 2). The generated C code needs no eigenvalue library. Newton's method reduces the pose
error of each solution.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...model.tolerances import ALMOST_REAL, DISTINCT_SOLUTION, SOLVED_POSE
from .elimination_choice import length
from .line_quantities import Array
from .raghavan_roth import EliminationOrder, equations, forward, moved, suppressed

NEWTON = 30
TURNS = 12
"""Number of candidate offsets of the suppressed angle. The solver uses the offset for which the
leading matrix of the eigenvalue problem has the smallest condition number."""


def real_solutions(
    constants: Sequence[Array],
    orders: Sequence[EliminationOrder],
    T: Array,
    slides: Collection[int] = (),
) -> list[Array]:
    """Return the sorted inverse kinematics solutions of a six-joint arm for one pose.

    Args:
        constants: Seven constant transformations before, between and after the joints, from the
            base to the tool.
        orders: Elimination orders.
        T: Target pose (4, 4).
        slides: Indices of the prismatic joints.

    Returns:
        Joint values (6,) of each solution, with angles from -pi to pi.
    """
    size = length(constants)
    scaled = [np.vstack([np.hstack([E[:3, :3], E[:3, 3:] / size]), E[3:]]) for E in (*constants, T)]
    arm, target = _Six(tuple(scaled[:-1]), frozenset(slides)), scaled[-1]
    found: list[Array] = []
    for order in orders:
        for start in _starts(arm, order, target):
            q = _refined(arm, start, target)
            if q is not None and all(arm.apart(q, p) > DISTINCT_SOLUTION for p in found):
                found.append(q)
    units = np.where(arm.turns, 1.0, size)
    return sorted((units * q for q in found), key=lambda q: np.round(q, 6).tolist())


@dataclass(frozen=True)
class _Six:
    """Numeric placements of a six-joint arm, with lengths divided by the arm length.

    Attributes:
        constants: The placements before, between and after the six joints.
        slides: Indices of the prismatic joints among the six joints.
    """

    constants: tuple[Array, ...]
    slides: frozenset[int]

    @property
    def turns(self) -> Array:
        return np.array([k not in self.slides for k in range(6)])

    def pose_jacobian(self, q: Array) -> tuple[Array, Array]:
        T, axes = self.constants[0], []
        for k, (value, E) in enumerate(zip(q, self.constants[1:], strict=True)):
            axes.append((T[:3, 2], T[:3, 3]))
            T = T @ moved(value, k in self.slides) @ E
        columns = [
            [*h, 0.0, 0.0, 0.0] if k in self.slides else [*np.cross(h, T[:3, 3] - p), *h]
            for k, (h, p) in enumerate(axes)
        ]
        return T, np.array(columns).T

    def apart(self, a: Array, b: Array) -> float:
        return float(np.abs(self.wrapped(a - b)).max())

    def wrapped(self, q: Array) -> Array:
        return np.where(self.turns, (q + np.pi) % (2 * np.pi) - np.pi, q)


def _starts(arm: _Six, order: EliminationOrder, target: Array) -> Iterator[Array]:
    found = equations(arm.constants, order, target, arm.slides)
    M = suppressed(found, order.halved)
    for angle in _roots(M):
        at = np.tensordot(_harmonics(angle), M, 1)
        U, _, Vt = np.linalg.svd(np.linalg.svd(at)[2][-1].reshape(4, 3))
        half = 2 * np.arctan2(U[3, 0], U[2, 0])
        other = Vt[0] / Vt[0, 0]
        two = (other, _harmonics(half)) if order.halved else (_harmonics(half), other)
        right = np.tensordot(_harmonics(angle), found.right, 1) @ np.outer(*two).ravel()
        y = np.linalg.lstsq(found.left[:, 1:], right - found.left[:, 0], rcond=None)[0]
        powers = [[1.0, y[2], y[5]], [1.0, y[0], y[1]], _harmonics(angle), *two]
        q = np.zeros(6)
        for joint, (_, x, square) in zip(order.joints[:5], powers, strict=True):
            q[joint] = order.sense * (x if joint in arm.slides else np.arctan2(square, x))
        yield _with_last(q, order.joints[5], arm, target)


def _harmonics(angle: float) -> Array:
    return np.array([1.0, np.cos(angle), np.sin(angle)])


def _roots(M: Array) -> list[float]:
    origins = 2 * np.pi * np.arange(TURNS) / TURNS
    turns = [M[1] * np.cos(o) + M[2] * np.sin(o) for o in origins]
    best = int(np.argmin([np.linalg.cond(M[0] - turn) for turn in turns]))
    c, s = turns[best], M[2] * np.cos(origins[best]) - M[1] * np.sin(origins[best])
    lowest, middle = (np.linalg.solve(M[0] - c, part) for part in (M[0] + c, 2 * s))
    zero, one = np.zeros((12, 12)), np.eye(12)
    tangents = np.linalg.eigvals(np.block([[zero, one], [-lowest, -middle]]))
    real = [t.real for t in tangents if abs(t.imag) <= ALMOST_REAL * (1 + abs(t) ** 2)]
    return [origins[best] + 2 * float(np.arctan(t)) for t in real]


def _with_last(q: Array, last: int, arm: _Six, target: Array) -> Array:
    constants, sliding = arm.constants, arm.slides
    before = forward(constants[: last + 1], q[:last].tolist(), sliding)[:3, :3]
    after = [k - last - 1 for k in sliding]
    behind = forward([np.eye(4), *constants[last + 2 :]], q[last + 1 :].tolist(), after)[:3, :3]
    turn = before.T @ target[:3, :3] @ (constants[last + 1][:3, :3] @ behind).T
    q[last] = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
    return q


def _refined(arm: _Six, q: Array, target: Array) -> Array | None:
    for _ in range(NEWTON):
        T, J = arm.pose_jacobian(q)
        E = target[:3, :3] @ T[:3, :3].T
        turn = np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]]) / 2
        off = np.append(target[:3, 3] - T[:3, 3], turn)
        if np.abs(target - T).max() <= SOLVED_POSE:
            return arm.wrapped(q)
        step = np.linalg.lstsq(J, off, rcond=None)[0]
        q = q + step / max(1.0, float(np.linalg.norm(step)))
    return None
