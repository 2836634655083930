"""Newton's method on forward kinematics, from a configuration near the solution.

    (J J^T + lambda^2 1) y = e,  dq = J^T y

J is the Jacobian at the tip in base axes, and e is the twist from the tool to the pose. The damping
lambda^2 is proportional to |e|^2 and vanishes at a solution. Arms with fewer than six joints use
the equivalent step dq = (J^T J + lambda^2 1)^-1 J^T e.

Source:
    Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, 2011.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..tolerances import MAX_DAMPING, MIN_DAMPING, POLISH_STEP, POLISHED, SETTLED

Measured = tuple[FloatArray, FloatArray, FloatArray]
"""Jacobian rows (N, m, n), errors (N, m) and error norms (N,)."""
Measure = Callable[[FloatArray, FloatArray, FloatArray], Measured]
"""A function of poses (N, 4, 4), Jacobians (N, 6, n) and targets (N, ...)."""

STEPS = 40
"""Maximum number of steps."""
_LESS, _MORE = 0.1, 100.0
"""Factors for the damping after a step that reduced the error, and after a failed step."""
_MANY = 64
"""Minimum number of rows for which array operations are faster than LAPACK."""
BLOCK = 4096
"""Number of rows per iteration. The arrays for this many rows fit into the processor cache."""


def of_pose(pose: FloatArray, J: FloatArray, T: FloatArray) -> Measured:
    """Return the Jacobian, the error as the twist between two poses, and the residual."""
    error, residual = _twist(pose, T)
    return J, error, residual


def iterate(
    fk_jacobian: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    measure: Measure,
    T: FloatArray,
    q: FloatArray,
    fixed: Sequence[int],
    steps: int = STEPS,
) -> FloatArray:
    """Move q (N, n) to targets T (N, ...) in place; return the errors (N,) after the last step."""

    def evaluated(here: FloatArray, T: FloatArray) -> _State:
        pose, J = fk_jacobian(here)
        J[..., list(fixed)] = 0.0
        with np.errstate(invalid="ignore", over="ignore"):
            rows, error, residual = measure(pose, J, T)
            return _State(here, rows, error, (error * error).sum(-1), residual)

    now = evaluated(q.copy(), T)
    least = now.residual
    row, damping = np.arange(len(q)), np.ones(len(q))
    going = (least > POLISHED) & np.isfinite(least)
    for _ in range(steps):
        if not going.all():
            row, T, damping = row[going], T[going], damping[going]
            now = _State(*(field[going] for field in now))
        if not len(row):
            break
        trial = evaluated(now.q + _step(now.J, now.error, damping * now.square), T)
        better = trial.square < now.square
        now = _chosen(better, trial, now)
        q[row], least[row] = now.q, now.residual
        damping *= np.where(better, _LESS, _MORE)
        settled = ~better & ((now.residual <= SETTLED) | (damping > MAX_DAMPING))
        going = (now.residual > POLISHED) & ~settled
    q[np.isnan(least)] = np.nan
    return least


class _State(NamedTuple):
    q: FloatArray
    J: FloatArray
    error: FloatArray
    square: FloatArray
    residual: FloatArray


def _chosen(better: BoolArray, trial: _State, now: _State) -> _State:
    if better.all():
        return trial
    return _State(
        *(
            np.where(better.reshape(-1, *[1] * (new.ndim - 1)), new, old)
            for new, old in zip(trial, now, strict=True)
        )
    )


def _twist(here: FloatArray, there: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return displacements (N, 6) between poses (N, 4, 4), in base axes, with their sizes (N,)."""
    a, b = here.transpose(1, 2, 0), there.transpose(1, 2, 0)
    linear = b[:3, 3] - a[:3, 3]
    # The cross products of corresponding columns add up to 2 sin(angle) times the axis.
    sine = np.stack(
        [
            sum(a[i, k] * b[j, k] - a[j, k] * b[i, k] for k in range(3))
            for i, j in ((1, 2), (2, 0), (0, 1))
        ]
    )
    trace = np.asarray(sum(a[i, k] * b[i, k] for i in range(3) for k in range(3)))
    size = np.sqrt((sine * sine).sum(0))
    angle = np.arctan2(size, trace - 1)
    angular = sine * np.where(size > 0, angle / np.where(size > 0, size, 1.0), 0.0)
    distance = np.sqrt((linear * linear).sum(0))
    return np.concatenate([linear, angular]).T, np.maximum(distance, angle)


def _step(J: FloatArray, error: FloatArray, damping: FloatArray) -> FloatArray:
    wide = J.shape[2] >= J.shape[1]
    A = J if wide else J.mT
    right = error if wide else np.einsum("Nik,Nk->Ni", A, error)
    added = np.maximum(damping, MIN_DAMPING)
    if len(J) < _MANY:
        squared = A @ A.mT + added[:, None, None] * np.eye(A.shape[1])
        y = np.linalg.solve(squared, right[..., None])[..., 0]
    else:
        rows = np.ascontiguousarray(A.transpose(1, 2, 0))
        y = _solved(_gram(rows, added), right.T).T
    step = np.einsum("Nik,Ni->Nk", A, y) if wide else y
    step = step * POLISH_STEP / np.maximum(np.abs(step).max(-1, keepdims=True), POLISH_STEP)
    return np.asarray(step)


def _gram(rows: FloatArray, added: FloatArray) -> list[list[FloatArray]]:
    half = [[np.einsum("kN,kN->N", a, b) for b in rows[: i + 1]] for i, a in enumerate(rows)]
    for i, row in enumerate(half):
        row[i] += added
    return half


def _solved(A: list[list[FloatArray]], right: FloatArray) -> FloatArray:
    """Solve A x = right for positive definite A by L D L^T. The lower triangle of A is used."""
    m = len(A)
    scaled: list[list[FloatArray]] = []
    inverse: list[FloatArray] = []
    x = [np.array(value) for value in right]
    for i in range(m):
        row = A[i]
        for j in range(i):
            for k in range(j):
                row[j] -= row[k] * scaled[j][k]
        factors = [row[j] * inverse[j] for j in range(i)]
        for j in range(i):
            row[i] -= row[j] * factors[j]
            x[i] -= factors[j] * x[j]
        scaled.append(factors)
        inverse.append(1 / row[i])
    for i in reversed(range(m)):
        x[i] *= inverse[i]
        for j in range(i + 1, m):
            x[i] -= scaled[j][i] * x[j]
    return np.stack(x)
