"""The Lie groups SO(3) and SE(3) and their algebras, in closed form on SymPy matrices.

Conventions. A twist is the column (v, omega), linear part first, as in Murray, Li and Sastry.
`T_a_b` is the pose of frame b in frame a, a 4x4 matrix [[R, p], [0, 1]]. Lengths are in metres and
angles in radians. `swap_twist_order` converts to and from the order (omega, v).

Exactness. Matrices of exact numbers give exact numbers, matrices of symbols give expressions, and
no result is passed through `simplify`. A number takes the branch it belongs to: an exact zero takes
the limit, a `Float` angle below one radian takes the Taylor series. One `Float` makes every number
of its matrix a `Float`, at the precision of the most precise one. An exact number has to be one
whose vanishing SymPy can decide; otherwise a ValueError names it.

Symbols. A symbolic angle is taken to be neither zero nor a multiple of 2 pi, and symbols are taken
to be real. The expressions hold only +, *, **, sin, cos, sqrt and atan2, so that they can be
lowered to C as they stand. In float64 exp and the SO(3) `dexp` then keep their digits at every
angle other than zero, where they are 0/0; the off-diagonal block of the SE(3) `dexp` and of its
inverse loses them as the machine epsilon over the angle, and log as the epsilon over the distance
to a half turn. Joints go through `exp_screw`, which has no such place.

Sources:
    R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, 1994.
    A. Mueller, Review of the exponential and Cayley map on SE(3), Proc. R. Soc. A 477, 2021,
    section 2, for dexp, its inverse and their directional derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from mpmath.libmp import prec_to_dps
from sympy import (
    Abs,
    Expr,
    Float,
    ImmutableDenseMatrix,
    Integer,
    Rational,
    S,
    atan2,
    bernoulli,
    cos,
    eye,
    factorial,
    pi,
    sin,
    sqrt,
    zeros,
)

__all__ = [
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

Matrix: TypeAlias = ImmutableDenseMatrix

# A Float axis is a unit axis if its squared length is this close to one; an exact one has to be.
UNIT_TOLERANCE = Float("1e-12")


# --- hat and vee ----------------------------------------------------------------------------------


def hat_so3(omega: Matrix) -> Matrix:
    """Skew-symmetric matrix of a vector: `hat_so3(a) b` is the cross product of a and b.

    Args:
        omega: (3, 1) vector.

    Returns:
        (3, 3) element of so(3), in the frame and unit of `omega`.

    Raises:
        ValueError: The shape is not (3, 1).

    Source: Murray, Li and Sastry, chapter 2, section 2.
    """
    x, y, z = _checked(omega, (3, 1), "omega")
    return Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def vee_so3(W: Matrix) -> Matrix:
    """Vector of a skew-symmetric matrix: `vee_so3(hat_so3(a)) = a`.

    Args:
        W: (3, 3) element of so(3). Skew symmetry is assumed: only the entries (2, 1), (0, 2) and
            (1, 0) are read.

    Returns:
        (3, 1) vector, in the frame and unit of `W`.

    Raises:
        ValueError: The shape is not (3, 3).
    """
    W = _checked(W, (3, 3), "W")
    return Matrix([W[2, 1], W[0, 2], W[1, 0]])


def hat_se3(x: Matrix) -> Matrix:
    """Matrix [[hat(omega), v], [0, 0]] of a twist.

    Args:
        x: (6, 1) twist (v, omega).

    Returns:
        (4, 4) element of se(3), in the frame of `x`.

    Raises:
        ValueError: The shape is not (6, 1).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    v, omega = _halves(x)
    return _stack(hat_so3(omega), v, 0)


