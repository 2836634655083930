"""Strength reduction replaces some program statements by cheaper statements, and keeps others."""

import re

import pytest

from chasles.derive.program.operations import (
    Compute,
    Constant,
    Input,
    Operation,
    Program,
    Store,
    Variable,
)
from chasles.derive.program.strength import reduced

NAMES = {
    "+": Operation.ADD,
    "*": Operation.MULTIPLY,
    "/": Operation.DIVIDE,
    "<": Operation.LESS,
    "neg": Operation.NEGATE,
    "sq": Operation.SQUARE,
    "sqrt": Operation.SQRT,
    "rsqrt": Operation.RECIPROCAL_SQRT,
    "atan2": Operation.ATAN2,
    "max": Operation.MAX,
    "select": Operation.SELECT,
    "supplement": Operation.SUPPLEMENT,
}
SYMBOLS = {operation: name for name, operation in NAMES.items()}


def operand(text):
    """Parse an operand: ``v1`` is a variable, ``x2`` an input, and any other text a number."""
    if found := re.fullmatch(r"([vx])(\d+)", text):
        number = int(found[2])
        return Variable(number) if found[1] == "v" else Input(0, number)
    return Constant(float(text))


def shown(value):
    match value:
        case Variable(number):
            return f"v{number}"
        case Input(_, entry):
            return f"x{entry}"
        case _:
            return str(value.value)


def computed(number, text):
    """Parse an operation and its operands: ``* x1 v2``."""
    name, *operands = text.split()
    return Compute(Variable(number), NAMES[name], tuple(map(operand, operands)))


def texts(program):
    return [" ".join([SYMBOLS[s.operation], *map(shown, s.operands)]) for s in program.computed]


def program(given, stored):
    statements = [computed(k, text) for k, text in enumerate(given, 1)]
    stores = [Store(0, k, Variable(v)) for k, v in enumerate(stored)]
    return Program("f", ("x",), ("y",), (), (*statements, *stores))


def all_stored(*given):
    """Apply strength reduction to statements, where all statements except the first are results."""
    return texts(reduced(program(given, range(2, len(given) + 1))))


def after(*given, sign=None):
    """Reduce statements."""
    return texts(reduced(program(given, [len(given)]), sign))


def test_root_used_only_as_divisor_becomes_reciprocal_root():
    assert all_stored("sqrt x0", "/ x1 v1") == ["rsqrt x0", "* x1 v1"]


@pytest.mark.parametrize(
    "other", ["+ v1 x1", "/ v1 v1", "/ v1 x1", "sq v1", "select x1 v1 x2", "max v1 x1"]
)
def test_root_with_other_uses_is_kept(other):
    given = ("sqrt x0", "/ x1 v1", other)
    assert all_stored(*given) == list(given)


def test_root_that_is_a_result_is_kept():
    given = ("sqrt x0", "/ x1 v1")
    assert texts(reduced(program(given, [1, 2]))) == list(given)


@pytest.mark.parametrize(
    ("y", "x", "expected"),
    [
        ("v1", "x1", ["atan2 x0 x1", "neg v1"]),
        ("x0", "v2", ["atan2 x0 x1", "supplement v1 x0"]),
        ("v1", "v2", ["neg x0", "atan2 x0 x1", "supplement v2 v1"]),
    ],
)
def test_atan2_of_opposite_points_is_shared(y, x, expected):
    given = ("neg x0", "neg x1", "atan2 x0 x1", f"atan2 {y} {x}")
    assert texts(reduced(program(given, [3, 4]))) == expected


def test_atan2_drops_a_common_positive_divisor():
    point = ("sqrt x0", "/ x1 v1", "/ x2 v1")
    assert after(*point, "atan2 v2 v3") == ["atan2 x1 x2"]
    assert after(*point, "neg v3", "atan2 v2 v4") == ["neg x2", "atan2 x1 v1"]
    assert after(*point, "* x3 v3", "atan2 v2 v4") == ["* x2 x3", "atan2 x1 v1"]


def test_negated_constant_is_folded():
    given = ("sqrt x0", "/ 0.5 v1", "neg v2", "/ x1 v1", "atan2 v3 v4")
    assert after(*given) == ["atan2 -0.5 x1"]


def test_atan2_keeps_the_divisor_of_a_single_coordinate():
    given = ("sqrt x0", "/ x1 v1", "atan2 v2 x2")
    assert after(*given) == ["rsqrt x0", "* x1 v1", "atan2 v2 x2"]


def test_atan2_is_computed_before_the_sign_is_applied():
    sign = Input(0, 0)
    assert after("* x0 x1", "atan2 v1 x2", sign=sign) == ["atan2 x1 x2", "* x0 v1"]
    expected = ["atan2 x2 x1", "< 0.0 x0", "supplement v1 x2", "select v2 v1 v3"]
    assert after("* x0 x1", "atan2 x2 v1", sign=sign) == expected
    both = after("* x0 x1", "* x0 x2", "atan2 v1 v2", sign=sign)
    assert both[-1].startswith("select ")
    assert both[-1].endswith(" v2 v4")
    assert "atan2 x1 x2" in both
    assert "supplement v2 v1" in both
