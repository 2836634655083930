"""Strength reduction: which statements become cheaper ones, and which must stay."""

import pytest

from chasles.derive.program.statements import Body, Compute, Store
from chasles.derive.program.strength import reduced


def expressions(*given):
    computed = [Compute(f"v{k}", expression) for k, expression in enumerate(given, 1)]
    stored = [Store(0, k, statement.name) for k, statement in enumerate(computed[1:])]
    return [s.expression for s in reduced(Body((), (*computed, *stored))).computed]


def test_a_length_that_only_divides_is_a_reciprocal_root():
    given = (Compute("v1", "sqrt(x_0)"), Compute("v2", "x_1 / v1"), Store(0, 0, "v2"))
    body = reduced(Body((), given))
    assert [s.expression for s in body.computed] == ["rsqrt(x_0)", "x_1 * v1"]


@pytest.mark.parametrize(
    "other", ["v1 + x_1", "v1 / v1", "v1 / x_1", "sq(v1)", "x_1 ? v1 : x_2", "fmax(v1, x_1)"]
)
def test_a_length_that_is_taken_otherwise_stays(other):
    given = ("sqrt(x_0)", "x_1 / v1", other)
    assert expressions(*given) == list(given)


def test_a_length_that_is_a_result_stays():
    given = (Compute("v1", "sqrt(x_0)"), Compute("v2", "x_1 / v1"), Store(0, 0, "v1"))
    assert reduced(Body((), (*given, Store(0, 1, "v2")))).computed == list(given[:2])


@pytest.mark.parametrize(
    ("y", "x", "expected"),
    [
        ("v1", "x_1", ["atan2(x_0, x_1)", "-v1"]),
        ("x_0", "v2", ["atan2(x_0, x_1)", "supplement(v1, x_0)"]),
        ("v1", "v2", ["-x_0", "atan2(x_0, x_1)", "supplement(v2, v1)"]),
    ],
)
def test_opposite_points_share_an_angle(y, x, expected):
    given = (
        *(Compute("v1", "-x_0"), Compute("v2", "-x_1"), Compute("v3", "atan2(x_0, x_1)")),
        *(Compute("v4", f"atan2({y}, {x})"), Store(0, 0, "v3"), Store(0, 1, "v4")),
    )
    assert [s.expression for s in reduced(Body((), given)).computed] == expected


def after(*given, sign=""):
    """The reduced statements, where the last statement is the only result."""
    computed = [Compute(f"v{k}", expression) for k, expression in enumerate(given, 1)]
    body = Body((), (*computed, Store(0, 0, computed[-1].name)))
    return [s.expression for s in reduced(body, sign).computed]


def test_an_angle_does_not_wait_for_a_length():
    point = ("sqrt(x_0)", "x_1 / v1", "x_2 / v1")
    assert after(*point, "atan2(v2, v3)") == ["atan2(x_1, x_2)"]
    assert after(*point, "-v3", "atan2(v2, v4)") == ["-x_2", "atan2(x_1, v1)"]
    assert after(*point, "x_3 * v3", "atan2(v2, v4)") == ["x_2 * x_3", "atan2(x_1, v1)"]


def test_an_angle_waits_for_a_length_that_only_one_coordinate_has():
    given = ("sqrt(x_0)", "x_1 / v1", "atan2(v2, x_2)")
    assert after(*given) == ["rsqrt(x_0)", "x_1 * v1", "atan2(v2, x_2)"]


def test_an_angle_does_not_wait_for_a_sign():
    assert after("x_0 * x_1", "atan2(v1, x_2)", sign="x_0") == ["atan2(x_1, x_2)", "x_0 * v1"]
    expected = ["atan2(x_2, x_1)", "0.0 < x_0", "supplement(v1, x_2)", "v2 ? v1 : v3"]
    assert after("x_0 * x_1", "atan2(x_2, v1)", sign="x_0") == expected
    both = after("x_0 * x_1", "x_0 * x_2", "atan2(v1, v2)", sign="x_0")
    assert both[-1].endswith(" ? v2 : v4")
    assert "atan2(x_1, x_2)" in both
    assert "supplement(v2, v1)" in both
