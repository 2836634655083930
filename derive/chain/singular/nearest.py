"""Numeric search for singular configurations, used if the Jacobian minors have no short factors.

A configuration is singular if a wrench y does no work on any joint (J^T y = 0). An arm with fewer
joints than Jacobian rows is singular if joint velocities x do not move the tool (J x = 0). Newton's
method with minimum-norm steps solves J^T y = 0 for the coordinates q and y, or J x = 0 for q and x.
"""

import math
from collections.abc import Sequence

import numpy as np

from ...model.robot import SerialRobot
from ...model.tolerances import LAST_STEP, NO_WORK, OTHER_CONFIGURATION, RANK_LOST
from ...terms.terms import Terms
from ..rigid_bodies import placed
from .views import FloatArray, seen_screws

DRAWS = 4
"""Number of random configurations at which the generic rank of the Jacobian is determined."""
SEED = 50
STEPS = 40
STARTS = 24
"""Number of start configurations of Newton's method."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
WHOLE = 6


def nearest_singular(
    robot: SerialRobot, start: Sequence[float], most: int
) -> tuple[FloatArray, ...]:
    """Find singular configurations near a given configuration and near random configurations.

    Args:
        robot: A serial robot.
        start: The first start configuration of Newton's method (radian or meter).
        most: Maximum number of singular configurations to return.

    Returns:
        Singular configurations (n,) within the limits. The tuple of singular configurations is
        empty for coupled or helical joints, for more than twelve joints, and if every configuration
        is singular.
    """
    joints = robot.moving
    is_plain = not robot.couplings and all(j.kind != "helical" for j in joints)
    if not len(start) == len(joints) <= len(PRIMES) or not is_plain:
        return ()
    S, length = _screws(robot)
    scale = np.array([1.0 if j.kind == "revolute" else length for j in joints])
    low, high = _ranges(robot, length)
    found: list[FloatArray] = []
    # Multiples of square roots of primes, taken modulo 1, are spread evenly.
    roots = np.sqrt(np.array(PRIMES[: len(joints)])) % 1
    sampled = [low + (k * roots) % 1 * (high - low) for k in range(1, STARTS)]
    if _smallest(S, sampled[0], scale) < RANK_LOST:
        return ()
    for q in _led(S, np.vstack([start, *sampled]), scale):
        if (q < low).any() or (q > high).any():
            continue
        if all(float(np.abs((q - other) / scale).max()) > OTHER_CONFIGURATION for other in found):
            found.append(q)
        if len(found) == most:
            break
    return tuple(found)


def general_rank(robot: SerialRobot) -> int:
    """Return the generic (maximum) rank of the Jacobian.

    Args:
        robot: A serial robot without couplings and helical joints.
    """
    S, _ = _screws(robot)
    sampled = np.random.default_rng(SEED).uniform(-3, 3, (DRAWS, S.shape[1]))
    sizes = np.linalg.svd(seen_screws(S, sampled, 0), compute_uv=False)
    return int((sizes > RANK_LOST).sum(axis=1).max())


def _screws(robot: SerialRobot) -> tuple[FloatArray, float]:
    """Return (screws in the base frame, arm length in meter).

    Lengths in the screws are relative to the arm length.
    """
    terms = Terms({parameter.symbol: parameter.value for parameter in robot.parameters})
    T, columns, points = placed(terms, robot.base), [], []
    for joint in robot.joints:
        T = T @ placed(terms, joint.before)
        h, point = T[:3, 2] * float(joint.direction), T[:3, 3]
        if joint.kind == "revolute":
            columns.append(np.hstack([np.cross(point, h), h]))
        elif joint.kind == "prismatic":
            columns.append(np.hstack([h, np.zeros(3)]))
        points.append(point)
        T = T @ placed(terms, joint.after)
    tip = (T @ placed(terms, robot.tool))[:3, 3]
    length = float(np.linalg.norm(np.ptp(np.vstack([*points, tip]), axis=0))) or 1.0
    S = np.stack(columns, axis=1)
    S[:3, np.abs(S[3:]).max(axis=0) > 0] /= length
    return S, length


def _ranges(robot: SerialRobot, length: float) -> tuple[FloatArray, FloatArray]:
    """Return the joint limits.

    Missing joint limits are replaced by -pi and pi for a revolute joint, and by plus and minus the
    arm length for other joints.
    """
    limits = []
    for joint in robot.moving:
        half = math.pi if joint.kind == "revolute" else length
        low, high = joint.limits
        limits.append((-half if low is None else float(low), half if high is None else float(high)))
    low, high = np.array(limits).T
    return low, high


def _jacobian(S: FloatArray, q: FloatArray, scale: FloatArray) -> FloatArray:
    return seen_screws(S, q / scale, 0)


def _smallest(S: FloatArray, q: FloatArray, scale: FloatArray) -> float:
    return float(np.linalg.svd(_jacobian(S, q, scale), compute_uv=False)[-1])


def _led(S: FloatArray, q: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the singular configurations (k, n) found from start configurations (m, n)."""
    is_tall = S.shape[1] < WHOLE
    J = _jacobian(S, q, scale)
    U, _, Vt = np.linalg.svd(J)
    y = Vt[:, -1] if is_tall else U[..., -1]
    ended = np.full(q.shape, np.nan)
    running = np.arange(len(q))
    for _ in range(STEPS):
        value, slope = _equations(J, y, is_tall=is_tall)
        step = _least_step(slope, value)
        far = np.linalg.norm(step, axis=1)
        is_there = (np.abs(value).max(axis=1) <= NO_WORK) & (far <= LAST_STEP)
        ended[running[is_there]] = q[is_there]
        running, q, y, step, far = (part[~is_there] for part in (running, q, y, step, far))
        if not len(running):
            break
        step = step / np.maximum(1.0, far)[:, None]
        q, y = q - step[:, : q.shape[1]] * scale, y - step[:, q.shape[1] :]
        J = _jacobian(S, q, scale)
    return np.asarray(ended[~np.isnan(ended[:, 0])])