def vee_se3(X: Matrix) -> Matrix:
    """Twist of a matrix of se(3): `vee_se3(hat_se3(x)) = x`.

    Args:
        X: (4, 4) element of se(3). Skew symmetry and the zero last row are assumed.

    Returns:
        (6, 1) twist (v, omega), in the frame of `X`.

    Raises:
        ValueError: The shape is not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    X = _checked(X, (4, 4), "X")
    return _twist(X[:3, 3], vee_so3(X[:3, :3]))


def swap_twist_order(twists: Matrix) -> Matrix:
    """Twists (v, omega) as (omega, v), or back: the permutation is its own inverse.

    An operator on twists, such as `adjoint(T)`, changes order on both sides:
    `swap_twist_order(swap_twist_order(A).T).T`.

    Args:
        twists: (6, n) matrix, one twist in each column, such as a Jacobian.

    Returns:
        (6, n) matrix with the upper and lower three rows exchanged.

    Raises:
        ValueError: There are not six rows.
    """
    twists = _checked(twists, (6, twists.cols), "twists")
    return _twist(twists[3:, :], twists[:3, :])


# --- poses ----------------------------------------------------------------------------------------


def pose(R: Matrix, p: Matrix) -> Matrix:
    """Pose [[R, p], [0, 1]] of a rotation and a translation.

    Args:
        R: (3, 3) rotation, frame b seen from frame a.
        p: (3, 1) origin of b in a, metre.

    Returns:
        (4, 4) pose `T_a_b`.

    Raises:
        ValueError: A shape is wrong.
    """
    return _stack(_checked(R, (3, 3), "R"), _checked(p, (3, 1), "p"), 1)


def rotation(T: Matrix) -> Matrix:
    """Rotation of a pose.

    Args:
        T: (4, 4) pose `T_a_b`.

    Returns:
        (3, 3) rotation `R_a_b`.

    Raises:
        ValueError: The shape is not (4, 4).
    """
    return _checked(T, (4, 4), "T")[:3, :3]


def translation(T: Matrix) -> Matrix:
    """Translation of a pose.

    Args:
        T: (4, 4) pose `T_a_b`.

    Returns:
        (3, 1) origin of b in a, metre.

    Raises:
        ValueError: The shape is not (4, 4).
    """
    return _checked(T, (4, 4), "T")[:3, 3]


def inverse_se3(T: Matrix) -> Matrix:
    """Inverse [[R', -R' p], [0, 1]] of a pose: `inverse_se3(T_a_b) = T_b_a`.

    Args:
        T: (4, 4) pose `T_a_b`.

    Returns:
        (4, 4) pose `T_b_a`.

    Raises:
        ValueError: The shape is not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    R, p = rotation(T), translation(T)
    return pose(R.T, -R.T * p)


# --- adjoint representations ----------------------------------------------------------------------


def adjoint(T: Matrix) -> Matrix:
    """Adjoint Ad = [[R, hat(p) R], [0, R]] of a pose: takes twists of frame b to frame a.

    `T hat(x) T^-1 = hat(Ad x)`, and Ad of a product is the product of the Ad. Its inverse is
    `adjoint(inverse_se3(T))`.

    Args:
        T: (4, 4) pose `T_a_b`.

    Returns:
        (6, 6) matrix on twists (v, omega).

    Raises:
        ValueError: The shape is not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 4.
    """
    R = rotation(T)
    return _triangular(R, hat_so3(translation(T)) * R)


def ad(x: Matrix) -> Matrix:
    """Adjoint ad = [[hat(omega), hat(v)], [0, hat(omega)]] of a twist: `ad(x) y` is the bracket.

    `hat(ad(x) y) = hat(x) hat(y) - hat(y) hat(x)`, and `Ad(exp x) = exp(ad x)`.

    Args:
        x: (6, 1) twist (v, omega).

    Returns:
        (6, 6) matrix on twists (v, omega), in the frame of `x`.

    Raises:
        ValueError: The shape is not (6, 1).
    """
    v, omega = _halves(x)
    return _triangular(hat_so3(omega), hat_so3(v))


# --- the exponential and the logarithm ------------------------------------------------------------


def exp_so3(omega: Matrix) -> Matrix:
    """Rotation about the direction of a vector by its length.

    `exp_so3(omega) = I + sin(t)/t W + (1 - cos t)/t^2 W^2`, with W = hat(omega) and t = |omega|.

    Args:
        omega: (3, 1) rotation vector, radian. Zero is allowed for numbers; symbols: see the module.

    Returns:
        (3, 3) rotation.

    Raises:
        ValueError: The shape is not (3, 1).

    Source: Murray, Li and Sastry, chapter 2, section 2, Rodrigues' formula.
    """
    omega = _checked(omega, (3, 1), "omega")
    theta = _norm(omega)
    return _quadratic(omega, S.One, SINC(theta), VERSINE(theta))


