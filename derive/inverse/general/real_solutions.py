"""All real solutions of a general arm for one pose, in numbers, for the example of its article.

The determinant's roots are those of a quadratic eigenvalue problem in the tangent of half the
suppressed angle, M(theta) u = 0, of which the generated C needs no library. Newton's steps on the
pose refine each solution.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from ...model.tolerances import ALMOST_REAL, DISTINCT_SOLUTION, SOLVED_POSE
from .line_quantities import Array
from .raghavan_roth import LineEquations, Split, equations, forward, suppressed, turned
from .split_choice import length

NEWTON = 30
TURNS = 12
"""Origins of the suppressed angle, of which the best conditioned is taken."""


def real_solutions(constants: Sequence[Array], splits: Sequence[Split], T: Array) -> list[Array]:
    """The solutions of six revolute joints without a structure, in order.

    Args:
        constants: The seven placements of the arm, as floats.
        splits: Orders of the joints, whose solutions are put together.
        T: The pose (4, 4).

    Returns:
        The angles (6,) about the joints' z axes, each between -pi and pi, for every solution.
    """
    size = length(constants)
    scaled = [np.vstack([np.hstack([E[:3, :3], E[:3, 3:] / size]), E[3:]]) for E in (*constants, T)]
    *arm, target = scaled
    found: list[Array] = []
    for split in splits:
        for start in _starts(equations(arm, split, target), split, arm, target):
            q = _refined(arm, start, target)
            if q is not None and all(_apart(q, other) > DISTINCT_SOLUTION for other in found):
                found.append(q)
    return sorted(found, key=lambda q: np.round(q, 6).tolist())


def _starts(
    found: LineEquations, split: Split, arm: Sequence[Array], target: Array
) -> Iterator[Array]:
    """Solutions as the equations of a split give them."""
    M = suppressed(found, split.halved)
    for angle in _roots(M):
        at = np.tensordot(_harmonics(angle), M, 1)
        U, _, Vt = np.linalg.svd(np.linalg.svd(at)[2][-1].reshape(4, 3))
        half, other = 2 * np.arctan2(U[3, 0], U[2, 0]), np.arctan2(Vt[0, 2], Vt[0, 1])
        if Vt[0, 0] < 0:
            other += np.pi
        fourth, fifth = (other, half) if split.halved else (half, other)
        x = np.outer(_harmonics(fourth), _harmonics(fifth)).ravel()
        right = np.tensordot(_harmonics(angle), found.right, 1) @ x
        y = np.linalg.lstsq(found.left[:, 1:], right - found.left[:, 0], rcond=None)[0]
        first, second = np.arctan2(y[5], y[2]), np.arctan2(y[1], y[0])
        q = np.zeros(6)
        q[list(split.joints[:5])] = split.sense * np.array([first, second, angle, fourth, fifth])
        yield _with_last(q, split.joints[5], arm, target)


def _harmonics(angle: float) -> Array:
    return np.array([1.0, np.cos(angle), np.sin(angle)])


def _roots(M: Array) -> list[float]:
    """The real angles at which M(theta) is singular."""
    origins = 2 * np.pi * np.arange(TURNS) / TURNS
    turns = [M[1] * np.cos(o) + M[2] * np.sin(o) for o in origins]
    best = int(np.argmin([np.linalg.cond(M[0] - turn) for turn in turns]))
    c, s = turns[best], M[2] * np.cos(origins[best]) - M[1] * np.sin(origins[best])
    lowest, middle = (np.linalg.solve(M[0] - c, part) for part in (M[0] + c, 2 * s))
    zero, one = np.zeros((12, 12)), np.eye(12)
    tangents = np.linalg.eigvals(np.block([[zero, one], [-lowest, -middle]]))
    real = [t.real for t in tangents if abs(t.imag) <= ALMOST_REAL * (1 + abs(t) ** 2)]
    return [origins[best] + 2 * float(np.arctan(t)) for t in real]


def _with_last(q: Array, last: int, arm: Sequence[Array], target: Array) -> Array:
    """The angle of the last joint from the orientation that the others leave."""
    before = forward(arm[: last + 1], q[:last].tolist())[:3, :3]
    behind = forward([np.eye(4), *arm[last + 2 :]], q[last + 1 :].tolist())[:3, :3]
    turn = before.T @ target[:3, :3] @ (arm[last + 1][:3, :3] @ behind).T
    q[last] = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
    return q


def _refined(arm: Sequence[Array], q: Array, target: Array) -> Array | None:
    """A solution by Newton's steps on the pose; None where they do not end at it."""
    for _ in range(NEWTON):
        T, J = _pose_and_jacobian(arm, q)
        E = target[:3, :3] @ T[:3, :3].T
        turn = np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]]) / 2
        off = np.append(target[:3, 3] - T[:3, 3], turn)
        if np.abs(target - T).max() <= SOLVED_POSE:
            return np.asarray((q + np.pi) % (2 * np.pi) - np.pi)
        step = np.linalg.lstsq(J, off, rcond=None)[0]
        q = q + step / max(1.0, float(np.linalg.norm(step)))
    return None


def _pose_and_jacobian(arm: Sequence[Array], q: Array) -> tuple[Array, Array]:
    """The pose (4, 4) and the Jacobian (6, 6) at its origin, in base axes."""
    T, axes = arm[0], []
    for angle, E in zip(q, arm[1:], strict=True):
        axes.append((T[:3, 2], T[:3, 3]))
        T = T @ turned(angle) @ E
    return T, np.array([[*np.cross(h, T[:3, 3] - p), *h] for h, p in axes]).T


def _apart(a: Array, b: Array) -> float:
    return float(np.abs(np.angle(np.exp(1j * (a - b)))).max())
