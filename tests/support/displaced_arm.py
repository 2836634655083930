"""An arm with geometric errors."""

import numpy as np

SIZE, SEED = 3.6465829651e-3, 203
"""Maximum error (meter, radian) of the arm, and the seed of the errors."""
WRIST = 4
FAR = 0.25
"""Maximum distance (radian) of the wrist angle from the singularity."""


def near_wrist(count, seed):
    """Return configurations near the wrist singularity."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, (count, 6))
    q[:, WRIST] = rng.uniform(-FAR, FAR, count) + np.pi * rng.integers(0, 2, count)
    return q
