"""Closed-form functions of SymPy matrices for poses, adjoint matrices and screw axes.

Conventions. A twist is the column (v, omega), with the linear part first, as in Murray, Li and
Sastry. `T_a_b` is the pose of frame b in frame a, a 4x4 matrix [[R, p], [0, 1]]. Lengths are in
meters and angles in radians. `swap_twist_order` converts to and from the order (omega, v).

Exactness. Exact numbers lead to exact results, and symbols lead to expressions. No result is
simplified. If a matrix contains a `Float`, each number of the matrix is converted to a `Float` with
the highest precision in the matrix. If SymPy cannot decide whether an exact number is zero, a
ValueError names the number.

Source:
    R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, 1994.
"""

from typing import TypeAlias

from mpmath.libmp import prec_to_dps
from sympy import Abs, Expr, Float, ImmutableDenseMatrix, S, sqrt, zeros

from ..model.tolerances import UNIT_VECTOR

__all__ = [
    "Matrix",
    "adjoint",
    "checked",
    "hat_so3",
    "inverse_se3",
    "is_zero",
    "norm",
    "pose",
    "require_unit",
    "rotation",
    "screw_axis",
    "stack",
    "swap_twist_order",
    "translation",
    "triangular",
    "twist",
]

Matrix: TypeAlias = ImmutableDenseMatrix


def hat_so3(omega: Matrix) -> Matrix:
    """Return the skew-symmetric matrix of a vector.

    `hat_so3(a) b` is the cross product a x b.

    Args:
        omega: (3, 1) vector.

    Returns:
        (3, 3) element of so(3), in the frame and unit of `omega`.

    Raises:
        ValueError: The shape of `omega` is not (3, 1).

    Source: Murray, Li and Sastry, chapter 2, section 2.
    """
    x, y, z = checked(omega, (3, 1), "omega")
    return Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def swap_twist_order(twists: Matrix) -> Matrix:
    """Convert twists from (v, omega) to (omega, v), or back.

    The argument may also be an operator on twists, such as `adjoint(T)`. To convert an operator A,
    swap both its rows and its columns: `swap_twist_order(swap_twist_order(A).T).T`.

    Args:
        twists: (6, n) matrix, one twist in each column, such as a Jacobian.

    Returns:
        (6, n) matrix with the upper and lower three rows exchanged.

    Raises:
        ValueError: The number of rows of `twists` is not six.
    """
    twists = checked(twists, (6, twists.cols), "twists")
    return twist(twists[3:, :], twists[:3, :])


def pose(R: Matrix, p: Matrix) -> Matrix:
    """Return the pose [[R, p], [0, 1]] of a rotation and a translation.

    Args:
        R: (3, 3) rotation of frame b in frame a.
        p: (3, 1) origin of b in a, meter.

    Returns:
        (4, 4) pose `T_a_b`.

    Raises:
        ValueError: The shape of `R` or `p` is wrong.
    """
    return stack(checked(R, (3, 3), "R"), checked(p, (3, 1), "p"), 1)


def rotation(T: Matrix) -> Matrix:
    """Return the rotation of a pose.

    Args:
        T: (4, 4) pose `T_a_b`.

    Returns:
        (3, 3) rotation `R_a_b`.

    Raises:
        ValueError: The shape is not (4, 4).
    """
    return checked(T, (4, 4), "T")[:3, :3]


def translation(T: Matrix) -> Matrix:
    """Return the translation of a pose.

    Args:
        T: (4, 4) pose `T_a_b`.

    Returns:
        (3, 1) origin of b in a, meter.

    Raises:
        ValueError: The shape is not (4, 4).
    """
    return checked(T, (4, 4), "T")[:3, 3]


