"""The facts of a robot that its manifest states, and its functions: what all its methods share."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .arrays import BoolArray, FloatArray
from .call._call import Function
from .call.capabilities import needs
from .call.validation import real_array
from .contract import Coordinate, FunctionInfo, Manifest
from .errors import ShapeError
from .generated_functions import GeneratedFunctions
from .sampling import low_discrepancy
from .size import limits_of, ranges, unit_length, within

T = TypeVar("T")
_STARTS = 256
"""Configurations of which `q_reference` is the best."""
_SINGULAR = 1e-3
"""Part of the largest smallest singular value below which a configuration counts as singular."""
_NEARER = 0.98
"""Factor on the distance from `q_reference` of each further random configuration."""


class Fact(Generic[T]):
    """A fact that is read from the robot's manifest when it is first used."""

    def __init__(self, read: Callable[[Manifest], T]) -> None:
        """Stores the way from the manifest to the fact."""
        self.read = read

    def __set_name__(self, owner: type, name: str) -> None:
        """Takes the attribute's name."""
        self.name = name

    def __get__(self, robot: Any, owner: type) -> T:
        """The fact, which the robot keeps."""
        value = vars(robot)[self.name] = self.read(robot.manifest)
        return value


def _limits(manifest: Manifest) -> tuple[FloatArray, FloatArray]:
    lower, upper = limits_of(manifest.coordinates)
    lower.flags.writeable = upper.flags.writeable = False
    return lower, upper


def _inverse(manifest: Manifest) -> FunctionInfo | None:
    return manifest.with_role("inverse", "pose")


class Redundancy(NamedTuple):
    """A redundancy parameter, which chooses one of infinitely many inverses.

    Attributes:
        name: Its name, the key in `fixed=`.
        index: The coordinate with its value, as an index in q; None for a swivel angle.
        unit: Its unit.
        meaning: What it is.
    """

    name: str
    index: int | None  # type: ignore[assignment]
    unit: str
    meaning: str


def redundancy_of(manifest: Manifest) -> tuple[Redundancy, ...]:
    """The redundancy parameters of a robot, () without `ik` or if the pose suffices."""
    own = _inverse(manifest)
    if own is None:
        return ()
    found = []
    for k, item in enumerate(own.inputs[1:]):
        index = own.role.given[k] if own.role.given else None
        name = item.name
        if index is not None and not manifest.loops.chain:
            name = manifest.coordinates[index].name
        found.append(Redundancy(name, index, item.unit, item.meaning))
    return tuple(found)


def _pairs(coordinates: Sequence[Coordinate]) -> FloatArray:
    """(n, 2) lower and upper limits."""
    limits = np.stack(limits_of(coordinates), -1)
    limits.flags.writeable = False
    return limits


def _n_joints(manifest: Manifest) -> int:
    return len(manifest.loops.chain or manifest.coordinates)


def _labels(manifest: Manifest) -> Mapping[str, tuple[str, ...]]:
    """The branch in each slot, by the public name of the function or method."""
    found = {item.name: item.role.labels for item in manifest.functions if item.role.labels}
    return MappingProxyType({_PUBLIC.get(name, name): found[name] for name in found})


def _free_coordinates(manifest: Manifest) -> Mapping[str, tuple[str, ...]]:
    """The names of the coordinates that an inverse leaves at 0, by task."""
    names = [c.name for c in manifest.coordinates]
    found = {i.name.removeprefix("ik_"): i.role.held for i in manifest.functions if i.role.held}
    return MappingProxyType({task: tuple(names[k] for k in found[task]) for task in found})


_PUBLIC = {"chain_all": "chain_branches", "actuators_all": "actuator_branches"}
"""The methods that offer generated functions of several branches."""


def _public(manifest: Manifest) -> tuple[str, ...]:
    return tuple(item.name for item in manifest.functions if not item.role.is_intermediate)


def _has_no_loops(robot: RobotFacts) -> bool:
    return not robot.loops


