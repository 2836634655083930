"""Random coordinates of shipped robots with loops, within limits and away from dead points."""

import zlib
from functools import cache

import numpy as np

import chasles
from tests.support.loops.closures import model

NAMES = [
    "four_bar",
    "slider_crank",
    "five_bar",
    "well_manipulator",
    "board_installer",
    "excavator",
    "delta",
    "bricklaying_gantry",
]
LOOPED = NAMES[:-1]
INVERTIBLE = ["slider_crank", "five_bar", "excavator", "delta"]
"""Robots that have dead points in the conversion from main-chain joints to actuator coordinates."""
CLOSED = 1e-12
HELD = 0.02
"""Minimum singular value of the loop Jacobian at test configurations."""
SAME = 1e-11
DIFFERENCES = 1e-7
STEP = 2e-6


@cache
def robot(name):
    return chasles.load(name)


def bounds(name):
    r = robot(name)
    return np.where(np.isinf(r.lower), -np.pi, r.lower), np.where(np.isinf(r.upper), np.pi, r.upper)


def random_q(name, n, seed=0, wider=0.0):
    """Return random coordinates (n, dof) within limits widened by ``wider`` times their range."""
    lower, upper = bounds(name)
    span = wider * (upper - lower)
    generator = np.random.default_rng([seed, zlib.crc32(name.encode())])
    return generator.uniform(lower - span, upper + span, (n, len(lower)))


def random_rates(name, n, seed=1):
    return np.random.default_rng(seed).uniform(-1, 1, (n, robot(name).n))


def held(name, z):
    """Test whether configurations are far enough from dead points."""
    m = model(name)
    if not m.mechanism.loop_joints:
        return np.ones(len(z), dtype=bool)
    return np.linalg.svd(m.D_z(z)[..., m.unknown], compute_uv=False)[:, -1] > HELD


def far_from_dead_points(name, n, seed=0):
    """Return random coordinates within limits, and their configurations, far from dead points."""
    q = random_q(name, n, seed)
    z = robot(name).configuration(q)
    keep = held(name, z)
    assert keep.mean() > 0.5
    return q[keep], z[keep]
