"""Exact numbers are read without rounding. Text that is not a number is rejected quickly."""

from decimal import Decimal
from itertools import pairwise

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from chasles.derive.model.exact import NotExact, checked, is_zero, read, snap_angle
from tests.support.counting import calls_of

NAMES = {name: sp.Symbol(name, real=True) for name in ("a", "b", "d1")}
A, B = NAMES["a"], NAMES["b"]
MAX_CALLS = 50_000
"""Maximum number of Python calls for rejecting any malformed text."""

READ = {
    "pi/2": sp.pi / 2,
    "-pi": -sp.pi,
    "-2*pi/3": -2 * sp.pi / 3,
    "0.1625": sp.Rational(13, 80),
    "0.1": sp.Rational(1, 10),
    ".5": sp.Rational(1, 2),
    "1.": sp.Integer(1),
    "1e-3": sp.Rational(1, 1000),
    "1E+3": sp.Integer(1000),
    "1e30": sp.Integer(10) ** 30,
    "1.2246467991473532e-16": sp.Rational(12246467991473532, 10**32),
    "1_000": sp.Integer(1000),
    " 7 ": sp.Integer(7),
    "- - 1": sp.Integer(1),
    "+2": sp.Integer(2),
    "1/3": sp.Rational(1, 3),
    "1/3*3": sp.Integer(1),
    "0.1+0.2": sp.Rational(3, 10),
    "2**-2": sp.Rational(1, 4),
    "2**0.5": sp.sqrt(2),
    "2**(1/3)": sp.cbrt(2),
    "1e30**1": sp.Integer(10) ** 30,
    "sqrt(2)/2": sp.sqrt(2) / 2,
    "sqrt(0.25)": sp.Rational(1, 2),
    "sqrt(3)*sqrt(3)": sp.Integer(3),
    "sin(pi/6)": sp.Rational(1, 2),
    "cos(pi/4)": sp.sqrt(2) / 2,
    "tan(pi/3)": sp.sqrt(3),
    "atan(1)": sp.pi / 4,
    "atan2(-1, -1)": -3 * sp.pi / 4,
    "2*(1+(3-1))**2": sp.Integer(18),
    "a": A,
    "-a + 2*b": -A + 2 * B,
    "sqrt(a**2 + b**2)": sp.sqrt(A**2 + B**2),
    "atan2(a, b)": sp.atan2(A, B),
    "1/(a-b)": 1 / (A - B),
    "(" * 90 + "1" + ")" * 90: sp.Integer(1),
}

REFUSED = {
    "attribute": ("(1).real", "a.free_symbols", "pi.__class__", "''.join(a)", "sqrt.__globals__"),
    "other calls": ("abs(1)", "exit()", "__import__('os')", "eval('1')", "pi()", "open('x')"),
    "call forms": ("sqrt()", "sqrt(1, 2)", "atan2(1)", "sqrt(x=1)", "sqrt(*[1])", "sqrt(**{})"),
    "call of a call": ("sqrt(1)(2)", "(lambda: 1)()", "(sqrt)(2)(3)"),
    "python": (
        "lambda: 1",
        "lambda a: a",
        "(a := 1)",
        "1 if a else 2",
        "not 1",
        "1 < 2",
        "a and b",
    ),
    "comprehension": ("[a for a in b]", "{a for a in b}", "(a for a in b)", "{a: b for a in b}"),
    "containers": ("[1]", "(1, 2)", "{}", "{1}", "a[0]", "()", "*a"),
    "statements": ("a = 1", "1; 2", "import os", "del a", "yield a", "await a", "assert 1"),
    "strings": ("'a'", '"1"', "b'1'", "f'{1}'", "'1' * 9", '"""1"""'),
    "constants": ("True", "None", "...", "False", "Ellipsis", "__debug__"),
    "complex": ("1j", "2+3j", "1J", "sqrt(-1)", "(-1)**0.5", "(-8)**(1/3)", "sqrt(3-pi)"),
    "nested complex": ("sin(sqrt(-1))", "sqrt(-1)**2", "sqrt(sqrt(2)-2)", "(sqrt(2)-2)**(1/4)"),
    "other bases": ("0x10", "0b1", "0o7", "017"),
    "other operators": ("5 % 3", "1 // 2", "1 @ 2", "~1", "1 << 9", "1 | 2", "1 ^ 2", "1 & 3"),
    "exponents": ("9**9**9", "10**12**12", "2**13", "2**pi", "2**a", "a**a", "2**(1/13)", "2**-13"),
    "exponents of many digits": ("1e-2651002136957566879", "1e99999999999999999999", f"1e{10**99}"),
    "large": ("1e31", "1e999999999", "-1e999999999", "1e30**12", "1e30*1e30", "tan(pi/2-1e-31)"),
    "large powers": ("((2**12)**12)**12", "(((10**12)**12)**12)**12", "((sqrt(2)+9)**12)**12"),
    "small": ("1e-401", "1e-999999999", "0e-999999999", "0e999999999"),
    "digits": ("1" * 61, "0." + "3" * 100, "1" * 199),
    "nesting": ("(" * 199, "(" * 5000, "[" * 199, "((((", ")" * 50, "sin(" * 49, "-" * 199),
    "not finite": ("nan", "inf", "-inf", "NaN", "Infinity", "oo", "zoo", "1/0", "0/0", "0**-1"),
    "division by zero": ("1/(sqrt(2)-sqrt(2))", "1/(a-a)", "a/(pi-pi)", "1/sin(pi)", "1/(0*a)"),
    "hidden zero": (
        "1/(sin(1)**2+cos(1)**2-1)",
        "1/(sqrt(2)+sqrt(3)-sqrt(5+2*sqrt(6)))",
        "a/(atan(1/2)+atan(1/3)-pi/4)",
        "1/(1/3-0.333-0.001/3)",
        "atan2(0, 0)",
        "tan(pi/2)",
    ),
    "unicode": ("１２", "٣", "²", "π", "½", "2\u00b2", "ｐｉ", "−1", "1\u2009000", "1\u202e2"),  # noqa: RUF001
    "white space": ("", " ", "\n", "\x00", "1\x00", "1\n+1", "\x0c", "1\x1b[31m"),
    "long": ("1+" * 99 + "1 +1", " " * 10 + "1" * 201, "a" * 201, "1" + "0" * 10**6),
    "names": ("x", "q1", "e", "E", "I", "exp", "aa", "A", "d2", "__builtins__", "sqrt", "sin"),
    "unfinished": ("1 +", "* 2", "1e", "1..2", "1 2", "sqrt 2", "1,", "2pi", ".", "1__0", "#"),
}
VALUES = (True, False, None, 0.5, float("nan"), 1j, b"1", [], [1], {}, (), object(), sp.pi, 10**31)
DECIMALS = ("NaN", "sNaN", "Infinity", "-Infinity", "1E+31", "-1E+999999", "1E-999999")


