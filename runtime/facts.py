"""Robot data from the manifest, and base methods of every robot."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .arrays import BoolArray, FloatArray, real_array, whole_number
from .call._call import Function
from .call.capabilities import needs
from .contract import Coordinate, Manifest
from .errors import ShapeError
from .generated_functions import GeneratedFunctions
from .joint_limits import joint_limits_of
from .sampling import low_discrepancy
from .size import limits_of, ranges, unit_length, within

T = TypeVar("T")
_STARTS = 256
"""Number of candidates for `q_reference`."""
_SINGULAR = 1e-3
"""Relative threshold for regular configurations. A configuration is regular if its smallest
singular value is at least this fraction of the best candidate's smallest singular value."""
_NEARER = 0.98
"""Factor by which each retry of `random_q` shrinks the sampling range around `q_reference`."""


class Fact(Generic[T]):
    """A robot attribute that is read from the manifest at its first use."""

    def __init__(self, read: Callable[[Manifest], T]) -> None:
        self.read = read

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, robot: Any, owner: type) -> T:
        value = vars(robot)[self.name] = self.read(robot.manifest)
        return value


def _read_only(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array


def _pairs(coordinates: Sequence[Coordinate]) -> FloatArray:
    return _read_only(np.stack(limits_of(coordinates), -1))


def _labels(manifest: Manifest) -> Mapping[str, tuple[str, ...]]:
    found = {item.name: item.role.labels for item in manifest.functions if item.role.labels}
    return MappingProxyType({_PUBLIC.get(name, name): found[name] for name in found})


_PUBLIC = {"chain_all": "chain_branches", "actuators_all": "actuator_branches"}
"""Public methods by the names of the generated functions that they call."""


def _public(manifest: Manifest) -> tuple[str, ...]:
    return tuple(item.name for item in manifest.functions if not item.role.is_intermediate)


def _moves_its_joints(robot: RobotFacts) -> bool:
    return not (robot.loops or robot.manifest.loops.coupling)


class RobotFacts(GeneratedFunctions):
    """The manifest data and the generated functions. See `Robot`."""

    manifest: Manifest
    functions: Mapping[str, Function[Any]]

    name = Fact(lambda manifest: manifest.name)
    title = Fact(lambda manifest: manifest.title)
    kind = Fact(lambda manifest: manifest.kind)
    source = Fact(lambda manifest: manifest.source)
    n = Fact(lambda manifest: len(manifest.coordinates))
    coordinates = Fact(lambda manifest: manifest.coordinates)
    lower = Fact(lambda manifest: _read_only(limits_of(manifest.coordinates)[0]))
    upper = Fact(lambda manifest: _read_only(limits_of(manifest.coordinates)[1]))
    limits = Fact(lambda manifest: _pairs(manifest.coordinates))
    joint_limits = Fact(lambda manifest: _pairs(manifest.loops.chain or manifest.coordinates))
    coordinate_names = Fact(lambda manifest: tuple(c.name for c in manifest.coordinates))
    joint_names = Fact(
        lambda manifest: tuple(j.name for j in manifest.loops.chain or manifest.coordinates)
    )
    base_frame = Fact(lambda manifest: manifest.frames.base)
    tip_frame = Fact(lambda manifest: manifest.frames.tip)
    link_names = Fact(lambda manifest: tuple(manifest.frames.links))
    dof = Fact(lambda m: min(len(m.coordinates), len(m.loops.chain or m.coordinates)))
    parameters = Fact(lambda manifest: MappingProxyType({p.name: p for p in manifest.parameters}))
    geometry = Fact(lambda manifest: manifest.geometry)
    notes = Fact(lambda manifest: manifest.notes)
    cleaning = Fact(lambda manifest: manifest.cleaning)
    labels = Fact(_labels)
    free_coordinates = Fact(lambda manifest: MappingProxyType(manifest.free_coordinates))
    redundancy = Fact(lambda manifest: manifest.redundancy)
    loops = Fact(lambda manifest: manifest.loops.names)
    loop_solution = Fact(lambda manifest: manifest.loops.solution)
    chain_joints = Fact(lambda manifest: manifest.loops.chain or manifest.coordinates)
    passive_joints = Fact(lambda manifest: manifest.loops.passive)
    configuration_variables = Fact(lambda manifest: manifest.loops.configuration)
    reference = Fact(lambda manifest: manifest.loops.reference)
    folder = Fact(lambda manifest: manifest.folder)
    digest = Fact(lambda manifest: manifest.digest)
    _public = Fact(_public)

    @needs(when=_moves_its_joints)
    def chain(self, q: ArrayLike) -> FloatArray:
        """Return joint positions (..., n) [rad or m], equal to q without loops and couplings."""
        return self._reals("chain", "q", q, (self.n,)).copy()

    @needs(when=_moves_its_joints)
    def actuators(self, theta: ArrayLike) -> FloatArray:
        """Return coordinates (..., n) [rad or m], equal to theta without loops and couplings."""
        return self._reals("actuators", "theta", theta, (self.n,)).copy()

    def _reals(self, method: str, name: str, given: Any, core: tuple[int, ...]) -> FloatArray:
        array = real_array(f"{self.name}.{method}", name, given)
        if core and array.shape[-1:] != core:
            raise ShapeError(
                f"{self.name}.{method}: expected {name} of shape (..., {core[0]}), "
                f"got {array.shape}"
            )
        return array

    @functools.cached_property
    def _roles(self) -> Mapping[tuple[str, str, str], Function[Any]]:
        """Map each role (name, domain, codomain) to its first function in the manifest."""
        infos = reversed(self.manifest.functions)
        return MappingProxyType({info.role.key: self.functions[info.name] for info in infos})

    @functools.cached_property
    def unit_length(self) -> float:
        """The length [m] that is equivalent to 1 rad in residuals and tolerances.

        The unit length is 1 m for workspaces from 0.03 m to 30 m, and for robots without `fk`. For
        other workspace sizes, the unit length is the nearest power of 1000, such as 0.001 m.
        """
        fk = self.functions.get("fk")
        return 1.0 if fk is None else unit_length(fk, self.coordinates, self.reference)

    @functools.cached_property
    def q_reference(self) -> FloatArray:
        """(n,) a configuration [rad or m] within the limits and away from singularities.

        For a robot with loops, this configuration is the reference configuration of the
        description, unless the reference is singular. For other robots, and for a singular
        reference, `q_reference` is selected from 256 configurations around the reference or the
        middle of the range. The selected configuration has the largest minimum singular value of
        the Jacobian, with lengths in `unit_length`.
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
        return _read_only(q[0 if keeps else int(np.argmax(values))])

    def _smallest_singular_value(self, q: FloatArray) -> FloatArray:
        if "jacobian_mixed" not in self.functions:
            return np.zeros(len(q))
        J = np.array(self.functions["jacobian_mixed"](q))
        J[~(np.isfinite(J).all((-2, -1)) & self.is_within_limits(q))] = 0.0
        J[:, :3] /= self.unit_length
        values = np.linalg.svd(J, compute_uv=False)
        return np.asarray(values[:, int(np.linalg.matrix_rank(J).max()) - 1])

    def random_q(
        self, size: int | tuple[int, ...] = (), *, rng: int | np.random.Generator | None = 0
    ) -> FloatArray:
        """Return random configurations within the limits, with closed loops.

        Samples are uniform in each coordinate. If a coordinate lacks a limit, its range ends on
        that side pi rad or 1 m from its reference value. For a robot without loops, the reference
        value is 0, or the existing limit if 0 violates this limit. Samples with open loops are
        replaced by samples closer to `q_reference`.

        Args:
            size: The leading dimensions of the result, by default () for a single configuration.
            rng: A seed for reproducible samples, a generator, or None for new samples per call.

        Returns:
            (*size, n) coordinates [rad or m].
        """
        sizes = size if isinstance(size, tuple | list) else (size,)
        shape = [whole_number("random_q", "size", item, 0, 2**40) for item in sizes]
        if rng is not None and not isinstance(rng, np.random.Generator):
            rng = whole_number("random_q", "rng", rng, 0, None)
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
        usable = self.is_within_limits(q)
        if self.loops and "fk" in self.functions:
            usable = usable & np.isfinite(self.fk(q)).all((-2, -1))
        return usable

    def is_within_limits(self, q: ArrayLike) -> BoolArray:
        """Test whether the coordinates and the joints that depend on them are within limits.

        Args:
            q: (..., n) coordinates [rad or m].

        Returns:
            (...,) True if no value exceeds a limit by more than 1e-12 rad or 1e-12 `unit_length`.
            The result is False for NaN, and for open loops if passive joints have limits.

        Raises:
            ShapeError: If the shape of q is not (..., n).
        """
        values = self._reals("is_within_limits", "q", q, (self.n,))
        units = np.array([self.unit_length if c.unit == "m" else 1.0 for c in self.coordinates])
        joints = joint_limits_of(self.manifest, self.functions, "")
        parts = [within(values, self.lower, self.upper, units)]
        parts += [] if joints is None else [joints.inside(values)]
        return np.asarray(np.concatenate(parts, -1).all(-1))
