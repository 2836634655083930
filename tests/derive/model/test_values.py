"""Evaluated constants agree with SymPy, including zeros and undefined values."""

import math
import random

import pytest
import sympy as sp

from chasles.derive.model.roots import angle_of, power, root
from chasles.derive.model.values import NoValue, Values, to_digits
from chasles.derive.terms.terms import Terms

CASES = 80
PARTS = (sp.Integer(2), sp.Rational(-3, 7), sp.Rational("0.4251460319702735"), sp.pi / 5)
SYMBOLS = {sp.Symbol("a", real=True): "0.0892", sp.Symbol("b", real=True): "1.570279330556899"}


def expression(dice: random.Random, depth: int) -> sp.Expr:
    """Return a random real expression of numbers and symbols."""
    if depth == 0:
        return dice.choice((*PARTS, *SYMBOLS))
    one, two = (expression(dice, depth - 1) for _ in range(2))
    makers = (
        lambda: one + two,
        lambda: one * two,
        lambda: one / (1 + two**2),
        lambda: sp.sqrt(1 + one**2),
        lambda: (2 + sp.cos(one)) ** sp.Rational(2, 3),
        lambda: sp.sin(one),
        lambda: sp.cos(one) - two,
        lambda: sp.atan(one) + sp.pi,
        lambda: sp.atan2(sp.sin(one), 1 + two**2),
        lambda: sp.Abs(one) * sp.sign(two),
        lambda: sp.Max(one, sp.Min(two, sp.pi)),
        lambda: sp.Piecewise((one, one > two), (two - 1, True), evaluate=False),
    )
    return dice.choice(makers)()


def test_values_match_sympy_evaluation():
    dice, values = random.Random(3), Values()
    numbers = {symbol: sp.Rational(text) for symbol, text in SYMBOLS.items()}
    for symbol, number in numbers.items():
        values.know(symbol, values.of(number))
    checked = 0
    while checked < CASES:
        made = expression(dice, dice.randint(1, 3))
        expected = made.xreplace(numbers).evalf(40)
        if not expected.is_Float or abs(expected) < 1e-9:
            continue
        found = to_digits(values.of(made))
        assert abs(found - expected) <= abs(expected) * sp.Float("1e-38", 40), made
        checked += 1
    assert checked == CASES


A, B = sp.Rational(3, 7), sp.Rational(1, 9)


@pytest.mark.parametrize(
    "zero",
    [
        sp.sin(A) ** 2 + sp.cos(A) ** 2 - 1,
        sp.sqrt(1 + sp.cos(A)) - sp.sqrt(2) * sp.cos(A / 2),
        sp.cos(A) * sp.sin(B) + sp.sin(A) * sp.cos(B) - sp.sin(A + B),
        (sp.sin(A) ** 2 + sp.cos(A) ** 2) / 10**200 - sp.Rational(1, 10**200),
    ],
    ids=["pythagoras", "half angle", "angle sum", "tiny pythagoras"],
)
def test_identically_zero_differences_evaluate_to_zero(zero):
    assert zero != 0
    assert Values().of(zero) == 0


def test_small_numbers_are_not_rounded_to_zero():
    assert Values().of(sp.Rational(1, 10**150)) != 0
    assert Values().of(sp.sin(sp.Rational(1, 10**80))) != 0


@pytest.mark.parametrize(
    "nothing",
    [
        sp.Pow(sp.Integer(0), -1, evaluate=False),
        sp.Pow(sp.sin(sp.Integer(1)) ** 2 + sp.cos(sp.Integer(1)) ** 2 - 1, -1),
        sp.sqrt(sp.sin(sp.Integer(4))),
        sp.Symbol("unknown") + 1,
        sp.Piecewise((sp.Integer(1), sp.sin(sp.Integer(4)) > 0)),
    ],
    ids=[
        "reciprocal of zero",
        "reciprocal of hidden zero",
        "root of negative",
        "unknown symbol",
        "piecewise",
    ],
)
def test_expression_without_a_value_raises_no_value(nothing):
    with pytest.raises(NoValue):
        Values().of(nothing)


def test_roots_and_angles_of_short_numbers_are_exact():
    assert root(sp.Rational(2, 9)) == sp.sqrt(2) / 3
    assert power(sp.Integer(8), sp.Rational(1, 3)) == 2
    assert angle_of(sp.Integer(-3), sp.Integer(3)) == -sp.pi / 4
    assert angle_of(sp.Integer(0), sp.Rational("-0.123456789012345678901")) == sp.pi


def test_angle_is_real_if_sympy_cannot_decide():
    y, x = sp.sqrt(7), sp.tan(sp.sin(sp.Rational(3, 7))) ** 2 + 1
    assert sp.atan2(y, x).has(sp.I)
    assert float(angle_of(y, x)) == pytest.approx(math.atan2(float(y), float(x)), abs=1e-15)


def test_roots_and_angles_of_long_numbers_are_unfactored_decimals():
    long = sp.Rational("0.9999999999996000000000000011") * 10**7 * sp.Integer(32771 * 32779)
    for made, exact in (
        (root(long**2 * 2), sp.sqrt(2) * long),
        (angle_of(long, long + 1), sp.atan(long / (long + 1))),
        (power(long, sp.Rational(-2, 3)), sp.exp(sp.log(long) * sp.Rational(-2, 3))),
    ):
        assert made.is_Rational
        assert abs(made - exact).evalf(10) < sp.Float("1e-45", 10) * abs(exact).evalf(10)


def test_named_constants_stay_short_and_keep_their_value():
    dice, terms, product, expected = random.Random(5), Terms({}), sp.Integer(1), sp.Float(1, 60)
    for _ in range(200):
        factor = sp.Rational(f"{dice.uniform(0.5, 2):.17f}")
        product = terms.let(product * factor + factor)
        expected = expected * factor + factor
        assert len(str(product)) < 40
    assert abs(terms.value(product) - expected) < sp.Float("1e-38", 40) * expected


def test_negated_constant_reuses_the_negated_name():
    x, terms = sp.Rational("0.08241032710889370320000001"), Terms({})
    assert terms.let(-sp.sin(x)) == -terms.let(sp.sin(x))
    assert terms.let(-x) == -terms.let(x)
    # chasles must recognize that a sum is exactly zero, because more digits never show its sign.
    one = sp.sin(x) * sp.cos(2 * x) + sp.cos(x) * sp.sin(2 * x) - sp.sin(3 * x)
    assert terms.let(one) == terms.let(-one) == 0


def test_negated_sum_reuses_the_negated_name():
    x, y, z = sp.symbols("x:z", real=True)
    for one in (x - y, 2 * x * y - 3 * z / 7 + 1, x * (y - z) - x * y, -x - y):
        terms = Terms({})
        assert terms.let(one).is_Symbol or terms.let(-one).is_Symbol
        assert terms.let(-one) == -terms.let(one)
        assert len(terms.definitions) == 1
