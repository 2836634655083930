"""Selects a configuration in which the links of a serial robot are drawn well apart."""

import itertools
import math

import numpy as np

from chasles.contract import BodyJoint

from ..model.mechanism import Mechanism
from .rigid_bodies import Array, RigidBodies, motions

ANGLES = (0, 30, -30, 60, -60, 90, -90, 45, -45, 120, -120)
"""Joint angles that are tried for the drawing of a robot (degrees)."""
SLIDES = (0.5, 0.7, 0.9)
"""Candidate positions of prismatic joints, as fractions of the joint range."""
TRIED = 2000
AZIMUTH, ELEVATION = math.radians(-56), math.radians(22)
"""Azimuth and elevation of the view direction of spatial drawings (radian). In the default view,
legs that are 60 degrees apart do not overlap."""
_AREA = 4.0
"""Weight of the spread of the joints in the image, with the spread relative to the robot size."""
_BENDS = 0.02
"""Dimensionless cost of each 90 degrees by which a joint angle differs from 0."""
_BELOW = 0.5
"""Cost per unit of the lowest joint's depth below the base, where the depth is divided by the robot
size."""
_SHORT = 0.02
"""Links that are shorter than this fraction of the robot size are drawn as one point."""


def from_aside() -> Array:
    """Return three directions of a spatial drawing as rows (3, 3): right, up, toward the viewer."""
    (ca, sa), (ce, se) = ((math.cos(v), math.sin(v)) for v in (AZIMUTH, ELEVATION))
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])


def drawn_configuration(rigid: RigidBodies) -> tuple[float, ...]:
    """Return a configuration within the limits whose joints lie well apart in the default view.

    The function compares up to two thousand combinations of the joint angles ``ANGLES`` and returns
    the configuration with the highest score. The score of a configuration increases with the
    smallest distance between joints in the image and with the spread of the joints. Joint angles
    other than 0 and joints below the base reduce the score.

    Args:
        rigid: The bodies of a serial robot.

    Returns:
        One value per coordinate (radian or meter), or an empty tuple for a robot with loops.
    """
    if isinstance(rigid.robot, Mechanism):
        return ()
    tried = np.array(_tried([_choices(rigid, k) for k in range(len(rigid.names))]))
    # The costs of the configurations are rounded, because their rounding errors differ between
    # computers.
    best = tried[int(np.argmin(np.round(_costs(rigid, tried), 6)))]
    return tuple(map(float, best))


def _choices(rigid: RigidBodies, k: int) -> list[float]:
    bodies = [b for b in rigid.bodies if b.joint and b.joint.coordinate == k]
    body = max(bodies, key=lambda body: abs(body.joint.ratio) if body.joint else 0.0)
    assert body.joint is not None
    scale = abs(body.joint.ratio)
    low, high = (None if limit is None else limit * scale for limit in body.limits)
    found = _of_joint(rigid, body.joint, low, high)
    return found if scale == 1 else [_round(value / scale) for value in found]


def _of_joint(
    rigid: RigidBodies, joint: BodyJoint, low: float | None, high: float | None
) -> list[float]:
    if joint.kind == "prismatic":
        low, high = low if low is not None else 0.0, high if high is not None else 0.3 * rigid.size
        return [_round(low + part * (high - low)) for part in SLIDES]
    angles = [math.radians(angle) for angle in ANGLES]
    within = [a for a in angles if (low is None or a >= low) and (high is None or a <= high)]
    if within:
        return within
    ends = [end for end in (low, high) if end is not None]
    return [_round(sum(ends) / len(ends))]


def _tried(choices: list[list[float]]) -> list[tuple[float, ...]]:
    """Return all combinations of joint values, or an evenly spread sample of size ``TRIED``."""
    if math.prod(map(len, choices)) <= TRIED:
        return list(itertools.product(*choices))
    # Multiples of square roots of primes, taken modulo 1, are spread evenly.
    steps = [math.sqrt(prime) % 1 for prime in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)]
    return [
        tuple(
            own[int((k * steps[j % len(steps)] + j / len(choices)) % 1 * len(own))]
            for j, own in enumerate(choices)
        )
        for k in range(TRIED)
    ]


def _costs(rigid: RigidBodies, q: Array) -> Array:
    points = _points(rigid, q)
    seen = points @ from_aside()[:2].T
    away = seen - seen.mean(1, keepdims=True)
    spreads = np.einsum("mki,mkj->mij", away, away) / max(seen.shape[1] - 1, 1)
    area = spreads[:, 0, 0] * spreads[:, 1, 1] - spreads[:, 0, 1] * spreads[:, 1, 0]
    spread = np.sqrt(np.clip(area, 0, None)) / rigid.size
    apart = np.linalg.norm(seen[:, :, None] - seen[:, None], axis=-1)
    first, second = np.triu_indices(seen.shape[1], 1)
    nearest = apart[:, first, second].min(1, initial=rigid.size)
    below = np.clip(-points[:, :, 2], 0, None).max(1)
    turns = np.array([rigid.turns(name) for name in rigid.names])
    bends = np.abs(q[:, turns]).sum(1) / (math.pi / 2)
    costs: Array = (_BELOW * below - nearest - _AREA * spread) / rigid.size + _BENDS * bends
    return costs


def _points(rigid: RigidBodies, q: Array) -> Array:
    poses, points = [np.tile(np.eye(4), (len(q), 1, 1))], []
    for body in rigid.bodies[1:]:
        assert body.joint is not None
        poses.append(poses[body.parent] @ body.placement @ motions(body.joint, q))
        if body.joint.kind != "fixed":
            points.append(poses[-1][:, :3, :3] @ body.joint.at + poses[-1][:, :3, 3])
    points.append((poses[rigid.tip] @ rigid.tip_placement)[:, :3, 3])
    kept = [points[0]]
    for a, b in itertools.pairwise(points):
        if np.linalg.norm(b - a, axis=1).max() > _SHORT * rigid.size:
            kept.append(b)
    return np.stack(kept, axis=1)


def _round(value: float) -> float:
    return float(f"{value:.12g}") + 0.0