def log_so3(R: Matrix) -> Matrix:
    """Rotation vector of a rotation, of length at most pi: `exp_so3(log_so3(R)) = R`.

    The angle is `atan2(s, c)` with s = |vee(R - R')| / 2 and c = (trace R - 1) / 2. A `Float`
    matrix with c < 0 has its axis from the symmetric part of R, which keeps its digits near a half
    turn. At a half turn (s is zero; for Floats, zero to rounding) the axis and its opposite are
    equally good: the one whose first nonzero component is positive is returned.

    Symbols are assumed to stand for a rotation that is neither the identity nor a half turn. For a
    rotation about a fixed axis the result is then regular again: the logarithm of a rotation about
    z by q is (0, 0, atan2(sin q, cos q)).

    Args:
        R: (3, 3) rotation. Orthogonality is assumed.

    Returns:
        (3, 1) rotation vector, radian, in either of the two frames (the axis is the same in both).

    Raises:
        ValueError: The shape is not (3, 3).

    Source: Murray, Li and Sastry, chapter 2, section 2, with atan2 for acos.
    """
    return _rotation_vector(_checked(R, (3, 3), "R"))[0]


def exp_se3(x: Matrix) -> Matrix:
    """Pose reached by following a constant twist for unit time.

    `exp_se3(v, omega) = [[exp_so3(omega), dexp_left_so3(omega) v], [0, 1]]`.

    Args:
        x: (6, 1) twist (v, omega), metre and radian. omega = 0 is allowed for numbers; symbols: see
            the module. For a screw axis times a joint variable use `exp_screw`.

    Returns:
        (4, 4) pose.

    Raises:
        ValueError: The shape is not (6, 1).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    v, omega = _halves(x)
    return pose(exp_so3(omega), dexp_left_so3(omega) * v)


def log_se3(T: Matrix) -> Matrix:
    """Twist of a pose, with |omega| at most pi: `exp_se3(log_se3(T)) = T`.

    `omega = log_so3(R)` and `v = dexp_left_inverse_so3(omega) p`. Half turns and symbols are
    treated as in `log_so3`.

    Args:
        T: (4, 4) pose. Orthogonality of its rotation is assumed.

    Returns:
        (6, 1) twist (v, omega), metre and radian.

    Raises:
        ValueError: The shape is not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    T = _checked(T, (4, 4), "T")
    omega, theta = _rotation_vector(rotation(T))
    V_inverse = _quadratic(omega, S.One, -S.Half, COTANGENT(theta))
    return _twist(V_inverse * translation(T), omega)


# --- screws ---------------------------------------------------------------------------------------


