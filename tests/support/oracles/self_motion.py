"""Counts the poses of a path that a redundant robot reaches within its limits."""

import itertools

import numpy as np
from scipy.spatial import cKDTree


def reached_poses(robot, T, limits, cells, step=0.25):
    """Return the number of consecutive poses that a continuous motion reaches from the first pose.

    Between consecutive poses, no coordinate moves by more than ``step``.

    Args:
        robot: A redundant robot, with limits for all revolute joints.
        T: (m, 4, 4) poses of the path.
        limits: (n, 2) lower and upper limits.
        cells: Grid points per redundancy parameter.
        step: Maximum coordinate change from one pose to the next [rad or m].
    """
    index = [item.index for item in robot.redundancy]
    grid = np.array(list(itertools.product(*(np.linspace(*limits[k], cells) for k in index))))
    fixed = {item.name: grid[:, k] for k, item in enumerate(robot.redundancy)}
    reached = None
    for count, pose in enumerate(T):
        solutions = robot.ik(np.repeat(pose[None], len(grid), 0), fixed=fixed)
        inside = solutions.within_limits(limits)
        q = inside.q[inside.valid]
        if reached is not None and len(q):
            distance, _ = cKDTree(reached).query(q, p=np.inf, distance_upper_bound=step)
            q = q[np.isfinite(distance)]
        if not len(q):
            return count
        reached = q
    return len(T)


def look_at(eye, target):
    """Return camera poses at points (m, 3), with z axes that point at a target (3,)."""
    z = (target - eye) / np.linalg.norm(target - eye, axis=-1, keepdims=True)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    T = np.zeros((*eye.shape[:-1], 4, 4))
    T[..., 0:3, 0], T[..., 0:3, 1], T[..., 0:3, 2] = x, np.cross(z, x), z
    T[..., :3, 3], T[..., 3, 3] = eye, 1
    return T
