"""Robots on a graphics processor (GPU): exported CUDA kernels on arrays of CuPy, PyTorch and JAX.

arm = Kernels(chasles.load("ur5e"), "robots/ur5e")  # after chasles export cuda ur5e --to robots
T = arm("fk", q)  # q (6, count) in the memory of the GPU
"""

from .kernels import Kernels

__all__ = ["Kernels"]
