"""A robot in use: its facts, and its functions as attributes."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .call._call import Function
from .call.capabilities import Hint, Missing, missing_names
from .closed_form.assembly_modes import PlatformMethods
from .closed_form.hints import no_inverse, no_representation
from .closed_form.nearest import NearestMethods, nearest_function
from .closed_form.paths import InverseMethods
from .closed_form.slot_facts import within
from .closed_form.solutions import Solutions
from .closed_form.substitutes import INSTEAD, substitute
from .contract import (
    Argument,
    Cleaning,
    Coordinate,
    Frames,
    GeometryParameter,
    Manifest,
    Parameter,
    Reference,
    Variable,
    read_manifest,
)
from .errors import ShapeError, SourceMismatchError
from .iterative.numeric_inverse import NumericMethods
from .library import find_folder, is_of_shelf, shipped_folders
from .loading import load_functions
from .velocity.rates import VelocityMethods
from .velocity.singular_ways import SingularWayMethods
from .velocity.track import TrackMethods

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Robot(
    InverseMethods,
    NearestMethods,
    NumericMethods,
    PlatformMethods,
    SingularWayMethods,
    TrackMethods,
    VelocityMethods,
):
    """A generated robot: its facts and its functions.

    The functions are attributes (`robot.fk(q)`). Robots differ in their functions: `dir(robot)`
    lists what this one has, `robot.functions` holds its functions by name, and each has a help text
    of its own (`help(robot.fk)`). A Robot does not change, and robots with equal manifests are
    equal.

    All functions are called in the same way. Leading dimensions broadcast. Integers and other
    floats become float64; booleans, complex numbers and strings raise `InputTypeError`, a wrong
    shape raises `ShapeError`. NaN and infinity propagate without a warning. `out=` takes the array
    to write into, or a tuple of arrays, which may overlap the inputs. `threads=` splits a large
    batch over that many threads ("all": one per core). dask arrays give lazy dask arrays.

    Attributes:
        name: Its name, as given to `load`.
        title: Its name for people.
        kind: "serial"; "hybrid" with loops in closed form; "platform" with loops that are solved
            by iteration, while the actuated coordinates follow from the main chain in closed form;
            "iterated" where neither follows from the other in closed form.
        source: The origin of its description.
        n: Number of actuated coordinates, the length of `q`.
        coordinates: The coordinates, in the order of `q`.
        lower: (n,) lower limits [rad or m], -inf where there is none.
        upper: (n,) upper limits [rad or m], inf where there is none.
        frames: The names of base, tip and links.
        parameters: The named numbers of its description, by name.
        geometry: The numbers that its parametric functions take as `p`, in order; () where it was
            derived without them.
        notes: Remarks, such as numbers that were snapped.
        cleaning: The numbers of its description that were not taken as written, with bounds of
            their effect on the tool's pose: `cleaning.position` [m], `cleaning.orientation` [rad].
        functions: Its functions by name.
        labels: The branch in each slot, of every function with slots, by its name:
            `robot.labels["ik"]`, `robot.labels["chain_all"]`.
        redundancy: The inputs of `ik` beside the pose, which choose one of infinitely many
            inverses: name, unit and meaning of each; () where the pose suffices, or without `ik`.
        given: The coordinates that these inputs give, by index in q; () where they are no
            coordinates, such as a swivel angle.
        held: The coordinates that an inverse leaves at 0, by index in q, by its name.
        loops: The names of its loops; () for a serial robot.
        solution: The solution of its loops: "closed form", "newton", or "" without loops.
        chain_joints: The joints of its main chain, in the order of `theta`; the coordinates for a
            serial robot.
        passive_joints: Its joints that are neither actuated nor in the main chain.
        configuration_variables: All variables of its loops, in the order of `z`.
        reference: The configuration that selects the branch, None without loops.
        manifest: Everything that its manifest states; further facts and its bodies.
        folder: The folder it was loaded from.
        digest: SHA-256 of its manifest, and so of all its equations.
    """

    name: str
    title: str
    kind: str
    source: str
    n: int
    coordinates: tuple[Coordinate, ...]
    lower: FloatArray
    upper: FloatArray
    frames: Frames
    parameters: Mapping[str, Parameter]
    geometry: tuple[GeometryParameter, ...]
    notes: tuple[str, ...]
    cleaning: Cleaning
    functions: Mapping[str, Function[Any]]
    labels: Mapping[str, tuple[str, ...]]
    redundancy: tuple[Argument, ...]
    given: tuple[int, ...]
    held: Mapping[str, tuple[int, ...]]
    loops: tuple[str, ...]
    solution: str
    chain_joints: tuple[Coordinate, ...]
    passive_joints: tuple[Variable, ...]
    configuration_variables: tuple[Variable, ...]
    reference: Reference | None
    manifest: Manifest
    folder: Path
    digest: str

    fk: Function[FloatArray]
    link_poses: Function[FloatArray]
    jacobian_space: Function[FloatArray]
    jacobian_body: Function[FloatArray]
    jacobian_mixed: Function[FloatArray]
    jacobian_space_dot: Function[FloatArray]
    jacobian_body_dot: Function[FloatArray]
    jacobian_mixed_dot: Function[FloatArray]
    hessian_mixed: Function[FloatArray]
    twist_space: Function[FloatArray]
    twist_body: Function[FloatArray]
    twist_mixed: Function[FloatArray]
    acceleration_space: Function[FloatArray]
    acceleration_body: Function[FloatArray]
    acceleration_mixed: Function[FloatArray]
    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]]

    ik: Function[Solutions]
    ik_position: Function[Solutions]
    ik_position_pitch: Function[Solutions]
    ik_position_direction: Function[Solutions]

    chain: Function[FloatArray]
    chain_D_q: Function[FloatArray]
    chain_rates: Function[FloatArray]
    chain_accelerations: Function[FloatArray]
    passive: Function[FloatArray]
    passive_D_q: Function[FloatArray]
    actuators: Function[FloatArray]
    actuators_D_chain: Function[FloatArray]
    actuator_rates: Function[FloatArray]
    actuator_accelerations: Function[FloatArray]
    configuration: Function[FloatArray]
    constraint: Function[FloatArray]
    constraint_D_z: Function[FloatArray]
    constraint_D_z_dot: Function[FloatArray]
    swivel: Function[FloatArray]

    fk_p: Function[FloatArray]
    jacobian_p: Function[FloatArray]
    identification_jacobian: Function[FloatArray]
    identification_jacobian_space: Function[FloatArray]
    identification_jacobian_body: Function[FloatArray]
    chain_fk: Function[FloatArray]
    chain_link_poses: Function[FloatArray]
    chain_jacobian_space: Function[FloatArray]
    chain_jacobian_body: Function[FloatArray]
    chain_jacobian_mixed: Function[FloatArray]
    configuration_D_q: Function[FloatArray]

    def __init__(self, manifest: Manifest) -> None:
        """Makes the robot of a manifest, and compiles its functions if the cache lacks them.

        Args:
            manifest: The manifest.

        Raises:
            ChaslesError: If its functions cannot be compiled or loaded; the message states the
                reason.
        """
        pickler = _function_pickler(manifest)
        functions = load_functions(manifest, pickler, Robot)
        roles: dict[tuple[str, str, str], Function[Any]] = {}
        for info in manifest.functions:
            roles.setdefault(info.role.key, functions[info.name])
        inverse = manifest.with_role("inverse", "pose")
        lower = [-np.inf if c.lower is None else c.lower for c in manifest.coordinates]
        upper = [np.inf if c.upper is None else c.upper for c in manifest.coordinates]
        vars(self).update(
            functions,
            name=manifest.name,
            title=manifest.title,
            kind=manifest.kind,
            source=manifest.source,
            n=len(manifest.coordinates),
            coordinates=manifest.coordinates,
            lower=_constant(lower),
            upper=_constant(upper),
            frames=manifest.frames,
            parameters=MappingProxyType({item.name: item for item in manifest.parameters}),
            geometry=manifest.geometry,
            notes=manifest.notes,
            cleaning=manifest.cleaning,
            functions=MappingProxyType(functions),
            labels=_by_name(manifest, "labels"),
            redundancy=inverse.inputs[1:] if inverse else (),
            given=inverse.role.given if inverse else (),
            held=_by_name(manifest, "held"),
            loops=manifest.loops.names,
            solution=manifest.loops.solution,
            chain_joints=manifest.loops.chain or manifest.coordinates,
            passive_joints=manifest.loops.passive,
            configuration_variables=manifest.loops.configuration,
            reference=manifest.loops.reference,
            folder=manifest.folder,
            digest=manifest.digest,
            manifest=manifest,
            _roles=MappingProxyType(roles),
            _solvers={},
            _velocity_relation=manifest.with_role("velocity relation", "chain"),
        )
        nearest = nearest_function(self, (_restore_nearest, (_address(self.folder), self.digest)))
        vars(self).update({} if nearest is None else {"ik_nearest": nearest})
        missing = missing_names(self, _optional_functions(), _HINTS)
        object.__setattr__(self, "__class__", _class_without(frozenset(missing.items())))

    def is_within_limits(self, q: ArrayLike) -> BoolArray:
        """Whether coordinates are within the robot's limits, up to rounding.

        Args:
            q: (..., n) coordinates [rad or m].

        Returns:
            (...,) whether every coordinate is within its limits, or beyond one by at most 1e-12
            (rad, or 1e-12 `unit_length`). False for NaN.

        Raises:
            ShapeError: If q does not have n columns.
        """
        units = np.array([self.unit_length if c.unit == "m" else 1.0 for c in self.coordinates])
        values = np.asarray(q, dtype=np.float64)
        if values.shape[-1:] != (self.n,):
            raise ShapeError(
                f"{self.name}.is_within_limits: q: expected shape (..., {self.n}), got "
                f"{values.shape}"
            )
        return np.asarray(within(values, self.lower, self.upper, units).all(-1))

    def __dir__(self) -> list[str]:
        """The attributes that this robot has."""
        return [name for name in super().__dir__() if not self._lacks(name)]

    def _lacks(self, name: str) -> bool:
        return isinstance(vars(type(self)).get(name), Missing)

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Refuses: a robot does not change."""
        raise AttributeError(f"a Robot does not change: cannot set {name!r}", name=name, obj=self)

    def __delattr__(self, name: str) -> NoReturn:
        """Refuses: a robot does not change."""
        raise AttributeError(
            f"a Robot does not change: cannot delete {name!r}", name=name, obj=self
        )

    def __repr__(self) -> str:
        """Title, coordinates and functions."""
        coordinates = ", ".join(f"{c.name} [{c.unit}]" for c in self.coordinates)
        functions = ", ".join(self.functions)
        title = "" if self.title == self.name else f"{self.title}; "
        return f"<Robot {self.name}: {title}q = ({coordinates}); {functions}>"

    def __eq__(self, other: object) -> bool:
        """Whether both have the same manifest."""
        return self.digest == other.digest if isinstance(other, Robot) else NotImplemented

    def __hash__(self) -> int:
        """The hash of the manifest's digest."""
        return hash(self.digest)

    def __reduce__(self) -> tuple[Callable[..., Robot], tuple[str, str]]:
        """Pickles folder and digest; the process that unpickles loads the robot by itself."""
        return _restore, (_address(self.folder), self.digest)


