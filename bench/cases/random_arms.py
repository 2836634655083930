"""Arms of revolute joints at random, but for neighbours that meet or are parallel."""

import numpy as np

from chasles.derive import Joint, Robot
from chasles.derive.description.conventions import dh

LINKS = "/=x"
"""Between two axes: skew, parallel, meeting."""


def random_arm(seed: int, links: str = "//////") -> Robot:
    """An arm with as many revolute joints as links.

    Args:
        seed: Of its lengths (0.05 to 0.5 m) and angles.
        links: Behind each joint one of ``LINKS``, which says how the next axis lies.
    """
    rng = np.random.default_rng(seed)
    joints = []
    for k, link in enumerate(links, 1):
        a = 0.0 if link == "x" else rng.choice((-1, 1)) * rng.uniform(0.05, 0.5)
        alpha = 0.0 if link == "=" else rng.choice((-1, 1)) * rng.uniform(0.4, 2.7)
        d, theta = rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)
        row = {name: f"{value:.6f}" for name, value in zip(["a", "d"], (a, d), strict=True)}
        fields = dh("revolute", **row, alpha=f"{alpha:.6f}", theta=f"{theta:.6f}")
        joints.append(Joint(f"joint_{k}", "revolute", *fields))
    return Robot(f"arm_{seed}", tuple(joints))
