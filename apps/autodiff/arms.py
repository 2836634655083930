"""Make the functions of a robot differentiable in JAX or PyTorch."""

from __future__ import annotations

import os

from chasles import InputValueError, Robot
from chasles.contract import check_type, requires

from .differentiable_arm import DifferentiableArm


def for_jax(robot: Robot, folder: str | os.PathLike[str] | None = None) -> DifferentiableArm:
    """Return the functions of a robot for JAX.

    The functions support `jit`, `grad`, `vmap` and `jacrev`. Arrays are float64, or float32 without
    `jax_enable_x64`. On the processor (CPU), the functions call the compiled C. The C++ compiler of
    this machine builds a small library on first use.

    Args:
        robot: A robot with `fk`, `jacobian_mixed`, `hessian_mixed` and `ik`.
        folder: The folder that `chasles export jax` wrote for this robot, or None to use only the
            CPU. The functions for other devices, such as a GPU, come from this folder.

    Raises:
        NotInstalledError: JAX is not installed.
        InputValueError: The robot lacks `fk`, `jacobian_mixed`, `hessian_mixed` or `ik`, or
            `folder` lacks the exported file of the robot.
    """
    check_type("for_jax: robot", robot, Robot)
    with requires("chasles[jax]"):
        from . import jax_functions  # noqa: PLC0415
    return jax_functions.arm(checked(robot), folder)


def for_torch(robot: Robot) -> DifferentiableArm:
    """Return the functions of a robot for PyTorch on the CPU.

    The functions are custom operators that support autograd and `torch.compile`. Tensors of float64
    are not copied. Tensors of float32 are converted.

    Args:
        robot: A robot with `fk`, `jacobian_mixed` and `hessian_mixed`.

    Raises:
        NotInstalledError: PyTorch is not installed.
        InputValueError: The robot lacks a required function.
    """
    check_type("for_torch: robot", robot, Robot)
    with requires("chasles[torch]"):
        from . import torch_functions  # noqa: PLC0415
    return torch_functions.arm(checked(robot))


def checked(robot: Robot) -> Robot:
    """Check that a robot has `fk`, `jacobian_mixed`, `hessian_mixed` and `ik`.

    Raises:
        InputValueError: The robot lacks `fk`, `jacobian_mixed`, `hessian_mixed` or `ik`.
    """
    missing = {"fk", "jacobian_mixed", "hessian_mixed", "ik"} - robot.functions.keys()
    if missing:
        raise InputValueError(f"robot {robot.name} has no function {', '.join(sorted(missing))}")
    return robot
