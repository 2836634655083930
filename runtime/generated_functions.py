"""Names of all generated functions. The stub file contains the types of generated functions."""

from __future__ import annotations

from .call.capabilities import Capability, Hint, OtherName

_NAMES = """
    fk link_poses jacobian_space jacobian_body jacobian_mixed jacobian_space_dot
    jacobian_body_dot jacobian_mixed_dot hessian_mixed twist_space twist_body twist_mixed
    acceleration_space acceleration_body acceleration_mixed fk_jacobian_mixed chain_D_q
    chain_rates chain_accelerations passive passive_D_q actuators_D_chain
    actuator_rates actuator_accelerations actuator_margin margin configuration
    configuration_D_q configuration_near fk_near constraint constraint_D_z constraint_D_z_dot
    swivel fk_p jacobian_p identification_jacobian
    identification_jacobian_space identification_jacobian_body chain_fk chain_link_poses
    chain_jacobian_space chain_jacobian_body chain_jacobian_mixed ik ik_position
    ik_position_pitch ik_position_direction
"""
_STEMS = "jacobian jacobian_dot hessian twist acceleration"
"""Function names without their suffix, which is "space", "body" or "mixed"."""
_OTHER_NAMES = """
    fkine fkine_all jacob0 jacobe jacob0_dot hessian0 ikine ikine_LM ik_LM ikine_a
    inverse_kinematics get_position_ik setFromIK inverse solve IK qlim islimit qz qr vellipse
    fellipse jtraj ctraj plot teach forwardKinematics framesForwardKinematics oMf
    forward_kinematics getGlobalLinkTransform computeJointJacobians getFrameJacobian getJacobian
    nq nv lowerPositionLimit upperPositionLimit neutral randomConfiguration njoints names
    integrate difference rne aba crba gravload computeCartesianPath plan getActiveJointNames
    active_links_mask
"""
"""Function names of other libraries, for which `hints.toml` has hints."""


class GeneratedFunctions:
    """Attributes for generated functions; a missing function raises an error with the reason."""


def _declare(names: str, kind: type[Capability]) -> None:
    for name in names.split():
        capability = kind(None)
        capability.__set_name__(GeneratedFunctions, name)
        if kind is Capability:
            capability.__doc__ = (
                "Generated function of the robot.\n\nWith a loaded robot, "
                f"`help(robot.{name})` describes the arguments and the result."
            )
        setattr(GeneratedFunctions, name, capability)


_declare(_NAMES, Capability)
_declare(_STEMS, Hint)
_declare(_OTHER_NAMES, OtherName)
