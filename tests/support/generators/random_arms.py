"""Random arms with some intersecting or parallel consecutive axes."""

from collections.abc import Collection

import numpy as np

from chasles.derive import Joint, SerialRobot
from chasles.derive.description.conventions import dh

LINKS = "/=x"
"""Characters for the relation of two joint axes: / for skew, = for parallel, x for intersecting."""


def long_arm(seed: int) -> SerialRobot:
    """Return an arm with seven to ten joints and at least six revolute joints."""
    rng = np.random.default_rng([seed, 10])
    slides = {int(k) for k in rng.choice(7, rng.integers(0, 3), replace=False)}
    count = 6 + max(len(slides) + int(rng.integers(0, 3)), 1)
    return random_arm(seed, "".join(rng.choice(list("///=x"), count)), slides)


def sliding_arm(seed: int) -> SerialRobot:
    """Return a six- to nine-joint arm with four or five revolute joints."""
    rng = np.random.default_rng([seed, 11])
    count, turning = int(rng.integers(6, 10)), int(rng.integers(4, 6))
    slides = {int(k) for k in rng.choice(count, count - turning, replace=False)}
    return random_arm(seed, "".join(rng.choice(list("///=x"), count)), slides)


def random_arm(seed: int, links: str = "//////", slides: Collection[int] = ()) -> SerialRobot:
    """Return an arm with one joint per character of ``links``.

    Args:
        seed: Seed of the link lengths (0.05 to 0.5 m) and the angles.
        links: For each joint, the character in ``LINKS`` for the relation of the joint axis to the
            next joint axis.
        slides: Indices of the prismatic joints.
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
