"""Times of batches in JAX and PyTorch, compared with direct calls of the same C code.

Every call returns new arrays. Calls of C, JAX and PyTorch alternate. Each time is the minimum over
all calls.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import chasles
from chasles.autodiff import for_jax, for_torch

from ..report import out, table
from .nearest import minima

ROWS = 100_000
ROUNDS = 40
LIMIT = 1.3
"""Maximum ratio of the time in JAX or PyTorch to the time in C."""
FUNCTIONS = {"fk": "fk", "jacobian": "jacobian_mixed", "ik": "ik"}


def run() -> int:
    """Print the times and their ratios. Return 1 if a ratio exceeds the limit."""
    robot = chasles.load("ur5e")
    q = np.random.default_rng(0).uniform(-3, 3, (ROWS, robot.n))
    T = robot.fk(q)
    rows = [_times(robot, name, T if name == "ik" else q) for name in FUNCTIONS]
    heads = ("function", "C ms", "JAX ms", "ratio", "PyTorch ms", "ratio")
    table(f"{robot.name}, {ROWS:,} poses", heads, rows)
    out.print(f"bar: ratio {LIMIT}")
    return int(any(row[3] > LIMIT or row[5] > LIMIT for row in rows))


def _times(robot: chasles.Robot, name: str, inputs: np.ndarray) -> tuple[Any, ...]:
    in_c = robot.functions[FUNCTIONS[name]].ufunc
    works = [partial(in_c, inputs), _in_jax(robot, name, inputs), _in_torch(robot, name, inputs)]
    c, jax, torch = (taken / 1e6 for taken in minima(works, 1, ROUNDS))
    return name, c, jax, jax / c, torch, torch / c


def _in_jax(robot: chasles.Robot, name: str, inputs: np.ndarray) -> Callable[[], object]:
    import jax  # noqa: PLC0415

    jax.config.update("jax_enable_x64", True)
    function = jax.jit(getattr(for_jax(robot), name))
    array = jax.numpy.asarray(inputs)
    return lambda: jax.block_until_ready(function(array))


def _in_torch(robot: chasles.Robot, name: str, inputs: np.ndarray) -> Callable[[], object]:
    import torch  # noqa: PLC0415

    return partial(getattr(for_torch(robot), name), torch.from_numpy(inputs))
