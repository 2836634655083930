"""The differential of exp on SO(3) and SE(3) and its inverse, in closed form on SymPy matrices.

Symbols are assumed to be real. The length of a symbolic rotation vector is assumed to be neither
zero nor a multiple of 2 pi. In float64 the SO(3) `dexp` is accurate at every angle except zero,
where it is 0/0. The off-diagonal block of the SE(3) `dexp` and of its inverse has an error of about
the machine epsilon divided by the angle.

Source:
    A. Mueller, Review of the exponential and Cayley map on SE(3), Proceedings of the Royal Society
    A 477, 2021, section 2.
"""

from sympy import Expr, S, eye

from chasles.derive.terms.lie import Matrix, checked, hat_so3, norm, triangular

from .algebras import halves
from .coefficients import (
    COTANGENT,
    COTANGENT_RATE,
    HALF_ANGLE_VERSINE,
    SINE_DEFECT,
    SINE_DEFECT_RATE,
    VERSINE_RATE,
)


def dexp_left_so3(omega: Matrix) -> Matrix:
    """Left-trivialized differential of exp on SO(3).

    The matrix maps the rate x' of a rotation vector x to the angular velocity in the fixed frame:
    `d/dt exp(hat x) exp(-hat x) = hat(dexp_left(x) x')`. The matrix equals the sum of `hat(x)^k /
    (k + 1)!` over k = 0, 1, 2, ... With W = hat(x) and t = |x|, it also equals `I + (1 - cos t)/t^2
    W + (t - sin t)/t^3 W^2`. A third form is `exp(hat x) dexp_right(x)`. The function is singular
    at |omega| = 2 pi k, k > 0.

    Args:
        omega: (3, 1) rotation vector, radian. A numeric vector may be zero. For a
            symbolic vector, see the docstring of this module.

    Returns:
        (3, 3) matrix, without unit.

    Raises:
        ValueError: The shape is not (3, 1).

    Source: Mueller, section 2.
    """
    omega = checked(omega, (3, 1), "omega")
    theta = norm(omega)
    return quadratic(omega, S.One, HALF_ANGLE_VERSINE(theta), SINE_DEFECT(theta))


def dexp_right_so3(omega: Matrix) -> Matrix:
    """Return the right-trivialized differential of the exponential map on SO(3).

    The matrix maps the rate x' of a rotation vector x to the angular velocity in the moving frame:
    `exp(-hat x) d/dt exp(hat x) = hat(dexp_right(x) x')`. The domain, the result and the errors are
    the same as for `dexp_left_so3`.
    """
    return dexp_left_so3(-omega)


def dexp_left_inverse_so3(omega: Matrix) -> Matrix:
    """Return the inverse of `dexp_left_so3`.

    The matrix maps the angular velocity in the fixed frame to the rate of the rotation vector.

    `I - W/2 + (1 - t/2 cot(t/2))/t^2 W^2`, with W = hat(omega) and t = |omega|.

    Args:
        omega: (3, 1) rotation vector, radian. A numeric vector may be zero. For a
            symbolic vector, see the docstring of this module.

    Returns:
        (3, 3) matrix, without unit.

    Raises:
        ValueError: The shape of omega is not (3, 1), or |omega| is an exact positive multiple of 2
            pi, for which no inverse exists. A floating-point |omega| near a positive multiple of 2
            pi raises no error, but the matrix then has large entries.

    Source: Mueller, section 2.
    """
    omega = checked(omega, (3, 1), "omega")
    return quadratic(omega, S.One, -S.Half, COTANGENT(norm(omega)))


def dexp_right_inverse_so3(omega: Matrix) -> Matrix:
    """Inverse of `dexp_right_so3`, equal to `dexp_left_inverse_so3(-omega)`.

    Maps the angular velocity in the moving frame to the rate of the rotation vector. The domain,
    the result and the errors are the same as for `dexp_left_inverse_so3`.
    """
    return dexp_left_inverse_so3(-omega)