@pytest.mark.parametrize(("text", "value"), READ.items(), ids=list(READ))
def test_expressions_are_read_exactly(text: str, value: sp.Expr) -> None:
    number = read(text, NAMES)
    assert number == value
    assert not number.atoms(sp.Float)


def test_decimals_and_integers_are_exact() -> None:
    assert read(Decimal("0.1")) == sp.Rational(1, 10)
    assert read(Decimal("-2.50e-7")) == sp.Rational(-1, 4_000_000)
    assert read(-7) == -7
    assert read(10**30) == read("1e30") == read(Decimal("1e30")) == sp.Integer(10) ** 30


@pytest.mark.parametrize("kind", REFUSED)
def test_invalid_expressions_are_rejected_quickly(kind: str) -> None:
    refused = 0
    for text in REFUSED[kind]:
        message = ""

        def attempt(text: str = text) -> None:
            nonlocal message
            with pytest.raises(NotExact) as caught:
                read(text, NAMES)
            message = str(caught.value)

        assert calls_of(attempt) < MAX_CALLS, text[:60]
        assert 0 < len(message) < 400
        refused += 1
    assert refused == len(REFUSED[kind]) > 2


def test_invalid_expression_cases_number_above_170() -> None:
    assert sum(map(len, REFUSED.values())) > 170


def test_values_of_other_types_are_rejected() -> None:
    refused = 0
    for value in (*VALUES, *map(Decimal, DECIMALS)):
        with pytest.raises(NotExact):
            read(value, NAMES)
        refused += 1
    assert refused == 14 + 7


def test_huge_integers_are_refused_without_writing_them_out() -> None:
    for value in (1 << 10**6, -(1 << 10**6)):
        with pytest.raises(NotExact, match="larger than 1e30"):
            read(value)


