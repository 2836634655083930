"""What there is instead of a function that a robot lacks, and why it lacks it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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
    "constraint": (),
    "constraint_D_z": (),
    "constraint_D_z_dot": (),
    "fk_planar_all": ("chain_branches",),
    "ik_planar": ("ik", "actuators", "ik_numeric"),
    "swivel": ("ik",),
    "singularity": ("manipulability",),
    "velocity_relation": ("jacobian_mixed",),
    "rods": ("legs", "constraint"),
    "rods_D_chain": ("legs_D_chain", "constraint_D_z"),
    "legs": ("rods", "constraint"),
    "legs_D_chain": ("rods_D_chain", "constraint_D_z"),
    "assembly_polynomial": ("fk_planar_all", "chain_branches"),
    "assembly_position": ("fk_planar_all", "chain_branches"),
    "assembly_mirror": ("fk_planar_all", "chain_branches"),
    "chain_fk": ("fk",),
    "chain_link_poses": ("link_poses",),
    "chain_jacobian_space": ("jacobian_space",),
    "chain_jacobian_body": ("jacobian_body",),
    "chain_jacobian_mixed": ("jacobian_mixed",),
    "fk_jacobian_mixed": ("fk", "jacobian_mixed"),
    "twist_space": ("jacobian_space",),
    "twist_body": ("jacobian_body",),
    "twist_mixed": ("jacobian_mixed",),
    "jacobian_space_dot": ("jacobian_space",),
    "jacobian_body_dot": ("jacobian_body",),
    "jacobian_mixed_dot": ("jacobian_mixed",),
    "hessian_mixed": ("jacobian_mixed",),
    "acceleration_space": ("jacobian_space",),
    "acceleration_body": ("jacobian_body",),
    "acceleration_mixed": ("jacobian_mixed",),
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
    "identification_jacobian": (),
    "identification_jacobian_space": (),
    "identification_jacobian_body": (),
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
    *("fk_planar_all", "ik_planar", "singularity", "velocity_relation", "rods", "rods_D_chain"),
    *("legs", "legs_D_chain"),
    *("assembly_polynomial", "assembly_position", "assembly_mirror"),
    *("fk_all", "modes", "determinants", "way_to_singularity", "singularity_curves"),
}


def substitute(robot: Any, name: str) -> tuple[str, str]:
    """The reason why a robot lacks a function, and what it has instead.

    Args:
        robot: The robot.
        name: The missing function.

    Returns:
        The reason, "" if there is none to tell; and the substitutes, "" if there are none.
    """
    found = [instead for instead in INSTEAD[name] if instead in dir(robot)]
    return _reason(robot, name), ", ".join(found)


def _reason(robot: Any, name: str) -> str:
    if name in _PARAMETRIC:
        return _ON_DEMAND
    if name in _PLATFORMS_ALONE and robot.functions.keys().isdisjoint(("rods", "legs")):
        return _NO_PLATFORM
    if name == "singularity_curves":
        return _NOT_PLANAR
    if name in _NEWTON_ALONE:
        return _CLOSED_FORM
    if name in _LOOPS_ALONE and robot.kind == "serial":
        return _OF_LOOPS
    if name in ("passive", "passive_D_q") and not robot.passive_joints:
        return _NO_PASSIVE
    if robot.manifest.is_iterated and name != "swivel":
        return _ITERATED
    if name in ("margin", "chain_all", "chain_branches"):
        return _ALWAYS_CLOSED
    if name in ("actuators_all", "actuator_branches", "actuator_margin", "actuators_valid"):
        return _TWO_BRANCHES
    return ""
