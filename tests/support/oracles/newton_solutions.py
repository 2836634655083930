"""Finds all regular inverse kinematics solutions of a pose by multi-start Newton iteration."""

import numpy as np

import chasles

STARTS, STEPS = 500, 40
STILL = 1e-12
"""Step size (rad) at which Newton's iteration ends."""
CLOSED = 1e-10
"""Maximum pose error of a solution: position in meter, or entries of the rotation matrix."""
REGULAR = 1e-3
"""Minimum singular value (m or rad per rad) of the Jacobian at a regular solution."""
SAME = 1e-5
"""Maximum difference (rad) at which two configurations count as equal."""


def regular_solutions(
    arm: chasles.Robot, T: np.ndarray, fixed: dict[int, float] | None = None, seed: int = 0
) -> list[np.ndarray]:
    """Solve the inverse kinematics of a pose by multi-start Newton iteration.

    Args:
        arm: An arm with only revolute joints, of which Newton's method solves for six.
        T: The pose (4, 4).
        fixed: Fixed joint values keyed by index, for arms with more than six joints.
        seed: Seed of the start configurations.

    Returns:
        The distinct regular solutions found.
    """
    fixed = fixed or {}
    free = [k for k in range(arm.n) if k not in fixed]
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (STARTS, arm.n))
    for joint, value in fixed.items():
        q[:, joint] = value
    moving = np.arange(STARTS)
    for _ in range(STEPS):
        here, J = arm.fk_jacobian_mixed(q[moving])
        step = np.linalg.solve(J[..., free] + 1e-12 * np.eye(6), _twists(T, here)[..., None])[
            ..., 0
        ]
        step /= np.maximum(1, 2 * np.abs(step).max(-1, keepdims=True))
        q[np.ix_(moving, free)] += step
        moving = moving[np.abs(step).max(-1) > STILL]
        if not len(moving):
            break
    here, J = arm.fk_jacobian_mixed(q)
    is_regular = np.linalg.svd(J[..., free], compute_uv=False)[:, -1] > REGULAR
    found: list[np.ndarray] = []
    for one in q[is_regular & (np.abs(here - T).max((-1, -2)) < CLOSED)]:
        apart = (np.abs((one - other + np.pi) % (2 * np.pi) - np.pi).max() for other in found)
        if all(far > SAME for far in apart):
            found.append(one)
    return found


def _twists(T: np.ndarray, here: np.ndarray) -> np.ndarray:
    """Return twists (N, 6) from poses (N, 4, 4) to the pose T, in base axes.

    The angular part of a twist is the rotation axis times the sine of the rotation angle.
    """
    E = T[:3, :3] @ np.swapaxes(here[:, :3, :3], -1, -2)
    w = [E[:, 2, 1] - E[:, 1, 2], E[:, 0, 2] - E[:, 2, 0], E[:, 1, 0] - E[:, 0, 1]]
    return np.concatenate([T[:3, 3] - here[:, :3, 3], np.stack(w, -1) / 2], -1)
