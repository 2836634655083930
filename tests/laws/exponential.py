"""exp and log of SO(3) and SE(3), and the exponential of a joint screw, on SymPy matrices.

Symbols are assumed to be real, and a symbolic angle to be neither zero nor a multiple of 2 pi. The
expressions contain only +, *, **, sin, cos, sqrt and atan2. In float64 exp is accurate at every
angle except zero, where it is 0/0. The error of log is about the machine epsilon divided by the
distance of the angle from pi. `exp_screw` is accurate at every angle, because its formula contains
no division by the angle.

Source:
    R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, 1994.
"""

from sympy import Expr, Float, Rational, S, atan2, cos, eye, pi, sin, sqrt, zeros

from chasles.derive.terms.lie import (
    Matrix,
    checked,
    hat_so3,
    is_zero,
    norm,
    pose,
    require_unit,
    rotation,
    translation,
    twist,
)

from .algebras import halves, vee_so3
from .coefficients import COTANGENT, SINC, VERSINE
from .differential import dexp_left_so3, quadratic


def exp_so3(omega: Matrix) -> Matrix:
    """Rotation by |omega| about the direction of omega.

    `exp_so3(omega) = I + sin(t)/t W + (1 - cos t)/t^2 W^2`, with W = hat(omega) and t = |omega|.

    Args:
        omega: (3, 1) rotation vector, radian.

    Returns:
        (3, 3) rotation.

    Raises:
        ValueError: The shape is not (3, 1).

    Source: Murray, Li and Sastry, chapter 2, section 2, Rodrigues' formula.
    """
    omega = checked(omega, (3, 1), "omega")
    theta = norm(omega)
    return quadratic(omega, S.One, SINC(theta), VERSINE(theta))


def log_so3(R: Matrix) -> Matrix:
    """Return the logarithm of a rotation matrix as a rotation vector.

    The length of the vector is at most pi, and `exp_so3(log_so3(R)) = R`.

    The angle is `atan2(s, c)` with s = |vee(R - R')| / 2 and c = (trace R - 1) / 2. For a `Float`
    matrix with c < 0, the axis is computed from the symmetric part of R, which is accurate near
    the angle pi. At pi (s is zero; for Floats, up to rounding error) both signs of the axis are
    possible. The first nonzero component of the returned axis is positive.

    A symbolic rotation is assumed to be neither the identity nor a rotation by pi. For a symbolic
    rotation about a fixed axis, the result is also regular at the angles 0 and pi. For example, the
    logarithm of a rotation about z by q is (0, 0, atan2(sin q, cos q)).

    Args:
        R: (3, 3) rotation. Orthogonality is assumed.

    Returns:
        (3, 1) rotation vector, radian, in the frame before or after the rotation (the axis is the
        same in both frames).

    Raises:
        ValueError: The shape is not (3, 3).

    Source: Murray, Li and Sastry, chapter 2, section 2, with atan2 instead of acos.
    """
    return _rotation_vector(checked(R, (3, 3), "R"))[0]


def exp_se3(x: Matrix) -> Matrix:
    """Pose reached by following a constant twist for unit time.

    `exp_se3(v, omega) = [[exp_so3(omega), dexp_left_so3(omega) v], [0, 1]]`.

    Args:
        x: (6, 1) twist (v, omega), meter and radian. omega = 0 is allowed for numbers; for symbols,
            see the module. For a screw axis times a joint variable use `exp_screw`.

    Returns:
        (4, 4) pose.

    Raises:
        ValueError: The argument does not have the shape (6, 1).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    v, omega = halves(x)
    return pose(exp_so3(omega), dexp_left_so3(omega) * v)


def log_se3(T: Matrix) -> Matrix:
    """Return the logarithm of a pose as a twist (v, omega).

    The length of omega is at most pi, and `exp_se3(log_se3(T)) = T`.

    `omega = log_so3(R)` and `v = dexp_left_inverse_so3(omega) p`.

    Args:
        T: (4, 4) pose. The rotation of the pose is assumed to be orthogonal.

    Returns:
        (6, 1) twist (v, omega), meter and radian.

    Raises:
        ValueError: The shape is not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    T = checked(T, (4, 4), "T")
    omega, theta = _rotation_vector(rotation(T))
    V_inverse = quadratic(omega, S.One, -S.Half, COTANGENT(theta))
    return twist(V_inverse * translation(T), omega)


def exp_screw(screw: Matrix, theta: Expr) -> Matrix:
    """Pose of a joint: the exponential of a unit screw times the joint variable.

    The function equals `exp_se3(screw * theta)`. For a unit axis a and pitch h = a.v, the rotation
    is `R = a a' + cos(theta) (I - a a') + sin(theta) hat(a)`. The translation is `p = sin(theta) (v
    - h a) + (1 - cos(theta)) (a x v) + theta h a`. For a prismatic joint, R = I and `p = theta v`.

    Args:
        screw: (6, 1) twist (v, omega), with omega of unit length (revolute, helical), or zero
            (prismatic). A symbolic omega is assumed to have unit length.
        theta: Joint variable: radian, or meter if omega is zero and v has unit length.

    Returns:
        (4, 4) pose.

    Raises:
        ValueError: The shape is wrong, or a numeric omega has a length other than 0 or 1.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    v, axis = halves(screw)
    if all(is_zero(e) for e in axis):
        return pose(eye(3), theta * v)
    require_unit(axis, "omega of the screw")
    along = (axis * axis.T).expand()
    R = along + cos(theta) * (eye(3) - along) + sin(theta) * hat_so3(axis)
    pitch = axis.dot(v).expand()
    across = (v - pitch * axis).expand()
    radial = axis.cross(v).expand()
    p = sin(theta) * across + (1 - cos(theta)) * radial + theta * pitch * axis
    return pose(R, p)


def _rotation_vector(R: Matrix) -> tuple[Matrix, Expr]:
    """Return the rotation vector and the angle of a rotation matrix.

    For a symbolic matrix, the angle may be negative.
    """
    sine_axis = vee_so3(R - R.T) / 2
    sine, cosine = norm(sine_axis), (R.trace() - 1) / 2
    if not R.is_symbolic():
        if cosine < 0 and (R.has(Float) or is_zero(sine)):
            return _rotation_vector_near_half_turn(R, sine_axis, sine, cosine)
        if is_zero(sine):
            return zeros(3, 1).as_immutable(), S.Zero
        theta = atan2(sine, cosine)
    else:
        # Do not evaluate the atan2. SymPy would replace atan2 by atan if it could prove that the
        # cosine is positive.
        theta = atan2(sine, cosine, evaluate=False)
    return sine_axis * (theta / sine), theta


def _rotation_vector_near_half_turn(
    R: Matrix, sine_axis: Matrix, sine: Expr, cosine: Expr
) -> tuple[Matrix, Expr]:
    """Return the rotation vector from the symmetric part cos I + (1 - cos) a a', and its angle."""
    outer = (R + R.T) / 2 - cosine * eye(3)
    column = outer[:, max(range(3), key=lambda k: outer[k, k])]
    axis = column / sqrt(column.dot(column))
    noise = _rounding(R)
    if not R.has(Float) or sine <= noise:
        first = next(e for e in axis if not is_zero(e) and abs(e) > noise)
        return axis * (pi if first > 0 else -pi), pi
    theta = atan2(sine, cosine)
    return axis * (theta if axis.dot(sine_axis) > 0 else -theta), theta


def _rounding(M: Matrix) -> Expr:
    if not M.has(Float):
        return S.Zero
    return Rational(1, 2 ** (min(e._prec for e in M.atoms(Float)) - 4))
