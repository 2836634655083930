"""The Lie algebras so(3) and se(3): hat, vee, and the bracket of twists (v, omega)."""

from chasles.derive.terms.lie import Matrix, checked, hat_so3, stack, triangular, twist


def vee_so3(W: Matrix) -> Matrix:
    """Return the vector of a skew-symmetric matrix: `vee_so3(hat_so3(a)) = a`.

    Args:
        W: (3, 3) element of so(3). Skew symmetry is assumed: only the entries (2, 1), (0, 2) and
            (1, 0) are read.

    Returns:
        (3, 1) vector, in the frame and unit of `W`.

    Raises:
        ValueError: The shape is not (3, 3).
    """
    W = checked(W, (3, 3), "W")
    return Matrix([W[2, 1], W[0, 2], W[1, 0]])


def hat_se3(x: Matrix) -> Matrix:
    """Matrix [[hat(omega), v], [0, 0]] of a twist (v, omega).

    Args:
        x: (6, 1) twist (v, omega).

    Returns:
        (4, 4) element of se(3), in the frame of `x`.

    Raises:
        ValueError: The argument does not have the shape (6, 1).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    v, omega = halves(x)
    return stack(hat_so3(omega), v, 0)


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
    X = checked(X, (4, 4), "X")
    return twist(X[:3, 3], vee_so3(X[:3, :3]))


def ad(x: Matrix) -> Matrix:
    """Return the adjoint matrix of a twist: `ad(x) y` is the Lie bracket of the twists x and y.

    For x = (v, omega), the matrix is [[hat(omega), hat(v)], [0, hat(omega)]].

    `hat(ad(x) y) = hat(x) hat(y) - hat(y) hat(x)`, and `Ad(exp x) = exp(ad x)`.

    Args:
        x: (6, 1) twist (v, omega).

    Returns:
        (6, 6) matrix on twists (v, omega), in the frame of `x`.

    Raises:
        ValueError: The argument does not have the shape (6, 1).
    """
    v, omega = halves(x)
    return triangular(hat_so3(omega), hat_so3(v))


def halves(x: Matrix) -> tuple[Matrix, Matrix]:
    """Return the parts v and omega of a twist."""
    x = checked(x, (6, 1), "twist")
    return x[:3, :], x[3:, :]