class RobotFacts(GeneratedFunctions):
    """The manifest, the facts in it, and the generated functions; see `Robot`."""

    manifest: Manifest
    functions: Mapping[str, Function[Any]]

    name = Fact(lambda manifest: manifest.name)
    title = Fact(lambda manifest: manifest.title)
    kind = Fact(lambda manifest: manifest.kind)
    source = Fact(lambda manifest: manifest.source)
    n = Fact(lambda manifest: len(manifest.coordinates))
    coordinates = Fact(lambda manifest: manifest.coordinates)
    lower = Fact(lambda manifest: _limits(manifest)[0])
    upper = Fact(lambda manifest: _limits(manifest)[1])
    limits = Fact(lambda manifest: _pairs(manifest.coordinates))
    joint_limits = Fact(lambda manifest: _pairs(manifest.loops.chain or manifest.coordinates))
    coordinate_names = Fact(lambda manifest: tuple(c.name for c in manifest.coordinates))
    joint_names = Fact(
        lambda manifest: tuple(j.name for j in manifest.loops.chain or manifest.coordinates)
    )
    base_frame = Fact(lambda manifest: manifest.frames.base)
    tip_frame = Fact(lambda manifest: manifest.frames.tip)
    link_names = Fact(lambda manifest: tuple(manifest.frames.links))
    dof = Fact(lambda manifest: min(len(manifest.coordinates), _n_joints(manifest)))
    parameters = Fact(lambda manifest: MappingProxyType({p.name: p for p in manifest.parameters}))
    geometry = Fact(lambda manifest: manifest.geometry)
    notes = Fact(lambda manifest: manifest.notes)
    cleaning = Fact(lambda manifest: manifest.cleaning)
    labels = Fact(_labels)
    free_coordinates = Fact(_free_coordinates)
    redundancy = Fact(redundancy_of)
    loops = Fact(lambda manifest: manifest.loops.names)
    loop_solution = Fact(lambda manifest: manifest.loops.solution)
    chain_joints = Fact(lambda manifest: manifest.loops.chain or manifest.coordinates)
    passive_joints = Fact(lambda manifest: manifest.loops.passive)
    configuration_variables = Fact(lambda manifest: manifest.loops.configuration)
    reference = Fact(lambda manifest: manifest.loops.reference)
    folder = Fact(lambda manifest: manifest.folder)
    digest = Fact(lambda manifest: manifest.digest)
    _public = Fact(_public)

    @needs(when=_has_no_loops)
    def chain(self, q: ArrayLike) -> FloatArray:
        """Return the joints of the chain, theta (..., n): q itself for a robot without loops."""
        return self._reals("chain", "q", q, (self.n,)).copy()

    @needs(when=_has_no_loops)
    def actuators(self, theta: ArrayLike) -> FloatArray:
        """Return the actuated coordinates, q (..., n): theta itself for a robot without loops."""
        return self._reals("actuators", "theta", theta, (self.n,)).copy()

    def _reals(self, method: str, name: str, given: Any, core: tuple[int, ...]) -> FloatArray:
        """Return a float64 array (..., *core)."""
        array = real_array(f"{self.name}.{method}", name, given)
        if core and array.shape[-1:] != core:
            raise ShapeError(
                f"{self.name}.{method}: {name} must have shape (..., {core[0]}), got {array.shape}"
            )
        return array

    @functools.cached_property
    def _roles(self) -> Mapping[tuple[str, str, str], Function[Any]]:
        """The first function of each role, by name, domain and codomain of the role."""
        infos = reversed(self.manifest.functions)
        return MappingProxyType({info.role.key: self.functions[info.name] for info in infos})

    @functools.cached_property
    def unit_length(self) -> float:
        """The length [m] that counts as much as a radian in residuals and tolerances.

        The power of 1000 nearest to the size of the workspace: 1 m for robots of 0.03 m to 30 m,
        and for those without `fk`. The head of `size.py` has the definition.
        """
        fk = self.functions.get("fk")
        return 1.0 if fk is None else unit_length(fk, self.coordinates, self.reference)

    @functools.cached_property
    def q_reference(self) -> FloatArray:
        """(n,) a configuration to start from, within the limits and away from singularities.

        The reference configuration of a robot with loops, unless it is singular. Otherwise the one
        of 256 configurations around it, or around the middle of the limits, with the largest
        smallest singular value of the Jacobian, with lengths in `unit_length`.
        """
        lower, upper = ranges(self.coordinates, self.reference)
        half = np.minimum(upper - lower, 2 * np.pi) / 4
        center = (lower + upper) / 2 if self.reference is None else np.array(self.reference.q)
        q = center + (2 * low_discrepancy(0, _STARTS, self.n) - 1) * half
        q = np.clip(
            np.where([c.unit == "rad" for c in self.coordinates], q.round(3), q), lower, upper
        )
        q[0] = center
        values = self._smallest_singular_value(q)
        keeps = self.reference is not None and values[0] >= _SINGULAR * values.max()
        chosen: FloatArray = q[0 if keeps else int(np.argmax(values))]
        chosen.flags.writeable = False
        return chosen

    def _smallest_singular_value(self, q: FloatArray) -> FloatArray:
        """(N,) at configurations (N, n), of as many singular values as the tool has freedoms."""
        if "jacobian_mixed" not in self.functions:
            return np.zeros(len(q))
        J = np.array(self.functions["jacobian_mixed"](q))
        J[~(np.isfinite(J).all((-2, -1)) & self.is_within_limits(q))] = 0.0
        J[:, :3] /= self.unit_length
        values = np.linalg.svd(J, compute_uv=False)
        return np.asarray(values[:, max(int(np.linalg.matrix_rank(J).max()), 1) - 1])

    def random_q(
        self, size: int | tuple[int, ...] = (), *, rng: int | np.random.Generator | None = 0
    ) -> FloatArray:
        """Random configurations within the limits, at which the loops close.

        Uniform in each coordinate; without limits within a half turn or 1 m of the reference. If
        loops do not close, another configuration follows, each time a little nearer to
        `q_reference`.

        Args:
            size: The leading dimensions.
            rng: A number, which repeats the configurations, a generator, or None for others in
                each call.

        Returns:
            (*size, n) coordinates [rad or m].
        """
        shape = (size,) if isinstance(size, int) else tuple(size)
        generator = np.random.default_rng(rng)
        lower, upper = ranges(self.coordinates, self.reference)
        q = generator.uniform(lower, upper, (math.prod(shape), self.n))
        part, bad = 1.0, np.flatnonzero(~self._is_usable(q))
        while len(bad):
            part *= _NEARER
            others = generator.uniform(lower, upper, (len(bad), self.n))
            q[bad] = self.q_reference + part * (others - self.q_reference)
            bad = bad[~self._is_usable(q[bad])]
        return q.reshape(*shape, self.n)

    def _is_usable(self, q: FloatArray) -> BoolArray:
        """Whether configurations (N, n) are within all limits and close the loops."""
        usable = self.is_within_limits(q)
        if self.loops and "fk" in self.functions:
            usable = usable & np.isfinite(self.fk(q)).all((-2, -1))
        return usable

    def is_within_limits(self, q: ArrayLike) -> BoolArray:
        """Whether coordinates, and the joints of the main chain, are within their limits.

        Args:
            q: (..., n) coordinates [rad or m].

        Returns:
            (...,) whether every value is within its limits, or beyond one by at most 1e-12 (rad, or
            1e-12 `unit_length`). False for NaN, and if the main chain has limits and the loops do
            not close.

        Raises:
            ShapeError: If q does not have n columns.
        """
        values = self._reals("is_within_limits", "q", q, (self.n,))
        inside = self._is_inside(values, self.coordinates, self.limits)
        chain = self._roles.get(("map", "actuators", "chain"))
        if chain is not None and np.isfinite(self.joint_limits).any():
            theta = chain(values.reshape(-1, self.n)).reshape(*values.shape[:-1], -1)
            inside &= self._is_inside(theta, self.chain_joints, self.joint_limits)
        return inside

    def _is_inside(
        self, values: FloatArray, variables: Sequence[Coordinate], limits: FloatArray
    ) -> BoolArray:
        units = np.array([self.unit_length if v.unit == "m" else 1.0 for v in variables])
        return np.asarray(within(values, limits[:, 0], limits[:, 1], units).all(-1))