_INVERSES = ("ik", "ik_position", "ik_position_pitch", "ik_position_direction")
_PLAIN = ("jacobian", "jacobian_dot", "hessian", "twist", "acceleration")
_HINTS: Mapping[str, Hint] = {
    **{name: partial(substitute, name=name) for name in INSTEAD},
    **dict.fromkeys(_INVERSES, no_inverse),
    **{name: partial(no_representation, name=name) for name in _PLAIN},
}
"""Hints for functions and methods; those without a representation are ones that no robot has."""


@functools.cache
def _optional_functions() -> frozenset[str]:
    """Every function that a robot can have: the attributes that are annotated as one."""
    annotations = (vars(parent).get("__annotations__", {}) for parent in Robot.__mro__)
    named = (item for own in annotations for item in own.items())
    own_names = (name for name, kind in named if kind.startswith("Function["))
    return frozenset([*_INVERSES, *_PLAIN, *own_names])


@functools.cache
def _class_without(missing: frozenset[tuple[str, Hint]]) -> type[Robot]:
    """The class of robots that lack some attributes."""
    attributes: dict[str, Any] = {name: Missing(name, hint) for name, hint in missing}
    attributes |= {"__module__": Robot.__module__, "__qualname__": "Robot"}
    attributes |= {"__doc__": Robot.__doc__}
    return type("Robot", (Robot,), attributes)


