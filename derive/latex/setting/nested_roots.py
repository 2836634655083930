r"""Prints numbers with nested roots as multiples of a sine or cosine.

An example of such a multiple is ``0.25 \sin 12^\circ``. SymPy evaluates the cosine and sine of many
constant angles to nested roots. Readers cannot recognize an angle in nested roots.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import product

import mpmath
import sympy as sp

from ...model.exact import is_zero
from ...model.tolerances import WORKING_DIGITS
from ...model.values import Values
from .printer import number

STEPS = 30
"""Number of angles whose cosines and sines are recognized, which are the multiples of 1.5 degrees
up to 45 degrees."""
DIGITS = 50
LARGEST_DENOMINATOR = 10**7
MINUTES = 180 * 60
_FUNCTIONS = {"sin": sp.sin, "cos": sp.cos}
SMALL = Fraction(1, 10**40)


def is_nested(value: sp.Expr) -> bool:
    """Whether a number contains a root of a root."""
    return any(power.base.has(sp.Pow) for power in value.atoms(sp.Pow))


def as_angle(value: sp.Expr) -> str:
    """Format an angle as a multiple of pi, or return "" if it is no multiple of an arc minute."""
    with mpmath.workdps(DIGITS):
        minutes = mpmath.nint(Values().of(value) * MINUTES / mpmath.pi)
    factor = sp.Rational(int(minutes), MINUTES)
    return number(factor * sp.pi) if factor and is_zero(value - factor * sp.pi) else ""


def as_trigonometric(value: sp.Expr) -> str:
    """Format a number as a multiple of a sine or cosine, or return "" if that is impossible.

    The factor of the sine or cosine must be a rational multiple of 1, sqrt(2) or sqrt(3).
    """
    factor, function = value.as_coeff_Mul()
    if isinstance(function, sp.cos | sp.sin):
        degrees = 180 * function.args[0] / sp.pi
        return _product(factor, type(function).__name__, degrees) if degrees.is_Rational else ""
    if is_nested(value):
        return _recognized(value, (1, 2, 3))
    # A sum such as 0.25 + sqrt(5)/4 is the cosine of 36 degrees.
    return _recognized(value, (1,)) if value.is_Add else ""


def _recognized(value: sp.Expr, roots: Sequence[int]) -> str:
    digits = _fraction(Values().of(value))
    found = []
    for (root, step, name), size in _sizes().items():
        ratio = digits / size
        part = ratio.limit_denominator(LARGEST_DENOMINATOR)
        if root not in roots or abs(ratio - part) > SMALL * abs(ratio):
            continue
        factor = sp.Rational(part.numerator, part.denominator)
        exact = factor * sp.sqrt(root) * _FUNCTIONS[name](step * sp.pi / (4 * STEPS))
        if is_zero(value - exact):
            found.append((root, part.denominator, abs(part.numerator), step, name, factor))
    if not found:
        return ""
    root, *_, step, name, factor = min(found)
    return _product(factor * sp.sqrt(root), name, sp.Rational(3 * step, 2))


@cache
def _sizes() -> dict[tuple[int, int, str], Fraction]:
    with mpmath.workdps(WORKING_DIGITS):
        return {
            (root, step, name): _fraction(
                mpmath.sqrt(root) * getattr(mpmath, name)(step * mpmath.pi / (4 * STEPS))
            )
            for root, step, name in product((1, 2, 3), range(1, STEPS), _FUNCTIONS)
        }


def _fraction(value: mpmath.mpf) -> Fraction:
    return Fraction(mpmath.nstr(value, DIGITS))


def _product(factor: sp.Expr, name: str, degrees: sp.Rational) -> str:
    times = {1: "", -1: "-"}.get(factor, f"{number(factor)} ")
    return rf"{times}\{name} {number(degrees)}^\circ"
