r"""Prints expressions with lengths first and without a leading minus sign where possible.

A sum is represented as a list of signed terms, so that a long sum can be broken between terms.
"""

from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Self

import sympy as sp

from ...model.cleaning import decimal_places
from ...model.exact import is_zero
from ...model.tolerances import GIVEN_DIGITS, PRINTED_DIGITS, RELIABLE_DIGITS
from .notation import ENTRY, LENGTH, OTHER, TERM, Notation, Order
from .shorter import gathered

SMALL = sp.Rational(1, 10**5)
"""Magnitude below which decimals are printed with a power of ten."""
_BINARY = (2, 4, 8)
"""Denominators of fractions with a short decimal form."""
_EXTREMES = {sp.Max: r"\max", sp.Min: r"\min"}
_FUNCTIONS = {sp.cos: r"\cos", sp.sin: r"\sin", sp.tan: r"\tan", sp.atan: r"\arctan"}


class Printer:
    """Prints expressions as LaTeX, with the symbols of a notation.

    Args:
        tex: LaTeX text of each symbol.
        order: Sort key of each symbol among the factors of a product.
        halves: Whether to print fractions such as 1/2 and 3/4 instead of decimals.
    """

    def __init__(
        self,
        tex: Mapping[sp.Symbol, str],
        order: Mapping[sp.Symbol, Order],
        *,
        halves: bool = False,
    ) -> None:
        self._tex, self._order, self._halves = tex, order, halves
        self._printed: dict[sp.Expr, list[str]] = {}

    @classmethod
    def of(cls, notation: Notation) -> Self:
        """Return a printer that uses the symbols of a notation."""
        return cls(notation.tex, notation.order, halves=notation.halves)

    def tex(self, expression: sp.Expr) -> str:
        """Format an expression as LaTeX on one line."""
        return " ".join(self.terms(expression))

    def terms(self, expression: sp.Expr) -> list[str]:
        """Return the signed terms of a sum, with a positive term first if possible."""
        if expression not in self._printed:
            self._printed[expression] = self._terms(gathered(expression))
        return self._printed[expression]

    def _terms(self, expression: sp.Expr) -> list[str]:
        addends = sorted(sp.Add.make_args(expression), key=self._addend_key)
        first = next((k for k, addend in enumerate(addends) if not _is_negative(addend)), 0)
        addends.insert(0, addends.pop(first))
        signed = [(_is_negative(addend), self._product(addend)) for addend in addends]
        head = ("-" if signed[0][0] else "") + signed[0][1]
        return [head] + [("- " if negative else "+ ") + tex for negative, tex in signed[1:]]

    def _product(self, addend: sp.Expr) -> str:
        coefficient, rest = (-addend if _is_negative(addend) else addend).as_coeff_Mul()
        factors = sorted(sp.Mul.make_args(rest), key=self._factor_key) if rest != 1 else []
        plain = [f for f in factors if f.is_number and not (_base(f).is_Function or f.is_Add)]
        # Functions of a symbol, such as cosines, come last in a product. A factor after a cosine
        # would look like a part of its argument.
        others = sorted((f for f in factors if f not in plain), key=_ends_in_argument)
        shown = [self._factor(factor) for factor in others]
        constant = coefficient * sp.Mul(*plain)
        if constant != 1 or not shown:
            shown.insert(0, self._number(constant))
        return " ".join(shown)

    def _number(self, value: sp.Expr) -> str:
        if self._halves and value.is_Rational and value.q in _BINARY:
            return rf"\tfrac{{{value.p}}}{{{value.q}}}"
        return number(value)

    def _factor(self, factor: sp.Expr) -> str:
        if factor.is_Symbol:
            return self._tex[factor]
        if factor.is_Add:
            inner = self.tex(factor)
            left, right = "[]" if "(" in inner else "()"
            return rf"\left{left}{inner}\right{right}" if "frac{" in inner else left + inner + right
        if factor.is_Pow:
            return self._power(factor)
        if isinstance(factor, sp.Abs):
            return f"|{self.tex(factor.args[0])}|"
        inner = ", ".join(self.tex(argument) for argument in factor.args)
        named = _FUNCTIONS | _EXTREMES
        name = named.get(factor.func, rf"\operatorname{{{factor.func.__name__}}}")
        alone = len(factor.args) == 1 and factor.args[0].is_Symbol
        return f"{name} {inner}" if alone else f"{name}({inner})"

    def _power(self, power: sp.Expr) -> str:
        base, exponent = power.args
        if exponent == sp.Rational(1, 2):
            return rf"\sqrt{{{self.tex(base)}}}"
        if exponent.is_negative:
            return rf"\frac{{1}}{{{self.tex(base**-exponent)}}}"
        if isinstance(base, sp.cos | sp.sin) and exponent.is_Integer:
            name = _FUNCTIONS[base.func]
            return self._factor(base).replace(name, f"{name}^{{{exponent}}}", 1)
        return f"{self._factor(base)}^{{{self.tex(exponent)}}}"

    def _addend_key(self, addend: sp.Expr) -> tuple[object, ...]:
        _, rest = addend.as_coeff_Mul()
        keys = tuple(sorted(self._factor_key(factor)[0] for factor in sp.Mul.make_args(rest)))
        lengths = tuple(place for kind, place in keys if kind == LENGTH)
        compound = any(kind in (TERM, ENTRY, OTHER) for kind, _ in keys)
        return (0 if lengths else 1 if compound else 2, lengths[:1], keys)

    def _factor_key(self, factor: sp.Expr) -> tuple[Order, str]:
        base = _base(factor)
        kind, place = self._order.get(base, (OTHER, ()))
        order = kind, tuple(map(_comparable, place))
        if base in self._order:
            return order, ""
        return order, str(factor) if factor.is_number else self._factor(factor)