def screw_axis(direction: Matrix, point: Matrix, pitch: Expr = S.Zero) -> Matrix:
    """Unit twist of a screw: v = point x direction + pitch direction, omega = direction.

    Args:
        direction: (3, 1) unit vector along the axis; symbols are taken to be of unit length.
        point: (3, 1) any point of the axis, metre, in the same frame.
        pitch: Advance per turned angle, metre per radian: 0 for a revolute joint, `sympy.oo` for a
            prismatic one, whose twist is (direction, 0).

    Returns:
        (6, 1) twist (v, omega) of unit speed, in the frame of `direction`.

    Raises:
        ValueError: A shape is wrong, or `direction` is a number vector that is not of unit length.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    direction = _checked(direction, (3, 1), "direction")
    point = _checked(point, (3, 1), "point")
    _require_unit(direction, "direction")
    if pitch == S.Infinity:
        return _twist(direction, zeros(3, 1))
    return _twist(point.cross(direction) + pitch * direction, direction)


def exp_screw(screw: Matrix, theta: Expr) -> Matrix:
    """Pose of a joint: the exponential of a unit screw times the joint variable.

    Equals `exp_se3(screw * theta)`, written for a unit axis a and pitch h = a.v:
    `R = a a' + cos(theta) (I - a a') + sin(theta) hat(a)` and
    `p = sin(theta) (v - h a) + (1 - cos(theta)) (a x v) + theta h a`; for a prismatic joint R = I
    and `p = theta v`.
    There is no degenerate angle, and what is structurally zero does not appear: constants are
    expanded, never simplified.

    Args:
        screw: (6, 1) twist (v, omega), with omega of unit length (revolute, helical), or zero
            (prismatic). Symbols in omega are taken to be of unit length.
        theta: Joint variable: radian, or metre where omega is zero and v of unit length.

    Returns:
        (4, 4) pose.

    Raises:
        ValueError: The shape is wrong, or omega is a number vector of a length other than 0 and 1.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    v, axis = _halves(screw)
    if all(_is_zero(e) for e in axis):
        return pose(eye(3), theta * v)
    _require_unit(axis, "omega of the screw")
    along = (axis * axis.T).expand()
    R = along + cos(theta) * (eye(3) - along) + sin(theta) * hat_so3(axis)
    pitch = axis.dot(v).expand()
    across = (v - pitch * axis).expand()
    radial = axis.cross(v).expand()
    p = sin(theta) * across + (1 - cos(theta)) * radial + theta * pitch * axis
    return pose(R, p)


# --- the differential of the exponential ----------------------------------------------------------


def dexp_left_so3(omega: Matrix) -> Matrix:
    """Left-trivialised differential of exp on SO(3).

    `d/dt exp(hat x) exp(-hat x) = hat(dexp_left(x) x')`: takes the rate of a rotation vector to the
    angular velocity in the fixed frame. Equals the sum of `hat(x)^k / (k + 1)!`,
    `I + (1 - cos t)/t^2 W + (t - sin t)/t^3 W^2`, and `exp(hat x) dexp_right(x)`. Singular at
    |omega| = 2 pi k, k > 0.

    Args:
        omega: (3, 1) rotation vector, radian. Zero is allowed for numbers; symbols: see the module.

    Returns:
        (3, 3) matrix, without unit.

    Raises:
        ValueError: The shape is not (3, 1).

    Source: Mueller, section 2.
    """
    omega = _checked(omega, (3, 1), "omega")
    theta = _norm(omega)
    return _quadratic(omega, S.One, HALF_ANGLE_VERSINE(theta), SINE_DEFECT(theta))


def dexp_right_so3(omega: Matrix) -> Matrix:
    """Right-trivialised differential of exp on SO(3), `dexp_left_so3(-omega)`.

    `exp(-hat x) d/dt exp(hat x) = hat(dexp_right(x) x')`: takes the rate of a rotation vector to
    the angular velocity in the moving frame. Domain, result and errors as for `dexp_left_so3`.
    """
    return dexp_left_so3(-omega)


def dexp_left_inverse_so3(omega: Matrix) -> Matrix:
    """Inverse of `dexp_left_so3`: angular velocity in the fixed frame to rate of rotation vector.

    `I - W/2 + (1 - t/2 cot(t/2))/t^2 W^2`, with W = hat(omega) and t = |omega|.

    Args:
        omega: (3, 1) rotation vector, radian. Zero is allowed for numbers; symbols: see the module.

    Returns:
        (3, 3) matrix, without unit.

    Raises:
        ValueError: The shape is not (3, 1), or |omega| is a positive multiple of 2 pi, where there
            is no inverse (detected for exact numbers; a Float nearby gives large numbers).

    Source: Mueller, section 2.
    """
    omega = _checked(omega, (3, 1), "omega")
    return _quadratic(omega, S.One, -S.Half, COTANGENT(_norm(omega)))


def dexp_right_inverse_so3(omega: Matrix) -> Matrix:
    """Inverse of `dexp_right_so3`, `dexp_left_inverse_so3(-omega)`.

    Takes the angular velocity in the moving frame to the rate of the rotation vector. Domain,
    result and errors as for `dexp_left_inverse_so3`.
    """
    return dexp_left_inverse_so3(-omega)


