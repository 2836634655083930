"""Finds closed configurations of loops numerically."""

import numpy as np

STEPS, STARTS = 40, 20
CLOSED = 1e-10
REGULAR = 0.1
"""Minimum singular value on a continued branch, relative to the value at the reference."""
CORRECTED = 0.05
"""Maximum correction of a predicted configuration (radian or meter) on the same branch."""


def reference(model):
    """Return the closed configuration (1, n_z) at the reference."""
    at = dict(model.mechanism.reference)
    z = np.array([[float(at.get(name, 0)) for name in model.names]])
    return model.newton(z, model.actuated)


def followed(model, q):
    """Follow closed configurations from the reference to the actuator values q (N, n).

    Returns:
        The configurations (N, n_z), and an array (N,) that is false if the path comes near a
        singularity.
    """
    z = np.repeat(reference(model), len(q), 0)
    start, regular = z[:, model.actuated], np.ones(len(q), dtype=bool)
    limit = REGULAR * _smallest(model, z)
    for k in range(1, STEPS + 1):
        step = (q - start) / STEPS
        z = z + (model.tangent(z, model.actuated) @ step[..., None])[..., 0]
        z[:, model.actuated] = start + k * step
        predicted, z = z, model.newton(z, model.actuated)
        regular &= (_smallest(model, z) > limit) & (model.gap(z) < CLOSED)
        regular &= np.abs(z - predicted).max(-1) < CORRECTED
    return z, regular


def _smallest(model, z):
    """Return the smallest singular value (N,) of the loop equations of the passive joints."""
    free = [k for k in range(z.shape[1]) if k not in model.actuated]
    return np.linalg.svd(model.D_z(z)[..., free], compute_uv=False)[:, len(free) - 1]


def closes_at(model, theta, q, seed=0):
    """Test whether the loops close at both theta (n_theta,) and q (n,).

    The passive joints are solved from random start values, with the equations of the description.
    """
    rng = np.random.default_rng(seed)
    z = rng.uniform(-np.pi, np.pi, (STARTS, len(model.names)))
    z[:, model.chain], z[:, model.actuated] = theta, q
    known = sorted({*model.chain, *model.actuated})
    return bool((model.gap(model.newton(z, known)) < CLOSED).any())
