"""Common interface to other libraries for inverse kinematics of revolute arms."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from tests.support.oracles.screws import Screws, locked, meeting

INSTALL = {"eaik": "EAIK", "ik_geo": "ik-geo", "ssik": "ssik"}
"""Pip packages of other inverse kinematics libraries, keyed by the module that calls the library.

The function `inverse(chain)` of such a module returns None for unsupported arms.
"""
MEET = 1e-9
"""Maximum distance [m] of intersecting axes from a common point."""
PARALLEL = 1e-9


class Unsolved(Exception):
    """Error raised for an arm that no solver of the other library supports."""


@dataclass(frozen=True)
class Answers:
    """The solutions that a solver returns for m poses.

    Attributes:
        q: (m, k, n) joint values, NaN in solution slots without a solution.
        claimed: (m, k) booleans that state whether the solver claims that a solution is exact.
    """

    q: np.ndarray
    claimed: np.ndarray


@dataclass(frozen=True)
class Inverse:
    """The inverse kinematics of another library, prepared for an arm.

    Attributes:
        name: The peer.
        call: The timed function, which maps a pose to a result, both in the format of the library.
        read: Converts a result of `call` to joint values (k, n), and to k booleans that state
            whether the library claims that a solution is exact.
        prepare: Function from a pose (4, 4) to the pose expected by the other library.
        batch: Function that calls the library for several prepared poses (m, 4, 4), on one thread.
    """

    name: str
    call: Callable[[np.ndarray], Any]
    read: Callable[[Any], tuple[Any, Any]]
    prepare: Callable[[np.ndarray], np.ndarray]
    batch: Callable[[np.ndarray], Any]

    def found(self, T: np.ndarray) -> tuple[Any, Any]:
        """Return the joint values for a pose, and whether each solution is claimed as exact."""
        return self.read(self.call(self.prepare(T)))


def absent() -> dict[str, str]:
    """List the missing libraries with their pip packages."""
    return {name: package for name, package in INSTALL.items() if _imported(name) is None}


def inverses(chain: Screws) -> list[Inverse]:
    """Return the solvers of all other installed libraries that can solve an arm."""
    modules = [module for name in INSTALL if (module := _imported(name)) is not None]
    made = [module.inverse(chain) for module in modules]
    return [inverse for inverse in made if inverse is not None]


def answers(name: str, chain: Screws, T: np.ndarray, lock: int, values: np.ndarray) -> Answers:
    """Return the inverse kinematics solutions of another library for poses (m, 4, 4).

    If the other library cannot solve the whole arm, joint `lock` is fixed at `values` (m,).

    Raises:
        Unsolved: The other library cannot solve the arm even with joint `lock` fixed.
    """
    module = _imported(name)
    assert module is not None
    inverse = module.inverse(chain)
    if inverse is not None:
        return gathered(map(inverse.found, T), len(chain.axes))
    if lock < 0 or module.inverse(locked(chain, lock, values[0])) is None:
        raise Unsolved(name)
    return gathered(_locked(module, chain, T, lock, values), len(chain.axes))


def _locked(
    module: ModuleType, chain: Screws, T: np.ndarray, joint: int, values: np.ndarray
) -> Iterator[tuple[Any, Any]]:
    for pose, value in zip(T, values, strict=True):
        inverse = module.inverse(locked(chain, joint, value))
        q, claimed = ([], []) if inverse is None else inverse.found(pose)
        yield [np.insert(row, joint, value) for row in q], claimed


def gathered(found: Iterator[tuple[Any, Any]], joints: int) -> Answers:
    """Combine solution lists of different lengths into arrays, padded with NaN."""
    rows = list(found)
    most = max((len(q) for q, _ in rows), default=0)
    all_q = np.full((len(rows), most, joints), np.nan)
    all_claimed = np.zeros((len(rows), most), bool)
    for k, (q, claimed) in enumerate(rows):
        if len(q):
            all_q[k, : len(q)], all_claimed[k, : len(q)] = q, claimed
    return Answers(all_q, all_claimed)


def aligned(chain: Screws) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that rotates the tip frame of poses.

    The rotated tip frame at joint values 0 has the orientation of the base frame.
    """
    turn = np.eye(4)
    turn[:3, :3] = chain.home[:3, :3].T
    return lambda T: T @ turn


def offsets(chain: Screws, *groups: Sequence[int]) -> np.ndarray:
    """Return the translations (n + 1, 3) between points on consecutive axes.

    For intersecting axes in one group, the point on each axis is the common intersection.
    """
    points = chain.points.copy()
    for group in map(list, groups):
        points[group] = meeting(chain.axes[group], points[group])[0]
    return np.diff(np.vstack([np.zeros(3), points, chain.home[:3, 3]]), axis=0)


def meet(chain: Screws, joints: Sequence[int]) -> bool:
    """Test whether the axes of all listed joints pass through one point."""
    return meeting(chain.axes[list(joints)], chain.points[list(joints)])[1] < MEET


def parallel(chain: Screws, joints: Sequence[int]) -> bool:
    """Test whether the axes of all listed joints are parallel."""
    first, *others = chain.axes[list(joints)]
    return all(np.linalg.norm(np.cross(first, other)) < PARALLEL for other in others)


def _imported(name: str) -> ModuleType | None:
    try:
        return import_module(f".{name}", __package__)
    except ImportError:
        return None
