"""Why a robot lacks a function or method, and what it has instead."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from ..contract import Manifest

_OF_LOOPS = "its q are its joints, since it has no loops"
_ITERATED = "its loops are solved by iteration"
_ALWAYS_CLOSED = "its loops close everywhere, in one way"
_NO_PASSIVE = "all its joints are in the main chain"
_CLOSED_FORM = "it has a closed form, which needs no seed"
_NOT_PLANAR = "it is no planar platform"
_NO_PLATFORM = "it is no platform on legs"
_ON_DEMAND = "it is derived by chasles.load(..., parametric=True)"
_TWO_BRANCHES = "its actuators follow from the main chain in one way"

INSTEAD: Mapping[str, tuple[str, ...]] = {
    "chain": ("configuration",),
    "chain_D_q": ("configuration_D_q",),
    "chain_rates": ("chain_D_q",),
    "chain_accelerations": ("chain_D_q",),
    "passive": ("chain", "configuration"),
    "passive_D_q": ("chain_D_q", "configuration_D_q"),
    "configuration": ("chain",),
    "configuration_D_q": ("chain_D_q", "passive_D_q"),
    "actuators": ("ik", "ik_numeric"),
    "actuators_D_chain": ("constraint_D_z",),
    "actuator_rates": ("actuators_D_chain",),
    "actuator_accelerations": ("actuators_D_chain",),
    "actuator_margin": ("actuators",),
    "actuators_valid": ("actuators",),
    "actuators_all": ("actuators",),
    "actuator_branches": ("actuators",),
    "margin": ("follow", "singularity"),
    "valid": ("follow",),
    "chain_all": ("fk_planar_all", "chain"),
    "chain_branches": ("fk_planar_all", "chain"),
    "follow": ("configuration",),
    "fk_planar_all": ("chain_branches",),
    "ik_planar": ("ik", "actuators", "ik_numeric"),
    "swivel": ("ik",),
    "singularity": ("manipulability",),
    "velocity_relation": ("jacobian_mixed",),
    "fk_jacobian_mixed": ("fk", "jacobian_mixed"),
    "joint_accelerations": ("joint_rates",),
    "manipulability_gradient": ("manipulability",),
    "track": ("joint_rates", "ik_numeric"),
    "fk_all": ("chain_branches", "fk"),
    "modes": ("chain_branches", "fk"),
    "fk_near": ("fk",),
    "configuration_near": ("configuration",),
    "follow_path": ("configuration",),
    "determinants": ("singularity", "manipulability"),
    "way_to_singularity": ("singularity", "manipulability"),
    "singularity_curves": ("way_to_singularity", "manipulability"),
    "fk_p": ("fk",),
    "jacobian_p": ("jacobian_mixed",),
}
"""Functions and methods for the same problem, by the missing name, the nearest first."""

_PARAMETRIC = {
    *("fk_p", "jacobian_p", "identification_jacobian"),
    *("identification_jacobian_space", "identification_jacobian_body"),
}
_NEWTON_ALONE = {"fk_near", "configuration_near", "follow_path"}
_LOOPS_ALONE = {
    *("chain", "chain_D_q", "chain_rates", "chain_accelerations", "chain_all", "chain_branches"),
    *("passive", "passive_D_q", "configuration", "configuration_D_q", "follow", "valid", "margin"),
    *("actuators", "actuators_D_chain", "actuator_rates", "actuator_accelerations"),
    *("actuators_all", "actuator_branches", "actuators_valid", "actuator_margin"),
    *("constraint", "constraint_D_z", "constraint_D_z_dot"),
}
_PLATFORMS_ALONE = {
    *("fk_planar_all", "ik_planar", "singularity", "velocity_relation"),
    *("fk_all", "modes", "determinants", "way_to_singularity", "singularity_curves"),
}


_TASKS = {
    "ik_position": "a position",
    "ik_position_pitch": "a position and a pitch",
    "ik_position_direction": "a position and a direction",
}
"""Inverses of arms that reach no whole pose, with their targets."""
_INVERSES = {"ik", "ik_path", "ik_nearest", *_TASKS}
_SOLVERS = {
    "ik_planar": "ik_planar, which takes the pose of a planar platform",
    "actuators": "actuators, which takes the joints of the main chain",
    "ik_numeric": "ik_numeric, which finds one solution by iteration, and with lock= keeps given "
    "joints at their values of the seed",
}
"""What finds coordinates of a pose where a robot has no inverse in closed form."""
_REPRESENTATIONS = ("space", "body", "mixed")


class Described(Protocol):
    """A robot, as far as the reasons need it."""

    @property
    def manifest(self) -> Manifest:
        """Its manifest."""

    @property
    def functions(self) -> Mapping[str, Any]:
        """Its functions by name."""


def explain(robot: Described, name: str) -> tuple[str, str]:
    """The reason why a robot lacks a function or method, and what it has instead.

    Args:
        robot: The robot.
        name: The missing attribute.

    Returns:
        The reason, "" if there is none to state; and the substitutes, "" if there are none.
    """
    if name in _INVERSES:
        return _no_inverse(robot)
    stem, _, suffix = name.partition("_")
    if stem in ("jacobian", "hessian", "twist", "acceleration") and suffix in ("", "dot"):
        named = ["_".join(filter(None, (stem, kind, suffix))) for kind in _REPRESENTATIONS]
        found = ", ".join(item for item in named if item in robot.functions)
        return "the representation must be named", found
    return _reason(robot, name), ", ".join(i for i in _instead(name) if i in dir(robot))


def _instead(name: str) -> tuple[str, ...]:
    """The attributes that solve the same problem, the nearest first."""
    stem, _, rest = name.partition("_")
    if stem in ("jacobian", "hessian", "twist", "acceleration"):
        return INSTEAD.get(name, (f"jacobian_{rest.removesuffix('_dot')}",))
    return INSTEAD.get(name, (rest,) if stem == "chain" else ())


def _no_inverse(robot: Described) -> tuple[str, str]:
    """The reason that the manifest states, and the methods that solve the same problem."""
    found = [f"{name}, which takes {_TASKS[name]}" for name in robot.functions if name in _TASKS]
    found += [text for name, text in _SOLVERS.items() if name in dir(robot)]
    if robot.manifest.kind == "serial":
        found.append(
            "chasles-derive FILE --fixed JOINTS, which writes an ik of given joints where they "
            "leave a closed form"
        )
    missing = robot.manifest.inverse.missing
    return _ITERATED if robot.manifest.is_iterated else missing, "; ".join(found)


def _reason(robot: Described, name: str) -> str:
    manifest = robot.manifest
    if name in _PARAMETRIC:
        return _ON_DEMAND
    if name in _PLATFORMS_ALONE and robot.functions.keys().isdisjoint(("rods", "legs")):
        return _NO_PLATFORM
    if name == "singularity_curves":
        return _NOT_PLANAR
    if name in _NEWTON_ALONE:
        return _CLOSED_FORM
    if name in _LOOPS_ALONE and manifest.kind == "serial":
        return _OF_LOOPS
    if name in ("passive", "passive_D_q") and not manifest.loops.passive:
        return _NO_PASSIVE
    if manifest.is_iterated and name != "swivel":
        return _ITERATED
    if name in ("margin", "chain_all", "chain_branches"):
        return _ALWAYS_CLOSED
    if name in ("actuators_all", "actuator_branches", "actuator_margin", "actuators_valid"):
        return _TWO_BRANCHES
    return ""
