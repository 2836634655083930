"""Other libraries that compute forward kinematics, with one module for each library.

The module of a library has at least one of the functions `calls`, `loops` and `batches`:

    `calls(arm)`:    Returns a list of Call. A Call computes one pose from Python.
    `loops(arm)`: Returns a list of Loop. A Loop calls compiled functions repeatedly in C.
    `batches(arm)`:  Returns a list of Batch. A Batch computes many poses in one call.

A module raises ImportError if its package is not installed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

import chasles

from ...agreement import CONFIGURATIONS, require_same
from ...cases.arms import Arm
from ...native.library import Loop, complete

INSTALL = {
    "own": "chasles",
    "pinocchio": "pin",
    "pinocchio_cpp": "pin cmeel-eigen 'cmeel-urdfdom[build]'",
    "toolbox": "roboticstoolbox-python",
    "casadi": "casadi",
    "wrenfold": "wrenfold",
    "symforce": "symforce cmeel-eigen",
    "jax": "jax",
}
"""Names of the pip packages that each of the other libraries requires."""

SLOW_TO_BUILD = frozenset(("pinocchio_cpp",))
"""Libraries with a long compile time."""


@dataclass(frozen=True)
class Call:
    """A Python interface of another library.

    Attributes:
        name: Name of the other library and its interface.
        fk: The timed function. The argument is q (n,), the result is a pose in the library's type.
        fk_jacobian: The timed function. The argument is q (n,). The results are pose and mixed
            Jacobian in the library's types.
        read: Converts results of the library to arrays (T,) or (T, J), with T (4, 4) and J (6, n).
    """

    name: str
    fk: Callable[[np.ndarray], Any]
    fk_jacobian: Callable[[np.ndarray], Any]
    read: Callable[[Any], tuple[np.ndarray, ...]]

    def results(self, q: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the poses of fk, and the poses and Jacobians of fk_jacobian, for all rows of q."""
        # The results are copied, because some other libraries reuse their memory.
        poses = [tuple(map(np.array, self.read(self.fk(row)))) for row in q]
        both = [tuple(map(np.array, self.read(self.fk_jacobian(row)))) for row in q]
        columns = (*zip(*poses, strict=True), *zip(*both, strict=True))
        return tuple(map(np.array, columns))


@dataclass(frozen=True)
class Batch:
    """A batch interface of another library, with fk and fk_jacobian of arrays q (m, n)."""

    name: str
    fk: Callable[[np.ndarray], Any]
    fk_jacobian: Callable[[np.ndarray], Any]

    def results(self, q: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the poses of fk, and the poses and Jacobians of fk_jacobian, for all rows of q."""
        return self.fk(q), *self.fk_jacobian(q)


def absent() -> dict[str, str]:
    """Return the libraries that cannot be imported, with the package to install."""
    return {name: install for name, install in INSTALL.items() if _imported(name) is None}


def setups(
    kind: str,
    arm: Arm,
    leave_out: frozenset[str] = frozenset(),
    only: Sequence[str] = tuple(INSTALL),
) -> list[Any]:
    """Return the interfaces of chasles and of other libraries for an arm. chasles comes first.

    Raises:
        DisagreementError: Poses or Jacobians of another library differ from the results of chasles.
    """
    modules = [_imported(name) for name in only if name not in leave_out]
    makers = [getattr(module, kind) for module in modules if hasattr(module, kind)]
    return [verified(setup, arm) for make in makers for setup in make(arm)]


def verified(setup: Call | Loop | Batch, arm: Arm) -> Any:
    """Return an interface after comparing its poses and Jacobians with chasles."""
    q = np.random.default_rng(5).uniform(-np.pi, np.pi, (CONFIGURATIONS, arm.joints))
    T, J = chasles.load(arm.name).fk_jacobian_mixed(q)
    require_same(f"{setup.name} for {arm.name}", setup.results(q), (T, T, J))
    return setup


def is_built(name: str) -> bool:
    """Return whether the compiled code of a library is already in the cache."""
    module = _imported(name)
    return module is not None and complete(module.source()).path.exists()


def _imported(name: str) -> ModuleType | None:
    try:
        return import_module(f".{name}", __name__)
    except ImportError:
        return None
