"""Computes constant transforms between joints.

Other libraries need these transforms for their kinematic trees.
"""

import numpy as np

from ...cases.arms import Arm, Motion


def matrix(motion: Motion) -> np.ndarray:
    """Return a fixed motion as a (4, 4) pose."""
    T = np.eye(4)
    if motion.kind == "shift":
        T[motion.axis, 3] = motion.value
        return T
    j, k = (motion.axis + 1) % 3, (motion.axis + 2) % 3
    c, s = motion.cos_sin()
    T[j, j], T[j, k], T[k, j], T[k, k] = c, -s, s, c
    return T


def placements(arm: Arm) -> np.ndarray:
    """Return the transforms (n + 1, 4, 4) to each joint and to the tool. Joint axes are along z."""
    found = [np.eye(4)]
    for motion in arm.motions:
        if motion.value is None:
            assert motion.axis == 2
            found.append(np.eye(4))
        else:
            found[-1] = found[-1] @ matrix(motion)
    return np.array(found)
