"""Differentiable functions of a robot for JAX and PyTorch.

arm = for_jax(chasles.load("ur5e"))  # needs jax, pip install 'chasles[jax]'
jax.grad(lambda q: arm.fk(q)[0, 3])(q)
arm = for_torch(chasles.load("ur5e"))  # needs torch, pip install 'chasles[torch]'
"""

from .arms import for_jax, for_torch
from .differentiable_arm import DifferentiableArm, Solutions

__all__ = ["DifferentiableArm", "Solutions", "for_jax", "for_torch"]