def dexp_left_se3(x: Matrix) -> Matrix:
    """Left-trivialised differential of exp on SE(3), [[J, Q], [0, J]], with J of SO(3).

    `d/dt exp(hat x) exp(-hat x) = hat(dexp_left(x) x')`: takes the rate of x to the spatial twist.
    Equals the sum of `ad(x)^k / (k + 1)!` and `Ad(exp x) dexp_right(x)`. Q is the derivative of
    J = `dexp_left_so3(omega)` in direction v. Singular at |omega| = 2 pi k, k > 0.

    Args:
        x: (6, 1) twist (v, omega), metre and radian. omega = 0 is allowed for numbers; symbols: see
            the module.

    Returns:
        (6, 6) matrix on twists (v, omega); Q has the unit of v.

    Raises:
        ValueError: The shape is not (6, 1).

    Source: Mueller, section 2. se(3) is so(3) over the dual numbers omega + eps v, which gives Q in
    five products.
    """
    v, omega = _halves(x)
    theta = _norm(omega)
    return _dual_quadratic(
        v,
        omega,
        (HALF_ANGLE_VERSINE(theta), SINE_DEFECT(theta)),
        (VERSINE_RATE(theta), SINE_DEFECT_RATE(theta)),
    )


def dexp_right_se3(x: Matrix) -> Matrix:
    """Right-trivialised differential of exp on SE(3), `dexp_left_se3(-x)`.

    `exp(-hat x) d/dt exp(hat x) = hat(dexp_right(x) x')`: takes the rate of x to the body twist.
    Domain, result and errors as for `dexp_left_se3`.
    """
    return dexp_left_se3(-x)


def dexp_left_inverse_se3(x: Matrix) -> Matrix:
    """Inverse of `dexp_left_se3`: spatial twist to the rate of x.

    Equals the sum of `B_k ad(x)^k / k!` with the Bernoulli numbers B_k (B_1 = -1/2). The
    off-diagonal block is the derivative of `dexp_left_inverse_so3(omega)` in direction v.

    Args:
        x: (6, 1) twist (v, omega), metre and radian. omega = 0 is allowed for numbers; symbols: see
            the module.

    Returns:
        (6, 6) matrix on twists (v, omega).

    Raises:
        ValueError: The shape is not (6, 1), or |omega| is a positive multiple of 2 pi, where there
            is no inverse (detected for exact numbers; a Float nearby gives large numbers).

    Source: Mueller, section 2.
    """
    v, omega = _halves(x)
    theta = _norm(omega)
    return _dual_quadratic(v, omega, (-S.Half, COTANGENT(theta)), (S.Zero, COTANGENT_RATE(theta)))


def dexp_right_inverse_se3(x: Matrix) -> Matrix:
    """Inverse of `dexp_right_se3`, `dexp_left_inverse_se3(-x)`: body twist to the rate of x.

    Domain, result and errors as for `dexp_left_inverse_se3`.
    """
    return dexp_left_inverse_se3(-x)


# --- coefficients: even functions of the angle that are 0/0 at zero -------------------------------


@dataclass(frozen=True)
class _Coefficient:
    """An even function of the angle: a closed form, and a Taylor series in the angle squared.

    Attributes:
        closed: The function, for angles other than zero.
        taylor: Its Taylor coefficient of theta^(2k), for k = 0, 1, ...
    """

    closed: Callable[[Expr], Expr]
    taylor: Callable[[int], Expr]

    def __call__(self, theta: Expr) -> Expr:
        """Value at theta: the limit at zero, the series for a Float below one radian."""
        if _is_zero(theta):
            return self.taylor(0)
        if isinstance(theta, Float) and abs(theta) < 1:
            return self._series(theta**2)
        return self.closed(theta)

    def _series(self, square: Float) -> Expr:
        """Taylor series, until a term no longer changes the sum."""
        total, power, k = Float(self.taylor(0), precision=square._prec), square, 1
        while (longer := total + self.taylor(k) * power) != total:
            total, power, k = longer, power * square, k + 1
        return total