def _equations(J: FloatArray, y: FloatArray, *, is_tall: bool) -> tuple[FloatArray, FloatArray]:
    """Return (residuals, derivatives) of the equations that hold at singular configurations.

    The residuals have shape (configurations, equations).
    """
    D = _slopes(J)
    if is_tall:
        value, turned = np.einsum("mai,mi->ma", J, y), J
        slope = np.einsum("maik,mi->mak", D, y)
    else:
        value, turned = np.einsum("mai,ma->mi", J, y), np.swapaxes(J, 1, 2)
        slope = np.einsum("maik,ma->mik", D, y)
    rows = np.concatenate([slope, turned], axis=2)
    of_length = np.concatenate([np.zeros((len(J), slope.shape[2])), y], axis=1)
    too_long = ((y * y).sum(axis=1) - 1) / 2
    return np.column_stack([value, too_long]), np.concatenate([rows, of_length[:, None]], axis=1)


def _least_step(slope: FloatArray, value: FloatArray) -> FloatArray:
    U, sizes, Vt = np.linalg.svd(slope, full_matrices=False)
    # Singular values below RANK_LOST times the largest singular value are rounding errors, which
    # differ between computers.
    kept = sizes > RANK_LOST * sizes[:, :1]
    inverse = np.where(kept, 1 / np.where(kept, sizes, 1.0), 0.0)
    step: FloatArray = np.einsum("mki,mk->mi", Vt, inverse * np.einsum("mek,me->mk", U, value))
    return step


def _slopes(J: FloatArray) -> FloatArray:
    moved, by = np.moveaxis(J, 1, 0)[..., :, None], np.moveaxis(J, 1, 0)[..., None, :]
    linear = np.cross(by[3:], moved[:3], axis=0) + np.cross(by[:3], moved[3:], axis=0)
    angular = np.cross(by[3:], moved[3:], axis=0)
    # A joint moves the screws of all joints after it. Contiguous arrays make sums over the Jacobian
    # derivatives faster.
    slopes = np.tril(np.concatenate([linear, angular]), -1)
    return np.ascontiguousarray(np.moveaxis(slopes, 0, 1))