def dexp_left_se3(x: Matrix) -> Matrix:
    """Left-trivialized differential of exp on SE(3), [[J, Q], [0, J]], with J of SO(3).

    The matrix maps the rate x' to the spatial twist: `d/dt exp(hat x) exp(-hat x) =
    hat(dexp_left(x) x')`. The result equals the sum of `ad(x)^k / (k + 1)!` over k, and also
    `Ad(exp x) dexp_right(x)`. Q is the derivative of J = `dexp_left_so3(omega)` in direction v. The
    function is singular at |omega| = 2 pi k, k > 0.

    Args:
        x: (6, 1) twist (v, omega), meter and radian. omega = 0 is allowed for numbers; for symbols,
            see the module.

    Returns:
        (6, 6) matrix on twists (v, omega); Q has the unit of v.

    Raises:
        ValueError: The argument does not have the shape (6, 1).

    Source: Mueller, section 2.
    """
    v, omega = halves(x)
    theta = norm(omega)
    return _dual_quadratic(
        v,
        omega,
        (HALF_ANGLE_VERSINE(theta), SINE_DEFECT(theta)),
        (VERSINE_RATE(theta), SINE_DEFECT_RATE(theta)),
    )


def dexp_right_se3(x: Matrix) -> Matrix:
    """Right-trivialized differential of exp on SE(3), `dexp_left_se3(-x)`.

    The matrix maps the rate x' to the body twist: `exp(-hat x) d/dt exp(hat x) = hat(dexp_right(x)
    x')`. The domain, the result and the errors are the same as for `dexp_left_se3`.
    """
    return dexp_left_se3(-x)


def dexp_left_inverse_se3(x: Matrix) -> Matrix:
    """Inverse of `dexp_left_se3`: maps the spatial twist to the rate of x.

    Equals the sum of `B_k ad(x)^k / k!` with the Bernoulli numbers B_k (B_1 = -1/2). The
    off-diagonal block is the derivative of `dexp_left_inverse_so3(omega)` in direction v.

    Args:
        x: (6, 1) twist (v, omega), meter and radian. omega = 0 is allowed for numbers; for symbols,
            see the module.

    Returns:
        (6, 6) matrix on twists (v, omega).

    Raises:
        ValueError: The shape is not (6, 1), or |omega| is an exact positive multiple of 2 pi, where
            no inverse exists. If |omega| is a floating-point number near such a multiple, the
            matrix has large entries instead.

    Source: Mueller, section 2.
    """
    v, omega = halves(x)
    theta = norm(omega)
    return _dual_quadratic(v, omega, (-S.Half, COTANGENT(theta)), (S.Zero, COTANGENT_RATE(theta)))


def dexp_right_inverse_se3(x: Matrix) -> Matrix:
    """Inverse of `dexp_right_se3`, equal to `dexp_left_inverse_se3(-x)`.

    The function maps the body twist to the rate of x.

    The domain, the result and the errors are the same as for `dexp_left_inverse_se3`.
    """
    return dexp_left_inverse_se3(-x)


def quadratic(omega: Matrix, a: Expr, b: Expr, c: Expr) -> Matrix:
    """Return the matrix a I + b W + c W^2 with W = hat(omega)."""
    W = hat_so3(omega)
    return a * eye(3) + b * W + c * (W * W)


def _dual_quadratic(
    v: Matrix, omega: Matrix, coefficients: tuple[Expr, Expr], rates: tuple[Expr, Expr]
) -> Matrix:
    """Return [[J, Q], [0, J]], with J = I + b W + c W^2 and Q the derivative of J in direction v.

    `rates` contains b'(t)/t and c'(t)/t at t = |omega|; the rate of t is omega.v / t.
    """
    b, c = coefficients
    P, W = hat_so3(v), hat_so3(omega)
    turn = omega.dot(v)
    Q = b * P + c * (W * P + P * W) + turn * (rates[0] * W + rates[1] * (W * W))
    return triangular(quadratic(omega, S.One, b, c), Q)
