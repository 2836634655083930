"""Arms at random, but for neighbouring axes that meet or are parallel."""

from collections.abc import Collection

import numpy as np

from chasles.derive import Joint, SerialRobot
from chasles.derive.description.conventions import dh

LINKS = "/=x"
"""Between two axes: skew, parallel, meeting."""


def long_arm(seed: int) -> SerialRobot:
    """An arm of seven to ten joints: six that turn, and some that turn or slide among them."""
    rng = np.random.default_rng([seed, 10])
    slides = {int(k) for k in rng.choice(7, rng.integers(0, 3), replace=False)}
    count = 6 + max(len(slides) + int(rng.integers(0, 3)), 1)
    return random_arm(seed, "".join(rng.choice(list("///=x"), count)), slides)


def sliding_arm(seed: int) -> SerialRobot:
    """An arm of six to nine joints of which four or five turn, so that slides are solved for."""
    rng = np.random.default_rng([seed, 11])
    count, turning = int(rng.integers(6, 10)), int(rng.integers(4, 6))
    slides = {int(k) for k in rng.choice(count, count - turning, replace=False)}
    return random_arm(seed, "".join(rng.choice(list("///=x"), count)), slides)


def random_arm(seed: int, links: str = "//////", slides: Collection[int] = ()) -> SerialRobot:
    """An arm with as many joints as links.

    Args:
        seed: Of its lengths (0.05 to 0.5 m) and angles.
        links: Behind each joint one of ``LINKS``, which says how the next axis lies.
        slides: Indices of the joints that slide; the others turn.
    """
    rng = np.random.default_rng(seed)
    joints = []
    for k, link in enumerate(links, 1):
        a = 0.0 if link == "x" else rng.choice((-1, 1)) * rng.uniform(0.05, 0.5)
        alpha = 0.0 if link == "=" else rng.choice((-1, 1)) * rng.uniform(0.4, 2.7)
        d, theta = rng.uniform(-0.4, 0.4), rng.uniform(-3.0, 3.0)
        row = {name: f"{value:.6f}" for name, value in zip(["a", "d"], (a, d), strict=True)}
        kind = "prismatic" if k - 1 in slides else "revolute"
        fields = dh(kind, **row, alpha=f"{alpha:.6f}", theta=f"{theta:.6f}")
        joints.append(Joint(f"joint_{k}", kind, *fields))
    return SerialRobot(f"arm_{seed}", tuple(joints))