def _by_name(manifest: Manifest, fact: str) -> Mapping[str, Any]:
    """A fact of the roles of functions by the functions' names, where it is stated."""
    found = {item.name: getattr(item.role, fact) for item in manifest.functions}
    return MappingProxyType({name: value for name, value in found.items() if value})


def _constant(values: list[float]) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _address(folder: Path) -> str:
    """The name of an installed robot, so that the pickle is valid on another machine too."""
    installed = shipped_folders().get(folder.name) == folder or is_of_shelf(folder)
    return folder.name if installed else str(folder.absolute())


def _restore(address: str, digest: str) -> Robot:
    folder = find_folder(address)
    manifest = read_manifest(folder)
    if manifest.digest != digest:
        raise SourceMismatchError(f"{folder}: not the {manifest.name} that was pickled")
    return Robot(manifest)


@functools.cache
def _restore_once(address: str, digest: str) -> Robot:
    """As above, but once: a scheduler sends the same function with every piece of an array."""
    return _restore(address, digest)


def _restore_nearest(address: str, digest: str) -> Any:
    return _restore_once(address, digest).ik_nearest


def _restore_function(address: str, digest: str, name: str) -> Function[Any]:
    return _restore_once(address, digest).functions[name]


def _function_pickler(manifest: Manifest) -> Callable[[str], tuple[Any, ...]]:
    address = _address(manifest.folder)
    return lambda name: (_restore_function, (address, manifest.digest, name))
