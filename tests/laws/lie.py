"""Functions on SO(3), SE(3) and their algebras.

The functions that are not imported from chasles are reference implementations for tests.
"""

from chasles.derive.terms.lie import (
    Matrix,
    adjoint,
    hat_so3,
    inverse_se3,
    pose,
    rotation,
    screw_axis,
    swap_twist_order,
    translation,
)

from .algebras import ad, hat_se3, vee_se3, vee_so3
from .coefficients import (
    COTANGENT,
    COTANGENT_RATE,
    HALF_ANGLE_VERSINE,
    SINC,
    SINE_DEFECT,
    SINE_DEFECT_RATE,
    VERSINE,
    VERSINE_RATE,
)
from .differential import (
    dexp_left_inverse_se3,
    dexp_left_inverse_so3,
    dexp_left_se3,
    dexp_left_so3,
    dexp_right_inverse_se3,
    dexp_right_inverse_so3,
    dexp_right_se3,
    dexp_right_so3,
)
from .exponential import exp_screw, exp_se3, exp_so3, log_se3, log_so3

__all__ = [
    "COTANGENT",
    "COTANGENT_RATE",
    "HALF_ANGLE_VERSINE",
    "SINC",
    "SINE_DEFECT",
    "SINE_DEFECT_RATE",
    "VERSINE",
    "VERSINE_RATE",
    "Matrix",
    "ad",
    "adjoint",
    "dexp_left_inverse_se3",
    "dexp_left_inverse_so3",
    "dexp_left_se3",
    "dexp_left_so3",
    "dexp_right_inverse_se3",
    "dexp_right_inverse_so3",
    "dexp_right_se3",
    "dexp_right_so3",
    "exp_screw",
    "exp_se3",
    "exp_so3",
    "hat_se3",
    "hat_so3",
    "inverse_se3",
    "log_se3",
    "log_so3",
    "pose",
    "rotation",
    "screw_axis",
    "swap_twist_order",
    "translation",
    "vee_se3",
    "vee_so3",
]
