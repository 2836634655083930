"""Counts correct, missed and wrong inverse solutions by independently computed residuals."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from tests.support.generators.poses import Case, PoseSet
from tests.support.oracles.tasks import wrapped
from tests.support.peers.interface import Answers

VALID = 1e-9
"""Maximum residual of a correct solution [m or rad]."""
ROUNDING = 1e-14
"""Maximum difference between two computations of the same residual [m or rad]."""
SAME = 1e-6
"""Maximum joint difference [rad or m] at which two solutions count as equal."""
REGULAR = 1e-3
"""Lower limit of the Jacobian's smallest singular value at regular coordinates."""
CHUNK = 20_000
STARTS = 400
STEPS = 60
RANK = 1e-9
LONGEST = 0.5
"""Maximum joint step in Newton's method [rad or m]."""
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class Verdict:
    """Numbers of correct, missed and wrong inverse solutions for a set of targets.

    Attributes:
        poses: Number of targets, all reachable.
        missed: Number of targets that are not reached by any solution marked as exact.
        unfound: Number of targets that no returned configuration reaches, including least-squares
            results.
        wrong: Number of targets with a solution that is marked as exact but does not reach the
            target.
        lost: Number of targets for which the solutions do not contain the coordinates that
            generated the target.
        worst: Largest residual of the solutions that reach their target [m or rad].
    """

    poses: int
    missed: int
    unfound: int
    wrong: int
    lost: int | None
    worst: float


def judged(case: Case, poses: PoseSet, solve: Callable[[np.ndarray], Answers]) -> Verdict:
    """Test the solutions of the function `solve` for all targets of a set."""
    chunks = np.array_split(poses.q, max(1, -(-len(poses.q) // CHUNK)))
    parts = [_judged(case, q, solve(q)) for q in chunks]
    missed, unfound, wrong, lost = (sum(of) for of in zip(*(p[:-1] for p in parts), strict=True))
    worst = max(part[-1] for part in parts)
    return Verdict(len(poses.q), missed, unfound, wrong, lost if poses.regular else None, worst)


def _judged(case: Case, q: np.ndarray, found: Answers) -> tuple[int, int, int, int, float]:
    errors = residuals(case, q, found)
    reached = errors <= VALID + ROUNDING
    good, wrong = reached & found.claimed, ~reached & found.claimed
    missed, unfound = ~good.any(axis=1), ~reached.any(axis=1)
    marks = (missed, unfound, wrong.any(axis=1), ~_included(case, q, found.q, good))
    return (*(int(mark.sum()) for mark in marks), float(np.max(errors, where=good, initial=0.0)))


def residuals(case: Case, q: np.ndarray, found: Answers) -> np.ndarray:
    """Return the residuals (m, k) of the solutions for m targets.

    A solution slot without a solution has an infinite residual.
    """
    errors = np.full(found.claimed.shape, np.inf)
    rows, slots = np.nonzero(np.isfinite(found.q).all(axis=-1))
    if len(rows):
        errors[rows, slots] = case.error(found.q[rows, slots], case.targets(q)[rows])
    return np.where(np.isnan(errors), np.inf, errors)


def _included(case: Case, q: np.ndarray, found: np.ndarray, good: np.ndarray) -> np.ndarray:
    near = good & (_apart(case, found, q[:, None]) < SAME)
    return near.any(axis=1) | ~regular(case, q)


def _apart(case: Case, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the largest joint difference (...), modulo whole turns."""
    difference = first - second
    return np.max(np.abs(np.where(case.turns, wrapped(difference), difference)), axis=-1)


def regular(case: Case, q: np.ndarray) -> np.ndarray:
    """Test whether each of m coordinate vectors is away from the singularities of a case's task."""
    if not case.singular:
        return _least(case.jacobian(q)[..., list(case.solved)]) > REGULAR
    squares = [case.square(singularity, q) for singularity in case.singular.values()]
    return np.min([_least(square) for square in squares], axis=0) > REGULAR


def _least(J: np.ndarray) -> np.ndarray:
    return np.linalg.svd(J, compute_uv=False)[..., -1]


def distinct(case: Case, q: np.ndarray) -> np.ndarray:
    kept: list[np.ndarray] = []
    for row in q:
        if not kept or np.min(_apart(case, np.array(kept), row)) > SAME:
            kept.append(row)
    return np.array(kept).reshape(-1, q.shape[-1])


def counts(case: Case, found: Answers) -> np.ndarray:
    """For each target, count the distinct solutions that are claimed to be exact."""
    pairs = zip(found.q, found.claimed, strict=True)
    return np.array([len(distinct(case, q[claimed])) for q, claimed in pairs])


def newton(case: Case, q: np.ndarray, rng: np.random.Generator, starts: int = STARTS) -> np.ndarray:
    """Return the distinct solutions (k, n) of Newton's method for the target at q (n,).

    Newton's method starts from ``starts`` random configurations.
    """
    target, others = case.targets(q), case.others(q)
    finite = partial(np.nan_to_num, nan=0.0, posinf=0.0, neginf=0.0)
    z = np.tile(q, (starts, 1))
    columns = list(case.solved)
    z[:, columns] = case.random(rng, starts)[:, columns]
    active = np.arange(len(z))
    for _ in range(STEPS):
        J, left = (finite(array) for array in _system(case, z[active], target, others))
        is_open = np.abs(left).max(axis=-1) > ROUNDING
        active, J, left = active[is_open], J[is_open], left[is_open]
        if not len(active):
            break
        step = np.linalg.pinv(J[..., columns], rcond=RANK) @ left[..., None]
        z[np.ix_(active, columns)] += np.clip(step[..., 0], -LONGEST, LONGEST)
    ends = case.error(z, target) <= VALID
    ends &= np.abs(_system(case, z, target, others)[1]).max(axis=-1) <= VALID
    return distinct(case, z[ends])


def _system(
    case: Case, z: np.ndarray, target: np.ndarray, others: tuple[np.ndarray, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Return (Jacobian, residual) of a task.

    An additional input that is a function of the coordinates q adds rows to the Jacobian and to the
    residual.
    """
    task = case.task
    rows, left = [case.jacobian(z)], [task.residual(case.pose(z), target)]
    for name, value in zip(case.given, others, strict=True):
        if name in case.robot.functions:
            function = case.robot.functions[name]
            steps = DIFFERENCE * np.eye(z.shape[-1])
            ahead, behind = (function(z[:, None] + sign * steps) for sign in (1, -1))
            rows.append(wrapped(ahead - behind)[:, None] / (2 * DIFFERENCE))
            left.append(wrapped(value - function(z))[:, None])
    return np.concatenate(rows, axis=-2), np.concatenate(left, axis=-1)
