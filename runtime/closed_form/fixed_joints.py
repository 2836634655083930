"""Inverse kinematics with fixed joints, as in `ik(T, fixed={"elbow": 1.2})`.

If a fixed joint is not a redundancy parameter, the IK function is derived on first use and cached.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import real_array
from ..call._call import Function
from ..contract import FunctionInfo, Manifest, read_manifest
from ..errors import DerivationError, InputTypeError, InputValueError
from ..fixed import following
from ..library.derived import derived_folder, description_of, options_for_fixed
from .complete_inverse import CompleteInverse
from .solutions import Solutions

_MAX_KEPT = 256
"""Maximum number of loaded inverse kinematics functions."""


@dataclass(frozen=True, eq=False)
class FixedJoints:
    """Inverse kinematics with fixed joints, for `ik` calls that the C code does not handle."""

    manifest: Manifest
    functions: Mapping[str, Function[Any]]
    robot_of: Callable[[Manifest], Any]

    def __call__(self, T: ArrayLike, fixed: Any, out: Any, threads: Any) -> Solutions:
        """Return all solutions with fixed joint values.

        Raises:
            InputTypeError: If `fixed` is not a mapping, or lacks a redundancy parameter.
            InputValueError: If a joint name is unknown.
            DerivationError: If the robot has no inverse kinematics function with these fixed
                joints. The message lists suitable joints.
        """
        options = {"out": out, "threads": threads}
        if not self._parameters and isinstance(fixed, Mapping) and not fixed:
            return self._own(T, **options)
        if not isinstance(fixed, Mapping) or not fixed:
            raise self._not_fixed(fixed)
        values = dict(self._of_joint(name, value) for name, value in fixed.items())
        if len(values) < len(fixed):
            raise InputValueError(f"{self._label}: fixed={sorted(fixed)}: a joint is fixed twice")
        inverse = self._inverses.get(tuple(values)) or self._inverse_for(tuple(values))
        result: Solutions = inverse.solve(T, fixed=values, **options)
        # The solutions of dask arrays are lazy.
        if inverse.fixed and isinstance(result.valid, np.ndarray):
            return inverse.complete(result, T, values)
        return result

    @functools.cached_property
    def _inverses(self) -> dict[tuple[str, ...], CompleteInverse]:
        return {}

    def _inverse_for(self, fixed: tuple[str, ...]) -> CompleteInverse:
        names = tuple(joint for joint in self._joints if joint in fixed)
        is_own = set(names) == set(self._parameters)
        solve = self._with_parameters if is_own else self._derived(names)
        indices: tuple[int, ...] = ()
        # An inverse kinematics function that was derived for these fixed joints finds all
        # solutions.
        if is_own and not self.manifest.loops.chain:
            indices = tuple(self._joints.index(name) for name in names)
        fk_jacobian = self._with_role("pose and jacobian", "actuators")
        inverse = CompleteInverse(names, solve, fk_jacobian, indices)
        return self._inverses.setdefault(fixed, inverse)

    @functools.cached_property
    def _info(self) -> FunctionInfo:
        info = self.manifest.with_role("inverse", "pose")
        assert info is not None
        return info

    @property
    def _own(self) -> Function[Solutions]:
        return self.functions[self._info.name]

    def _with_parameters(
        self, T: ArrayLike, fixed: Mapping[str, ArrayLike], **options: Any
    ) -> Solutions:
        return self._own(T, fixed=tuple(fixed[name] for name in self._parameters), **options)

    @functools.cached_property
    def _parameters(self) -> tuple[str, ...]:
        return tuple(item.name for item in self.manifest.redundancy)

    def _with_role(self, *role: str) -> Function[Any] | None:
        info = self.manifest.with_role(*role)
        return self.functions[info.name] if info else None

    @functools.cached_property
    def _joints(self) -> tuple[str, ...]:
        return tuple(j.name for j in self.manifest.loops.chain or self.manifest.coordinates)

    @property
    def _label(self) -> str:
        return f"{self.manifest.name}.{self._info.name}"

    def _not_fixed(self, fixed: object) -> InputTypeError:
        if fixed:
            expected = f'{{"{self._joints[-1]}": value}}'
            return InputTypeError(
                f"{self._label}: expected fixed={expected}, the values of joints by name, got "
                f"{fixed!r}"
            )
        values = ", ".join(f'"{name}": value' for name in self._parameters)
        return InputTypeError(
            f"{self._label}: infinitely many solutions reach a pose; pass fixed={{{values}}}, or "
            "call ik_nearest(T, q_seed) for the solution nearest to a configuration"
        )

    def _of_joint(self, name: str, value: ArrayLike) -> tuple[str, ArrayLike]:
        if name in self._joints:
            return name, value
        coordinates = [c.name for c in self.manifest.coordinates]
        if name not in coordinates:
            known = ", ".join(dict.fromkeys((*self._joints, *coordinates)))
            raise InputValueError(f"{self._label}: cannot fix {name!r}; expected one of {known}")
        index, reference = coordinates.index(name), self.manifest.loops.reference
        chain, moved = self._with_role("map", "actuators", "chain"), self._moved_alone(index)
        if reference is None or chain is None or moved is None:
            raise InputValueError(
                f"{self._label}: {name}: the coordinate does not determine a single joint; fix "
                f"one of these joints: {', '.join(self._joints)}"
            )
        given = real_array(self._label, name, value)
        q = np.array(np.broadcast_to(reference.q, (*given.shape, len(coordinates))))
        q[..., index] = given
        # If a loop is open, a batch contains NaN and a single call raises an error.
        return self._joints[moved], chain(q)[..., moved]

    def _moved_alone(self, coordinate: int) -> int | None:
        reference = self.manifest.loops.reference
        D = self._with_role("map derivative", "actuators", "chain")
        if reference is None or D is None or self.manifest.is_iterated:
            return None
        follows = following(self.manifest.coordinates, reference, D)
        alone = np.flatnonzero(follows[:, coordinate] & (follows.sum(1) == 1))
        return int(alone[0]) if len(alone) == 1 else None

    def _derived(self, names: tuple[str, ...]) -> Function[Solutions]:
        coordinates = [c.name for c in self.manifest.coordinates]
        if self.manifest.loops.chain and len(coordinates) < len(self._joints):
            own = f"; ik fixes {', '.join(self._parameters)}" if self._parameters else ""
            raise DerivationError(
                f"{self._label}: no other joint can be fixed: loops couple the joints of the main "
                f"chain{own}; with ik_numeric(T, q_seed, fixed=...), these coordinates can be "
                f"fixed: {', '.join(coordinates)}"
            )
        return derived_inverse(self.manifest, self.robot_of, names, self._info.name)


def derived_inverse(
    manifest: Manifest, robot_of: Callable[[Manifest], Any], names: tuple[str, ...], function: str
) -> Function[Solutions]:
    """Return the IK function for fixed joints from the cache, or derive the function first."""
    origin = description_of(manifest.folder)
    if origin is None:
        raise DerivationError(
            f"{manifest.name}.{function}: the description file of a robot loaded from a folder is "
            f"unknown; run chasles derive FILE --fixed {','.join(names)} --to FOLDER"
        )
    options = *origin[1], *options_for_fixed(names, function)
    digest = _description_digest(manifest.folder)
    return _inverse_of(robot_of, origin[0], digest, options, function)


@functools.lru_cache(maxsize=_MAX_KEPT)
def _inverse_of(
    robot_of: Callable[[Manifest], Any],
    description: Path,
    digest: str,
    options: tuple[str, ...],
    function: str,
) -> Function[Solutions]:
    folder = derived_folder(description, options)
    if _description_digest(folder) != digest:
        raise DerivationError(
            f"{description}: the file has changed since chasles derived the robot; load it again"
        )
    inverse: Function[Solutions] = getattr(robot_of(read_manifest(folder)), function)
    return inverse


@functools.lru_cache(maxsize=_MAX_KEPT)
def _description_digest(folder: Path) -> str:
    return read_manifest(folder).description_sha256
