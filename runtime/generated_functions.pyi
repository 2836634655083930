from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from .call._call import Function
from .closed_form.solutions import Solutions

FloatArray = NDArray[np.float64]

class GeneratedFunctions:
    """Attributes for the generated functions; a robot that lacks a function states the reason."""

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
    chain_D_q: Function[FloatArray]
    chain_rates: Function[FloatArray]
    chain_accelerations: Function[FloatArray]
    passive: Function[FloatArray]
    passive_D_q: Function[FloatArray]
    actuators_D_chain: Function[FloatArray]
    actuator_rates: Function[FloatArray]
    actuator_accelerations: Function[FloatArray]
    actuator_margin: Function[FloatArray]
    margin: Function[FloatArray]
    configuration: Function[FloatArray]
    configuration_D_q: Function[FloatArray]
    configuration_near: Function[FloatArray]
    fk_near: Function[tuple[FloatArray, FloatArray]]
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
    ik: Function[Solutions]
    ik_position: Function[Solutions]
    ik_position_pitch: Function[Solutions]
    ik_position_direction: Function[Solutions]
    jacobian: NoReturn
    jacobian_dot: NoReturn
    hessian: NoReturn
    twist: NoReturn
    acceleration: NoReturn
