"""JAX with vmap, compiled for the CPU by XLA in float64."""

import os

import numpy as np

from ...cases.arms import Arm
from ...cores import one_core
from . import Batch
from .formulas import fk_jacobian

os.environ.setdefault("JAX_PLATFORMS", "cpu")
import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)
# JAX creates its threads at first use. The first call of JAX binds the threads to the cores that
# the process may use at that time.
with one_core():
    jax.devices()


def batches(arm: Arm) -> list[Batch]:
    def both(q):
        T, J = fk_jacobian(arm, [q[k] for k in range(arm.joints)], jnp.cos, jnp.sin)
        return jnp.array(T, jnp.float64), jnp.array(J, jnp.float64)

    return [Batch("JAX", _batch(lambda q: both(q)[0]), _batch(both))]


def _batch(function):
    many = jax.jit(jax.vmap(function))

    def run(q: np.ndarray):
        return jax.block_until_ready(many(q))

    return run
