"""The generated functions that robots can have, by name; their types are in the stub."""

from __future__ import annotations

from .call.capabilities import Capability

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
    ik_position_pitch ik_position_direction jacobian jacobian_dot hessian twist acceleration
"""


class GeneratedFunctions:
    """Attributes for the generated functions; a robot that lacks a function states the reason."""


for _name in _NAMES.split():
    _capability = Capability(None)
    setattr(GeneratedFunctions, _name, _capability)
    _capability.__set_name__(GeneratedFunctions, _name)