def _rate(closed: Callable[[Expr], Expr], base: Callable[[int], Expr]) -> _Coefficient:
    """Coefficient f'(theta)/theta of a function f with Taylor coefficients `base`."""
    return _Coefficient(closed, lambda k: 2 * (k + 1) * base(k + 1))


def _alternating(shift: int) -> Callable[[int], Expr]:
    """Taylor coefficients (-1)^k / (2k + shift)!."""
    return lambda k: Integer(-1) ** k / factorial(2 * k + shift)


def _bernoulli(k: int) -> Expr:
    """Taylor coefficients |B_(2k+2)| / (2k + 2)!, of radius 2 pi."""
    return abs(bernoulli(2 * k + 2)) / factorial(2 * k + 2)


def _one_minus_cos(theta: Expr) -> Expr:
    """1 - cos(theta); for a symbol 2 sin(theta/2)^2, which lowered keeps its digits near zero."""
    return 1 - cos(theta) if theta.is_number else 2 * sin(theta / 2) ** 2


def _cotangent(theta: Expr) -> Expr:
    """(1 - theta/2 cot(theta/2)) / theta^2."""
    half = theta / 2
    if _is_zero(sin(half)):
        msg = f"dexp has no inverse at |omega| = {theta}: expected no positive multiple of 2 pi"
        raise ValueError(msg)
    return (1 - half * cos(half) / sin(half)) / theta**2


# sin(t)/t and (1 - cos t)/t^2, the coefficients of the rotation.
SINC = _Coefficient(lambda t: sin(t) / t, _alternating(1))
VERSINE = _Coefficient(lambda t: (1 - cos(t)) / t**2, _alternating(2))
# (1 - cos t)/t^2 again and (t - sin t)/t^3, the coefficients of dexp.
HALF_ANGLE_VERSINE = _Coefficient(lambda t: _one_minus_cos(t) / t**2, _alternating(2))
SINE_DEFECT = _Coefficient(lambda t: (1 - sin(t) / t) / t**2, _alternating(3))
# (1 - t/2 cot(t/2))/t^2, the coefficient of the inverse of dexp.
COTANGENT = _Coefficient(_cotangent, _bernoulli)
# f'(t)/t of the three before: the coefficients of their derivatives in direction v.
VERSINE_RATE = _rate(
    lambda t: (SINC.closed(t) - 2 * HALF_ANGLE_VERSINE.closed(t)) / t**2, _alternating(2)
)
SINE_DEFECT_RATE = _rate(
    lambda t: (HALF_ANGLE_VERSINE.closed(t) - 3 * SINE_DEFECT.closed(t)) / t**2, _alternating(3)
)
COTANGENT_RATE = _rate(
    lambda t: (1 / (2 * _one_minus_cos(t)) - 1 / t**2 - COTANGENT.closed(t)) / t**2, _bernoulli
)


# --- parts ----------------------------------------------------------------------------------------


def _quadratic(omega: Matrix, a: Expr, b: Expr, c: Expr) -> Matrix:
    """The matrix a I + b W + c W^2, W = hat(omega)."""
    W = hat_so3(omega)
    return a * eye(3) + b * W + c * (W * W)


def _dual_quadratic(
    v: Matrix, omega: Matrix, coefficients: tuple[Expr, Expr], rates: tuple[Expr, Expr]
) -> Matrix:
    """[[J, Q], [0, J]], with J = I + b W + c W^2 and Q the derivative of J in direction v.

    `rates` holds b'(t)/t and c'(t)/t at t = |omega|; t changes at the rate omega.v / t.
    """
    b, c = coefficients
    P, W = hat_so3(v), hat_so3(omega)
    turn = omega.dot(v)
    Q = b * P + c * (W * P + P * W) + turn * (rates[0] * W + rates[1] * (W * W))
    return _triangular(_quadratic(omega, S.One, b, c), Q)