def test_expressions_are_never_evaluated_as_code() -> None:
    ran: list[int] = []

    class Trap(dict):  # type: ignore[type-arg]
        def __missing__(self, name: str) -> object:
            ran.append(1)
            return name

    for text in ("ran.append(1)", "[ran.append(1)]", "ran", "(lambda: ran.append(1))()"):
        with pytest.raises(NotExact):
            read(text, Trap(NAMES))
    assert ran == []


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("d2", "unknown parameter 'd2'; expected one of the parameters 'a', 'b', 'd1'"),
        ("zz", "unknown parameter 'zz'; expected one of the parameters 'a', 'b', 'd1'"),
        ("d12", "unknown parameter 'd12'; expected the parameter 'd1'"),
        ("a.real", "sqrt, sin, cos, tan, atan, atan2, got 'a.real'"),
        ("1 +", "not a number or an expression of numbers, pi, parameters"),
        ("120 mm", "a number with a unit; state the unit in the file's field 'units'"),
        ("1/0", "division by zero"),
        ("sqrt(-2)", "not a real number"),
        ("9**99", "an exponent must be a fraction of numbers up to 12"),
        ("sqrt(1, 2)", "sqrt takes 1 argument"),
        ("atan2(1)", "atan2 takes 2 arguments"),
        ("0x1F", "expected a decimal number, got '0x1F'"),
        ("1e77", "larger than 1e30"),
        ("π", "letters other than ASCII"),
        ("1" * 300, "more than 200 characters"),
        ("", "an empty text"),
    ],
    ids=[
        "unknown short name",
        "unknown long name",
        "misspelt name",
        "attribute",
        "incomplete",
        "unit",
        "division by zero",
        "not real",
        "exponent",
        "sqrt arguments",
        "atan2 arguments",
        "hexadecimal",
        "too large",
        "greek",
        "too long",
        "empty",
    ],
)
def test_error_states_the_reason_for_rejection(text: str, reason: str) -> None:
    with pytest.raises(NotExact) as caught:
        read(text, NAMES)
    assert reason in str(caught.value)


def test_without_parameters_a_name_is_unknown() -> None:
    with pytest.raises(NotExact, match=r"unknown name 'a'$"):
        read("a")


def test_number_of_arguments_is_stated_in_singular() -> None:
    with pytest.raises(NotExact, match=r"sqrt takes 1 argument$"):
        read("sqrt(1, 2)")


def test_at_most_eight_functions_are_nested() -> None:
    eight = "cos(" * 8 + "a" + ")" * 8
    assert read(eight, NAMES).free_symbols
    for deeper in (f"sin({eight})", f"({eight})**2"):
        with pytest.raises(NotExact, match="more nested functions and powers than 8"):
            read(deeper, NAMES)


def test_angle_unit_applies_inside_functions() -> None:
    degree = sp.pi / 180
    assert read("cos(60)", {}, degree) == sp.Rational(1, 2)
    assert read("tan(a)", NAMES, degree) == sp.tan(A * degree)
    assert read("atan2(1, 1) + 1", {}, degree) == 46
    assert read("cos(pi)", {}) == -1


def test_checked_rejects_undefined_values_after_substitution() -> None:
    fraction, root = read("a/(a-b)", NAMES), read("sqrt(a)", NAMES)
    assert checked(fraction.xreplace({A: sp.Integer(2), B: sp.Integer(1)})) == 2
    with pytest.raises(NotExact, match="division by zero"):
        checked(fraction.xreplace({A: sp.Integer(1), B: sp.Integer(1)}))
    with pytest.raises(NotExact, match="not a real number"):
        checked(root.xreplace({A: sp.Integer(-1)}))


def test_angles_snap_to_twelfths_of_pi() -> None:
    snapped = 0
    for twelfths in range(-30, 31):
        multiple = sp.pi * sp.Rational(twelfths, 12)
        near = sp.Rational(str(float(multiple)))
        for off in (0, sp.Rational(9, 10**10), -sp.Rational(9, 10**10)):
            assert snap_angle(near + off) == multiple
            snapped += 1
        for off in (sp.Rational(2, 10**9), -sp.Rational(2, 10**9)):
            assert snap_angle(near + off) == near + off
    assert snapped == 61 * 3


def test_is_zero_is_decided_with_many_digits() -> None:
    assert is_zero(sp.sin(1) ** 2 + sp.cos(1) ** 2 - 1)
    assert is_zero(sp.Integer(0))
    assert not is_zero(sp.Rational(1, 10**300))
    assert not is_zero(sp.pi - sp.Rational("3.14159265358979323846264338"))
    assert not is_zero(A - B)


@settings(max_examples=150, derandomize=True)
@given(st.text(alphabet="0123456789.eE+-*/()_, piabsqrtcotn'\"[]{}<>:=!%@\\#\n\x00é", max_size=60))
def test_any_text_is_a_real_expression_or_rejected(text: str) -> None:
    try:
        number = read(text, NAMES)
    except NotExact:
        return
    assert number.free_symbols <= set(NAMES.values())
    assert not number.atoms(sp.Float)


@settings(max_examples=100, derandomize=True)
@given(st.decimals(min_value=-1000, max_value=1000, places=9))
def test_decimals_are_equal_in_every_notation(number: Decimal) -> None:
    forms = [str(number), f"{number:E}", f"  {number}", f"({number})"]
    values = [read(form) for form in forms] + [read(number)]
    assert all(one == other for one, other in pairwise(values))
    assert values[0] == sp.Rational(str(number))
