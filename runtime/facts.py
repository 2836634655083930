"""The facts of a robot that its manifest states, and its functions: what all its methods share."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from .call._call import Function
from .call.capabilities import generated
from .contract import FunctionInfo, Manifest
from .size import limits_of, unit_length

FloatArray = NDArray[np.float64]
T = TypeVar("T")


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


def _by_name(manifest: Manifest, fact: str) -> Mapping[str, Any]:
    """A fact of the roles of functions by the functions' names, where it is stated."""
    found = {item.name: getattr(item.role, fact) for item in manifest.functions}
    return MappingProxyType({name: value for name, value in found.items() if value})


class RobotFacts:
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
    frames = Fact(lambda manifest: manifest.frames)
    parameters = Fact(lambda manifest: MappingProxyType({p.name: p for p in manifest.parameters}))
    geometry = Fact(lambda manifest: manifest.geometry)
    notes = Fact(lambda manifest: manifest.notes)
    cleaning = Fact(lambda manifest: manifest.cleaning)
    labels = Fact(lambda manifest: _by_name(manifest, "labels"))
    held = Fact(lambda manifest: _by_name(manifest, "held"))
    redundancy = Fact(lambda manifest: own.inputs[1:] if (own := _inverse(manifest)) else ())
    given = Fact(lambda manifest: own.role.given if (own := _inverse(manifest)) else ())
    loops = Fact(lambda manifest: manifest.loops.names)
    solution = Fact(lambda manifest: manifest.loops.solution)
    chain_joints = Fact(lambda manifest: manifest.loops.chain or manifest.coordinates)
    passive_joints = Fact(lambda manifest: manifest.loops.passive)
    configuration_variables = Fact(lambda manifest: manifest.loops.configuration)
    reference = Fact(lambda manifest: manifest.loops.reference)
    folder = Fact(lambda manifest: manifest.folder)
    digest = Fact(lambda manifest: manifest.digest)

    fk: Function[FloatArray] = generated()
    link_poses: Function[FloatArray] = generated()
    jacobian_space: Function[FloatArray] = generated()
    jacobian_body: Function[FloatArray] = generated()
    jacobian_mixed: Function[FloatArray] = generated()
    jacobian_space_dot: Function[FloatArray] = generated()
    jacobian_body_dot: Function[FloatArray] = generated()
    jacobian_mixed_dot: Function[FloatArray] = generated()
    hessian_mixed: Function[FloatArray] = generated()
    twist_space: Function[FloatArray] = generated()
    twist_body: Function[FloatArray] = generated()
    twist_mixed: Function[FloatArray] = generated()
    acceleration_space: Function[FloatArray] = generated()
    acceleration_body: Function[FloatArray] = generated()
    acceleration_mixed: Function[FloatArray] = generated()
    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]] = generated()

    chain: Function[FloatArray] = generated()
    chain_D_q: Function[FloatArray] = generated()
    chain_rates: Function[FloatArray] = generated()
    chain_accelerations: Function[FloatArray] = generated()
    chain_all: Function[tuple[FloatArray, FloatArray]] = generated()
    passive: Function[FloatArray] = generated()
    passive_D_q: Function[FloatArray] = generated()
    actuators: Function[FloatArray] = generated()
    actuators_D_chain: Function[FloatArray] = generated()
    actuators_all: Function[tuple[FloatArray, FloatArray]] = generated()
    actuator_rates: Function[FloatArray] = generated()
    actuator_accelerations: Function[FloatArray] = generated()
    actuator_margin: Function[FloatArray] = generated()
    margin: Function[FloatArray] = generated()
    configuration: Function[FloatArray] = generated()
    configuration_D_q: Function[FloatArray] = generated()
    configuration_near: Function[FloatArray] = generated()
    fk_near: Function[tuple[FloatArray, FloatArray]] = generated()
    constraint: Function[FloatArray] = generated()
    constraint_D_z: Function[FloatArray] = generated()
    constraint_D_z_dot: Function[FloatArray] = generated()
    swivel: Function[FloatArray] = generated()
    modes: Function[tuple[FloatArray, FloatArray, FloatArray]] = generated()
    velocity_relation: Function[tuple[FloatArray, FloatArray]] = generated()

    fk_p: Function[FloatArray] = generated()
    jacobian_p: Function[FloatArray] = generated()
    identification_jacobian: Function[FloatArray] = generated()
    identification_jacobian_space: Function[FloatArray] = generated()
    identification_jacobian_body: Function[FloatArray] = generated()
    chain_fk: Function[FloatArray] = generated()
    chain_link_poses: Function[FloatArray] = generated()
    chain_jacobian_space: Function[FloatArray] = generated()
    chain_jacobian_body: Function[FloatArray] = generated()
    chain_jacobian_mixed: Function[FloatArray] = generated()

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