def inverse_se3(T: Matrix) -> Matrix:
    """Return the inverse [[R', -R' p], [0, 1]] of a pose, with `inverse_se3(T_a_b) = T_b_a`.

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


def adjoint(T: Matrix) -> Matrix:
    """Return the adjoint Ad = [[R, hat(p) R], [0, R]] from twists of frame b to frame a.

    `T hat(x) T^-1 = hat(Ad x)`, and the adjoint of a product of poses is the product of the
    adjoints. The inverse of the adjoint matrix is `adjoint(inverse_se3(T))`.

    Args:
        T: (4, 4) pose `T_a_b`.

    Returns:
        (6, 6) matrix on twists (v, omega).

    Raises:
        ValueError: The shape is not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 4.
    """
    R = rotation(T)
    return triangular(R, hat_so3(translation(T)) * R)


def screw_axis(direction: Matrix, point: Matrix, pitch: Expr = S.Zero) -> Matrix:
    """Return the unit twist of a screw: v = point x direction + pitch direction, omega = direction.

    Args:
        direction: (3, 1) unit vector along the axis. The function assumes that a symbolic direction
            has length 1.
        point: (3, 1) any point of the axis, meter, in the same frame.
        pitch: Translation per angle, meter per radian. The pitch of a revolute joint is 0. The
            pitch of a prismatic joint is `sympy.oo`, with the twist (direction, 0).

    Returns:
        (6, 1) twist (v, omega) of unit speed, in the frame of `direction`.

    Raises:
        ValueError: The shape of `direction` or `point` is wrong, or the length of a numerical
            `direction` is not 1.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    direction = checked(direction, (3, 1), "direction")
    point = checked(point, (3, 1), "point")
    require_unit(direction, "direction")
    if pitch == S.Infinity:
        return twist(direction, zeros(3, 1))
    return twist(point.cross(direction) + pitch * direction, direction)


# --- helpers --------------------------------------------------------------------------------------


def norm(a: Matrix) -> Expr:
    """Return the length of a vector.

    If the length is the magnitude |e| of a symbolic expression e, the function returns e. The sign
    of e has no effect, because the results of all functions in this module are the same for lengths
    e and -e.
    """
    square = sum((e**2 for e in a), S.Zero)
    length = sqrt(square)
    unsigned = length.replace(Abs, lambda e: e)
    return unsigned if unsigned**2 == square else length


def is_zero(e: Expr) -> bool:
    """Whether an expression is exactly zero, or False for symbols if SymPy cannot decide."""
    if e.is_zero is not None:
        return bool(e.is_zero)
    if not e.is_number:
        return False
    decided = e.equals(0)
    if decided is None:
        msg = f"cannot decide whether {e} is zero: expected a simpler exact number, or a Float"
        raise ValueError(msg)
    return bool(decided)


def require_unit(a: Matrix, name: str) -> None:
    """Raise ValueError if a numerical vector does not have unit length."""
    excess = a.dot(a) - 1
    if not excess.is_number:
        return
    if abs(excess) > UNIT_VECTOR if excess.has(Float) else not is_zero(excess):
        msg = f"{name} is {a.T.tolist()[0]}, of length {norm(a)}: expected a unit vector"
        raise ValueError(msg)


def checked(M: Matrix, shape: tuple[int, int], name: str) -> Matrix:
    """Return M as an immutable matrix of a given shape.

    If one number of M is a Float, all numbers of M become Floats.
    """
    if M.shape != shape:
        msg = f"{name} has shape {M.shape}: expected {shape}"
        raise ValueError(msg)
    floats = M.atoms(Float)
    if floats:
        digits = max(prec_to_dps(e._prec) for e in floats)
        M = M.applyfunc(lambda e: e.evalf(digits) if e.is_number else e)
    return Matrix(M)


def twist(v: Matrix, omega: Matrix) -> Matrix:
    """Return the twist column (v, omega)."""
    return Matrix.vstack(Matrix(v), Matrix(omega))


def stack(A: Matrix, b: Matrix, last: int) -> Matrix:
    """Return the matrix [[A, b], [0, last]]."""
    return Matrix.vstack(Matrix.hstack(A, b), Matrix([[0, 0, 0, last]]))


def triangular(A: Matrix, B: Matrix) -> Matrix:
    """Return the matrix [[A, B], [0, A]]."""
    return Matrix([[A, B], [zeros(3, 3), A]])
