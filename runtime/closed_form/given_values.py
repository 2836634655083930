"""Inverses for joints that the caller gives values: `ik(T, given={"elbow": 1.2})`.

A robot has one inverse from the start, in which no joint is given or those that a redundant robot
needs. The inverse for other given joints is derived on first use and kept in the cache, in the same
way as a robot from its description.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..call._call import Function
from ..call.validation import real_array
from ..contract import FunctionInfo, Manifest, read_manifest
from ..errors import DerivationError, InputTypeError, InputValueError
from ..fixed import following
from ..library.derived import derived_folder, description_of, giving
from ..se3 import project
from ..tolerances import GIVEN_ASIDE, GIVEN_NEAR, SOLVED
from .refinement import Refinement
from .solutions import Solutions

FloatArray = NDArray[np.float64]
_MOST_KEPT = 256
"""Inverses that stay loaded."""


@dataclass(frozen=True, eq=False)
class GivenValues:
    """Takes the calls of an inverse that choose the given joints.

    Attributes:
        manifest: The robot's manifest.
        functions: Its functions.
        robot_of: The robot of a manifest.
    """

    manifest: Manifest
    functions: Mapping[str, Function[Any]]
    robot_of: Callable[[Manifest], Any]

    def __call__(
        self,
        *inputs: ArrayLike,
        given: Mapping[str, ArrayLike] | None,
        **options: Any,
    ) -> Solutions:
        """Every solution of poses at which the given joints have their values.

        Args:
            inputs: The poses T (..., 4, 4).
            given: The value (...) of each given joint [rad or m], by its name: a joint of the main
                chain, or a coordinate that moves one joint alone.
            options: The keywords of every call.

        Raises:
            InputTypeError: If given is no mapping, or comes with further inputs.
            InputValueError: If there is no joint of a name.
            DerivationError: If the given joints leave no closed form; names those that do.
        """
        own = self._own
        result: Solutions
        if given is not None and not isinstance(given, Mapping):
            raise self._no_mapping(given)
        if not given:
            result = self.functions[own.name](*inputs, **options)
            return result
        T = self._poses(inputs, options)
        values = dict(self._of_joint(name, value) for name, value in given.items())
        if len(values) < len(given):
            raise InputValueError(f"{self._label}: given={sorted(given)}: a joint is given twice")
        aside = self._inverses.get(tuple(values)) or self._inverse_for(tuple(values))
        ordered = [values[name] for name in aside.names]
        result = aside.inverse(T, *ordered, **options)
        # The solutions of dask arrays are lazy.
        if aside.fixed and isinstance(result.valid, np.ndarray):
            aside.complete(result, T, ordered)
        return result

    def _poses(self, inputs: tuple[ArrayLike, ...], options: dict[str, Any]) -> ArrayLike:
        """The only input beside given=, taken from the options where it is given by its name."""
        first, *more = (argument.name for argument in self._own.inputs)
        if len(inputs) > 1 or any(name in options for name in (*more, *(inputs and [first]))):
            others = ", ".join(more) or "nothing"
            raise InputTypeError(
                f"{self._label}: takes {first} alone beside given=, which stands for {others}"
            )
        if not inputs and first not in options:
            raise InputTypeError(f"{self._label}: takes {first} beside given=, got none")
        poses: ArrayLike = inputs[0] if inputs else options.pop(first)
        return poses

    @functools.cached_property
    def _inverses(self) -> dict[tuple[str, ...], Aside]:
        """The inverses that were asked for, by the names of the given joints as they came."""
        return {}

    def _inverse_for(self, asked: tuple[str, ...]) -> Aside:
        names = tuple(joint for joint in self._joints if joint in asked)
        if set(names) == set(self._own_given):
            names, inverse = self._own_given, self.functions[self._own.name]
        else:
            inverse = self._derived(names)
        fixed: tuple[int, ...] = ()
        if not self.manifest.loops.chain:
            fixed = tuple(self._joints.index(name) for name in names)
        fk_jacobian = self._with_role("pose and jacobian", "actuators")
        aside = Aside(names, inverse, fk_jacobian, fixed)
        return self._inverses.setdefault(asked, aside)

    @functools.cached_property
    def _own(self) -> FunctionInfo:
        own = self.manifest.with_role("inverse", "pose")
        assert own is not None
        return own

    def _with_role(self, *role: str) -> Function[Any] | None:
        info = self.manifest.with_role(*role)
        return self.functions[info.name] if info else None

    @functools.cached_property
    def _joints(self) -> tuple[str, ...]:
        """The joints of the chain, which are the coordinates of a serial robot."""
        return tuple(j.name for j in self.manifest.loops.chain or self.manifest.coordinates)

    @functools.cached_property
    def _own_given(self) -> tuple[str, ...]:
        """The joints whose values the robot's own inverse takes, in the order of its inputs."""
        if self.manifest.loops.chain:
            return tuple(a.name for a in self._own.inputs[1:] if a.name in self._joints)
        return tuple(self._joints[k] for k in self._own.role.given)

    @property
    def _label(self) -> str:
        return f"{self.manifest.name}.{self._own.name}"

    def _no_mapping(self, given: object) -> InputTypeError:
        return InputTypeError(
            f'{self._label}: expected given={{"{self._joints[-1]}": value}}, the values of joints '
            f"by name, got {given!r}"
        )

    def _of_joint(self, name: str, value: ArrayLike) -> tuple[str, ArrayLike]:
        """The joint that a name stands for, and its value."""
        if name in self._joints:
            return name, value
        coordinates = [c.name for c in self.manifest.coordinates]
        if name not in coordinates:
            known = ", ".join(dict.fromkeys((*self._joints, *coordinates)))
            raise InputValueError(
                f"{self._label}: there is no joint {name!r} to be given; there are {known}"
            )
        index, reference = coordinates.index(name), self.manifest.loops.reference
        chain, moved = self._with_role("map", "actuators", "chain"), self._moved_alone(index)
        if reference is None or chain is None or moved is None:
            raise InputValueError(
                f"{self._label}: {name} moves no joint of the main chain alone: give the values of "
                f"joints, among {', '.join(self._joints)}"
            )
        given = real_array(self._label, name, value)
        q = np.array(np.broadcast_to(reference.q, (*given.shape, len(coordinates))))
        q[..., index] = given
        # A batch holds NaN where a loop does not close; a single value raises.
        return self._joints[moved], chain(q)[..., moved]

    def _moved_alone(self, coordinate: int) -> int | None:
        """The joint that follows this coordinate and no other one."""
        reference = self.manifest.loops.reference
        D = self._with_role("map derivative", "actuators", "chain")
        if reference is None or D is None or self.manifest.is_iterated:
            return None
        follows = following(self.manifest.coordinates, reference, D)
        alone = np.flatnonzero(follows[:, coordinate] & (follows.sum(1) == 1))
        return int(alone[0]) if len(alone) == 1 else None

    def _derived(self, names: tuple[str, ...]) -> Function[Solutions]:
        """The inverse for given joints, derived first if the cache has none."""
        coordinates = [c.name for c in self.manifest.coordinates]
        if self.manifest.loops.chain and len(coordinates) < len(self._joints):
            own = (
                f"; ik takes the values of {', '.join(self._own_given)}" if self._own_given else ""
            )
            raise DerivationError(
                f"{self._label}: no other joint can be given: loops couple the joints of the main "
                f"chain{own}; ik_numeric(T, lock=...) finds a solution in which some of "
                f"{', '.join(coordinates)} are held"
            )
        description = description_of(self.manifest.folder)
        if description is None:
            chosen = ",".join(names)
            raise DerivationError(
                f"{self._label}: the description of this robot is not known, since it was loaded "
                f"from a folder; chasles-derive FILE --fixed {chosen} --to FOLDER derives ik for "
                f"given {chosen}"
            )
        digest = _description_digest(self.manifest.folder)
        return _inverse_of(self.robot_of, description, digest, names)


