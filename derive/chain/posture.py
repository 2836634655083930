"""The posture in which a serial robot is drawn: its links apart from each other on the picture."""

import itertools
import math

import numpy as np

from ..model.mechanism import Mechanism
from .rigid_bodies import Array, RigidBodies, motion

ANGLES = (0, 30, -30, 60, -60, 90, -90, 45, -45, 120, -120)
"""The angles that are tried (degrees)."""
SLIDES = (0.5, 0.7, 0.9)
"""The parts of a slide's travel that are tried."""
TRIED = 400
AZIMUTH, ELEVATION = math.radians(-56), math.radians(22)
"""The direction of the eye of a drawing in space, as azimuth and elevation."""
_BENDS = 0.02
"""What a bend of a joint by a right angle costs, in parts of the robot's size."""
_BELOW = 0.5
"""What a joint below the base costs, per depth."""


def from_aside() -> Array:
    """The directions to the right, up and towards the eye of a drawing in space, as rows (3, 3)."""
    (ca, sa), (ce, se) = ((math.cos(v), math.sin(v)) for v in (AZIMUTH, ELEVATION))
    return np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])


def posture(rigid: RigidBodies) -> tuple[float, ...]:
    """Coordinates within the limits at which the joints are apart, seen from above and aside.

    The best of a few hundred postures of round angles: the least distance between two joints on the
    picture counts, and a joint below the base and bends cost. The same on any machine.

    Args:
        rigid: The bodies of a serial robot.

    Returns:
        A value for each coordinate (radian or metre); () of a robot with loops, whose posture is
        its reference.
    """
    if isinstance(rigid.robot, Mechanism):
        return ()
    choices = [_choices(rigid, k) for k in range(len(rigid.names))]
    best, least = (), math.inf
    for q in _tried(choices):
        cost = _cost(rigid, q)
        if cost < least:
            best, least = q, cost
    return best


def _choices(rigid: RigidBodies, k: int) -> list[float]:
    joint = next(body.joint for body in rigid.bodies if body.joint and body.joint.coordinate == k)
    low, high = joint.limits
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
    """All combinations, or evenly spread ones where they are many."""
    if math.prod(map(len, choices)) <= TRIED:
        return list(itertools.product(*choices))
    # Multiples of roots of primes fill a cube evenly, and equal on any machine.
    steps = [math.sqrt(prime) % 1 for prime in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)]
    return [
        tuple(
            own[int((k * steps[j % len(steps)] + j / len(choices)) % 1 * len(own))]
            for j, own in enumerate(choices)
        )
        for k in range(TRIED)
    ]


def _cost(rigid: RigidBodies, q: tuple[float, ...]) -> float:
    points = _points(rigid, q)
    right_up = from_aside()[:2]
    seen = points @ right_up.T
    spread = math.sqrt(max(float(np.linalg.det(np.atleast_2d(np.cov(seen.T)))), 0.0)) / rigid.size
    apart = np.linalg.norm(seen[:, None] - seen[None], axis=-1)
    nearest = float(apart[np.triu_indices(len(seen), 1)].min()) if len(seen) > 1 else 0.0
    below = float(np.clip(-points[:, 2], 0, None).max())
    bends = sum(abs(v) for v, name in zip(q, rigid.names, strict=True) if rigid.turns(name))
    cost = (_BELOW * below - nearest - 4 * spread) / rigid.size + _BENDS * bends / (math.pi / 2)
    # Equal costs may differ in their last digits between machines.
    return round(cost, 6)


def _points(rigid: RigidBodies, q: tuple[float, ...]) -> Array:
    """The ends of the links that have a length, from the base to the tip."""
    poses, points = [np.eye(4)], [np.zeros(3)]
    for body in rigid.bodies[1:]:
        joint = body.joint
        assert joint is not None
        value = joint.ratio * q[joint.coordinate] + joint.offset if joint.coordinate >= 0 else 0.0
        poses.append(poses[body.parent] @ body.placement @ motion(joint, value))
        points.append(poses[-1][:3, :3] @ joint.at + poses[-1][:3, 3])
    points.append((poses[rigid.tip] @ rigid.tip_placement)[:3, 3])
    kept = [points[0]]
    for a, b in itertools.pairwise(points):
        if np.linalg.norm(b - a) > _BENDS * rigid.size:
            kept.append(b)
    return np.array(kept)


def _round(value: float) -> float:
    return float(f"{value:.12g}") + 0.0
