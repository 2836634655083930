"""Counts the assembly modes of planar three-rod platforms by scanning the platform angle."""

import numpy as np

from tests.support.handwritten import planar


def random_q(rng, n, rod):
    """Return random crank angles (n, 3)."""
    anywhere = rng.uniform(-np.pi, np.pi, (n - n // 2, 3))
    poses = rng.uniform([-0.3, -0.3, -np.pi], [0.3, 0.3, np.pi], (200 * n, 3))
    held = planar.cranks(poses, rod, rng.choice([-1.0, 1.0], (200 * n, 3)))
    return np.concatenate([anywhere, held[np.isfinite(held).all(-1)][: n // 2]])


def errors(q, modes, rod):
    """Return the rod length errors of valid assembly modes."""
    gaps = planar.pins(modes.x) - planar.ends(q)[..., None, :, :]
    return (np.hypot(gaps[..., 0], gaps[..., 1]) - rod)[modes.valid]


def residuals(q, phi, rod):
    """Return (errors, height) for crank angles q and platform angles phi.

    At a given platform angle, each of the three rods keeps the platform origin on a circle. The
    errors are the squared-length errors of rod 3 at both intersections of the circles of rods 1 and
    2. The height is negative if the circles of rods 1 and 2 do not intersect.
    """
    pose = np.stack([0 * phi, 0 * phi, phi], -1)
    center = planar.ends(q)[:, None] - planar.pins(pose)
    along = center[..., 1, :] - center[..., 0, :]
    square = (along**2).sum(-1)
    height = rod**2 / square - 0.25
    with np.errstate(invalid="ignore"):
        across = np.sqrt(height)[..., None] * np.stack([-along[..., 1], along[..., 0]], -1)
    middle = (center[..., 0, :] + center[..., 1, :]) / 2
    third = [((middle + side * across - center[..., 2, :]) ** 2).sum(-1) for side in (1, -1)]
    return np.stack(third) - rod**2, height


def scan(q, lower, upper, rod, levels):
    """Count the zeros of the rod length errors by their sign changes.

    Doubtful intervals of the platform angle are scanned again with finer steps.
    """
    points, *finer = levels
    found = np.zeros(len(q), int)
    if not len(q):
        return found
    phi = lower[:, None] + (upper - lower)[:, None] * np.linspace(0, 1, points)
    f, height = residuals(q, phi, rod)
    there = np.isfinite(f[0])
    changes = ((f[..., 1:] > 0) != (f[..., :-1] > 0)) & there[:, 1:] & there[:, :-1]
    inner = np.where(there[:, 1:], (f[0] > 0)[:, 1:], (f[0] > 0)[:, :-1])
    outer = np.where(there[:, 1:], (f[1] > 0)[:, 1:], (f[1] > 0)[:, :-1])
    ends = there[:, 1:] != there[:, :-1]
    zeros = changes.sum(0) + (ends & (inner != outer))
    if finer:
        size = np.abs(f)
        low = (size[..., 1:-1] <= size[..., :-2]) & (size[..., 1:-1] <= size[..., 2:])
        flat = np.abs(height)
        low = low.any(0) | ((flat[:, 1:-1] <= flat[:, :-2]) & (flat[:, 1:-1] <= flat[:, 2:]))
        doubtful = ends.copy()
        doubtful[:, :-1] |= low
        doubtful[:, 1:] |= low
        row, cell = np.nonzero(doubtful)
        zeros[doubtful] = 0
        deeper = scan(q[row], phi[row, cell], phi[row, cell + 1], rod, finer)
        np.add.at(found, row, deeper)
    return found + zeros.sum(-1)