@dataclass(frozen=True)
class Aside:
    """Solutions at values of given joints where the structure of the others degenerates.

    With a given joint at a right angle two axes beside it may become parallel, and formulas made
    for oblique ones then lose the solutions. They are found from a value slightly aside, by
    Newton's iteration with the joint at its value again.

    Attributes:
        names: The given joints, in the order of the inverse's inputs.
        inverse: The inverse for them.
        fk_jacobian_mixed: The function of a serial robot.
        fixed: Indices of the given joints in q, () for a robot with loops.
    """

    names: tuple[str, ...]
    inverse: Callable[..., Any]
    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]] | None
    fixed: tuple[int, ...]

    def complete(self, solutions: Solutions, T: ArrayLike, given: list[ArrayLike]) -> None:
        """Fills slots of poses that have no solution, in place.

        Args:
            solutions: The solutions (..., k, n).
            T: (..., 4, 4) the poses.
            given: The value (...) of each given joint.
        """
        if solutions.valid.any(-1).all():
            return
        assert self.fk_jacobian_mixed is not None
        # One pose is a batch of one.
        lead = (None,) if solutions.valid.ndim == 1 else ()
        unit = solutions.unit
        q, residual, margin, valid = (field[lead] for field in solutions)
        missed = ~valid.any(-1) & np.isfinite(residual).all(-1)
        if not missed.any():
            return
        poses = project(np.broadcast_to(T, (*missed.shape, 4, 4))[missed], caller="ik")
        values = [np.broadcast_to(value, missed.shape)[missed] for value in given]
        near = self.inverse(poses, *(value + GIVEN_ASIDE for value in values))
        rows, slots = np.nonzero(near.residual <= GIVEN_NEAR * unit)
        start = near.q[rows, slots]
        start[:, self.fixed] = np.stack(values, -1)[rows]
        refine = Refinement(self.fk_jacobian_mixed, self.fixed, unit)
        found, left = refine.led(poses[rows], start)
        solved = left <= SOLVED * unit
        at = (*(index[rows[solved]] for index in np.nonzero(missed)), slots[solved])
        q[at], residual[at], valid[at] = found[solved], left[solved], True
        margin[at] = near.margin[rows[solved], slots[solved]]


@functools.lru_cache(maxsize=_MOST_KEPT)
def _inverse_of(
    robot_of: Callable[[Manifest], Any], description: Path, digest: str, names: tuple[str, ...]
) -> Function[Solutions]:
    folder = derived_folder(description, giving(names))
    if _description_digest(folder) != digest:
        raise DerivationError(
            f"{description}: has changed since the robot was derived from it; load it again"
        )
    inverse: Function[Solutions] = robot_of(read_manifest(folder)).ik
    return inverse


@functools.lru_cache(maxsize=_MOST_KEPT)
def _description_digest(folder: Path) -> str:
    """The hash of the description that the robot in a folder was derived from."""
    return read_manifest(folder).description_sha256