def _rotation_vector(R: Matrix) -> tuple[Matrix, Expr]:
    """Rotation vector of a rotation, and its angle (for symbols up to a common sign)."""
    sine_axis = vee_so3(R - R.T) / 2
    sine, cosine = _norm(sine_axis), (R.trace() - 1) / 2
    if not R.is_symbolic():
        if cosine < 0 and (R.has(Float) or _is_zero(sine)):
            return _rotation_vector_near_half_turn(R, sine_axis, sine, cosine)
        if _is_zero(sine):
            return zeros(3, 1).as_immutable(), S.Zero
        theta = atan2(sine, cosine)
    else:
        # Unevaluated: SymPy would write atan where it can prove the cosine positive.
        theta = atan2(sine, cosine, evaluate=False)
    return sine_axis * (theta / sine), theta


def _rotation_vector_near_half_turn(
    R: Matrix, sine_axis: Matrix, sine: Expr, cosine: Expr
) -> tuple[Matrix, Expr]:
    """Rotation vector from the symmetric part cos I + (1 - cos) a a', and its angle."""
    outer = (R + R.T) / 2 - cosine * eye(3)
    column = outer[:, max(range(3), key=lambda k: outer[k, k])]
    axis = column / sqrt(column.dot(column))
    noise = _rounding(R)
    if not R.has(Float) or sine <= noise:
        first = next(e for e in axis if not _is_zero(e) and abs(e) > noise)
        return axis * (pi if first > 0 else -pi), pi
    theta = atan2(sine, cosine)
    return axis * (theta if axis.dot(sine_axis) > 0 else -theta), theta


def _rounding(M: Matrix) -> Expr:
    """What counts as zero beside one: sixteen times the rounding of the Floats, or zero."""
    if not M.has(Float):
        return S.Zero
    return Rational(1, 2 ** (min(e._prec for e in M.atoms(Float)) - 4))


def _norm(a: Matrix) -> Expr:
    """Length of a vector; where that is |e| for a symbolic e, the e itself.

    Only even functions of a length are used here, and they spare the expressions an Abs.
    """
    square = sum((e**2 for e in a), S.Zero)
    length = sqrt(square)
    unsigned = length.replace(Abs, lambda e: e)
    return unsigned if unsigned**2 == square else length


def _is_zero(e: Expr) -> bool:
    """Whether a number is zero, decided exactly; for a symbolic expression what SymPy knows."""
    if e.is_zero is not None:
        return bool(e.is_zero)
    if not e.is_number:
        return False
    decided = e.equals(0)
    if decided is None:
        msg = f"cannot decide whether {e} is zero: expected a simpler exact number, or a Float"
        raise ValueError(msg)
    return bool(decided)


def _require_unit(a: Matrix, name: str) -> None:
    """Raise ValueError if a is a number vector that is not of unit length."""
    excess = a.dot(a) - 1
    if not excess.is_number:
        return
    if abs(excess) > UNIT_TOLERANCE if excess.has(Float) else not _is_zero(excess):
        msg = f"{name} is {a.T.tolist()[0]}, of length {_norm(a)}: expected a unit vector"
        raise ValueError(msg)


def _checked(M: Matrix, shape: tuple[int, int], name: str) -> Matrix:
    """M, immutable, of the expected shape, and with every number a Float if one of them is."""
    if M.shape != shape:
        msg = f"{name} has shape {M.shape}: expected {shape}"
        raise ValueError(msg)
    floats = M.atoms(Float)
    if floats:
        digits = max(prec_to_dps(e._prec) for e in floats)
        M = M.applyfunc(lambda e: e.evalf(digits) if e.is_number else e)
    return Matrix(M)


def _halves(x: Matrix) -> tuple[Matrix, Matrix]:
    """The parts v and omega of a twist."""
    x = _checked(x, (6, 1), "twist")
    return x[:3, :], x[3:, :]


def _twist(v: Matrix, omega: Matrix) -> Matrix:
    """The columns (v, omega)."""
    return Matrix.vstack(Matrix(v), Matrix(omega))


def _stack(A: Matrix, b: Matrix, last: int) -> Matrix:
    """The matrix [[A, b], [0, last]]."""
    return Matrix.vstack(Matrix.hstack(A, b), Matrix([[0, 0, 0, last]]))


def _triangular(A: Matrix, B: Matrix) -> Matrix:
    """The matrix [[A, B], [0, A]]."""
    return Matrix([[A, B], [zeros(3, 3), A]])
