"""Coefficients of exp, dexp and dexp^-1: even functions of the angle that are 0/0 at zero.

If the angle is exactly 0, the coefficient is its limit. For a `Float` angle below one radian, the
coefficient is computed by its Taylor series. A symbolic angle is assumed to be neither zero nor a
multiple of 2 pi.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sympy import Expr, Float, Integer, bernoulli, cos, factorial, sin

from chasles.derive.terms.lie import is_zero


@dataclass(frozen=True)
class _Coefficient:
    """An even function of the angle theta, as a closed form and as a Taylor series in theta^2.

    Attributes:
        closed: The closed form of the function for nonzero angles.
        taylor: Taylor coefficients of the function, for theta^(2k) with k = 0, 1, ...
    """

    closed: Callable[[Expr], Expr]
    taylor: Callable[[int], Expr]

    def __call__(self, theta: Expr) -> Expr:
        """Return the value of the function at theta.

        The value at 0 is the limit.
        """
        if is_zero(theta):
            return self.taylor(0)
        if isinstance(theta, Float) and abs(theta) < 1:
            return self._series(theta**2)
        return self.closed(theta)

    def _series(self, square: Float) -> Expr:
        """Evaluate the Taylor series until a term no longer changes the sum."""
        total, power, k = Float(self.taylor(0), precision=square._prec), square, 1
        while (longer := total + self.taylor(k) * power) != total:
            total, power, k = longer, power * square, k + 1
        return total


def _rate(closed: Callable[[Expr], Expr], base: Callable[[int], Expr]) -> _Coefficient:
    """Return the coefficient f'(theta)/theta of a function f."""
    return _Coefficient(closed, lambda k: 2 * (k + 1) * base(k + 1))


def _alternating(shift: int) -> Callable[[int], Expr]:
    """Taylor coefficients (-1)^k / (2k + shift)!."""
    return lambda k: Integer(-1) ** k / factorial(2 * k + shift)


def _bernoulli(k: int) -> Expr:
    """Taylor coefficients |B_(2k+2)| / (2k + 2)!, with convergence radius 2 pi."""
    return abs(bernoulli(2 * k + 2)) / factorial(2 * k + 2)


def _one_minus_cos(theta: Expr) -> Expr:
    """Return 1 - cos(theta).

    For a symbolic theta, the result is 2 sin(theta/2)^2, which is accurate near zero.
    """
    return 1 - cos(theta) if theta.is_number else 2 * sin(theta / 2) ** 2


def _cotangent(theta: Expr) -> Expr:
    """The function (1 - theta/2 cot(theta/2)) / theta^2 of an angle theta."""
    half = theta / 2
    if is_zero(sin(half)):
        msg = f"dexp has no inverse at |omega| = {theta}: expected no positive multiple of 2 pi"
        raise ValueError(msg)
    return (1 - half * cos(half) / sin(half)) / theta**2


# The coefficients sin(t)/t and (1 - cos t)/t^2 of the rotation by an angle t.
SINC = _Coefficient(lambda t: sin(t) / t, _alternating(1))
VERSINE = _Coefficient(lambda t: (1 - cos(t)) / t**2, _alternating(2))
# The coefficients (1 - cos t)/t^2 and (t - sin t)/t^3 of dexp at an angle t.
HALF_ANGLE_VERSINE = _Coefficient(lambda t: _one_minus_cos(t) / t**2, _alternating(2))
SINE_DEFECT = _Coefficient(lambda t: (1 - sin(t) / t) / t**2, _alternating(3))
# The coefficient (1 - t/2 cot(t/2))/t^2 of the inverse of dexp at an angle t.
COTANGENT = _Coefficient(_cotangent, _bernoulli)
VERSINE_RATE = _rate(
    lambda t: (SINC.closed(t) - 2 * HALF_ANGLE_VERSINE.closed(t)) / t**2, _alternating(2)
)
SINE_DEFECT_RATE = _rate(
    lambda t: (HALF_ANGLE_VERSINE.closed(t) - 3 * SINE_DEFECT.closed(t)) / t**2, _alternating(3)
)
COTANGENT_RATE = _rate(
    lambda t: (1 / (2 * _one_minus_cos(t)) - 1 / t**2 - COTANGENT.closed(t)) / t**2, _bernoulli
)