def _base(factor: sp.Expr) -> sp.Expr:
    """Return the base of a power, or the factor itself."""
    return factor.base if factor.is_Pow else factor


def _ends_in_argument(factor: sp.Expr) -> bool:
    base = _base(factor)
    return base.func in _FUNCTIONS and bool(base.args[0].is_Symbol)


def _has_root(product: sp.Expr) -> bool:
    return any(f.is_Pow and f.base.is_Rational for f in sp.Mul.make_args(product))


def _comparable(part: object) -> tuple[object, ...]:
    if isinstance(part, tuple):
        return 2, tuple(map(_comparable, part))
    return (1 if isinstance(part, str) else 0), part


class FractionPrinter(Printer):
    """Prints expressions with quotients as fractions, and functions with several arguments."""

    def _product(self, addend: sp.Expr) -> str:
        positive = -addend if _is_negative(addend) else addend
        numerator, denominator = sp.fraction(positive)
        if denominator.is_number and numerator.has(sp.Pow) and _has_root(numerator):
            return super()._product(addend)
        if denominator == 1 or positive.is_Rational:
            return super()._product(addend)
        coefficient, rest = denominator.as_coeff_Mul()
        if coefficient not in (1, 2):
            numerator, denominator = numerator / coefficient, rest
            if denominator == 1:
                return super()._product(numerator)
        return rf"\frac{{{self.tex(numerator)}}}{{{self.tex(denominator)}}}"


def number(value: sp.Expr) -> str:
    """Format an exact number as a decimal, or with fractions, roots and multiples of pi."""
    if value.is_Float:
        return cut(value, PRINTED_DIGITS)
    if value.is_Rational:
        return _rational(value) if _is_given(value) else cut(value, PRINTED_DIGITS)
    multiple = value / sp.pi
    if multiple.is_Rational:
        times = "" if abs(multiple.p) == 1 else str(abs(multiple.p))
        over = "" if multiple.q == 1 else f"/{multiple.q}"
        return ("-" if multiple < 0 else "") + rf"{times}\pi{over}"
    numerator, denominator = value.as_numer_denom()
    over = sp.latex(numerator)
    return over if denominator == 1 else rf"\tfrac{{{over}}}{{{sp.latex(denominator)}}}"


def _is_given(value: sp.Rational) -> bool:
    places = decimal_places(value)
    digits = max(abs(value.p), value.q) if places is None else abs(value.p) * 10**places // value.q
    return bool(digits < 10**GIVEN_DIGITS)


def _rational(value: sp.Rational) -> str:
    sign, value = ("-" if value < 0 else ""), abs(value)
    places = decimal_places(value)
    if places is None:
        return rf"{sign}\tfrac{{{value.p}}}{{{value.q}}}"
    if 0 < value < SMALL:
        return sign + _with_power(_rational, value)
    digits = str(value.p * 10**places // value.q).rjust(places + 1, "0")
    integer = digits[: len(digits) - places]
    return sign + integer + (f".{digits[-places:]}" if places else "")


def decimal(value: sp.Expr) -> str:
    """Format a number with a few digits."""
    if 0 < abs(value) < SMALL:
        return _with_power(decimal, value)
    text = _plain(value, PRINTED_DIGITS)
    return text.rstrip("0").rstrip(".") if "." in text else text


def cut(value: sp.Expr, digits: int) -> str:
    """Format the first digits of a number.

    Dots replace the digits that are cut off.
    """
    if is_zero(value):
        return "0"
    if abs(value) < SMALL:
        return _with_power(lambda mantissa: cut(mantissa, digits), value)
    text = _plain(value, RELIABLE_DIGITS)
    text = text.rstrip("0").rstrip(".") if "." in text else text
    first = next(k for k, digit in enumerate(text) if digit in "123456789")
    end = max(first + digits + ("." in text[first : first + digits]), (text + ".").index("."))
    return rf"{text[:end]}\ldots" if len(text) > end else text


def _with_power(show: Callable[[sp.Expr], str], value: sp.Expr) -> str:
    exponent = Decimal(str(sp.N(value, PRINTED_DIGITS))).adjusted()
    return rf"{show(value * sp.Integer(10) ** -exponent)} \cdot 10^{{{exponent}}}"


def _plain(value: sp.Expr, digits: int) -> str:
    return format(Decimal(str(sp.N(value, digits))), "f")


def _is_negative(addend: sp.Expr) -> bool:
    return bool(addend.as_coeff_Mul()[0].is_negative)
