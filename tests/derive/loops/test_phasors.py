"""Phasor sums agree with sums of complex numbers."""

import cmath
import random

import pytest
import sympy as sp

from chasles.derive.loops.model.phasors import (
    PhasorSum,
    conjugate,
    cross,
    dot,
    is_zero,
    minus,
    product,
    quotient,
)
from chasles.derive.terms.terms import Terms

A, B = sp.symbols("a b", real=True)
L = sp.Symbol("L", real=True)
VALUES = {A: 0.3, B: -1.1, L: 0.7}


def number(vector, values=VALUES):
    return complex(*(sp.sympify(part).subs(values).evalf() for part in vector))


def total(phasors, values=VALUES):
    return sum(
        number(vector, values) * cmath.exp(1j * float(sp.sympify(angle).subs(values)))
        for angle, vector in phasors.terms.items()
    )


def random_sum(generator):
    result = PhasorSum()
    for angle in (sp.S.Zero, A, B, A + B, A - 2 * B):
        vector = [sp.Rational(generator.randint(-9, 9), 4) + generator.choice((0, L)) for _ in "xy"]
        result = result + PhasorSum.of(tuple(vector), angle)
    return result


def test_vector_operations_match_complex_numbers():
    generator = random.Random(0)
    for _ in range(20):
        a, b = (
            tuple(sp.Rational(generator.randint(-9, 9), generator.randint(1, 5)) for _ in "xy")
            for _ in "ab"
        )
        z, w = number(a), number(b)
        assert number(product(a, b)) == pytest.approx(z * w)
        assert number(conjugate(a)) == z.conjugate()
        assert number(minus(a, b)) == pytest.approx(z - w)
        assert float(dot(a, b)) == pytest.approx((z.conjugate() * w).real)
        assert float(cross(a, b)) == pytest.approx((z.conjugate() * w).imag)
        if w:
            assert number(quotient(a, b)) == pytest.approx(z / w)


def test_phasor_sums_add_rotate_and_scale_like_complex_numbers():
    generator = random.Random(1)
    factor = (sp.Rational(3, 5), sp.Rational(-4, 5))
    for _ in range(10):
        one, other = random_sum(generator), random_sum(generator)
        assert total(one + other) == pytest.approx(total(one) + total(other))
        assert total(one - other) == pytest.approx(total(one) - total(other))
        assert total(-one) == pytest.approx(-total(one))
        assert total(one.times(factor)) == pytest.approx(total(one) * number(factor))
        turn = cmath.exp(1j * VALUES[B])
        assert total(one.turned(B)) == pytest.approx(total(one) * turn)


def test_cancelling_phasors_are_removed():
    rod = PhasorSum.of((L, sp.S.Zero), A)
    assert (rod - rod).terms == {}
    # Phasors with equal angle sums merge, and opposite phasors cancel.
    there = PhasorSum.of((L, sp.S.One), A + B) + PhasorSum.of((-L, -sp.S.One), B + A)
    assert there.terms == {}
    left = PhasorSum.of((L**2 / L - L, sp.sqrt(2) * sp.sqrt(3) - sp.sqrt(6)), A)
    assert left.terms == {}
    assert PhasorSum.of(((L**2 - 1) / (L - 1), sp.S.Zero), A).terms == {A: (L + 1, 0)}


def test_common_angle_is_zero_for_mixed_angles():
    assert PhasorSum.of((L, L), A).common_angle() == A
    assert (PhasorSum.of((L, L), A) + PhasorSum.of((L, L), B)).common_angle() == 0
    assert PhasorSum().common_angle() == 0


def test_phasor_coordinates_match_complex_sum():
    terms = Terms({L: sp.Rational(7, 10)})
    phasors = random_sum(random.Random(2))
    x, y = phasors.coordinates(terms)
    while terms.definitions.keys() & (x.free_symbols | y.free_symbols):
        x, y = x.xreplace(terms.definitions), y.xreplace(terms.definitions)
    values = {A: VALUES[A], B: VALUES[B]}
    found = complex(*(terms.value(part.subs(values)) for part in (x, y)))
    assert found == pytest.approx(total(phasors), abs=1e-15)


def test_loop_relation_shortens_phasor_sum():
    loop = PhasorSum.of((sp.S.One, sp.S.Zero), A) + PhasorSum.of((L, sp.S.Zero), B)
    loop = loop - PhasorSum.of((sp.S(2), sp.S.Zero)) - PhasorSum.of((sp.S(3), sp.S.Zero), A + B)
    long = PhasorSum.of((sp.S(2), sp.S.Zero), A) + PhasorSum.of((2 * L, sp.S.Zero), B)
    long = long - PhasorSum.of((sp.S(6), sp.S.Zero), A + B)
    short = long.reduced([loop], lambda s: len(s.terms))
    assert short.terms == {sp.S.Zero: (sp.S(4), sp.S.Zero)}
    # The phasor sums `long` and `short` are equal only if the loop equation holds.
    assert total(long) - total(short) == pytest.approx(2 * total(loop))
    nothing_to_gain = PhasorSum.of((L, sp.S.Zero), A)
    assert nothing_to_gain.reduced([loop], lambda s: len(s.terms)) == nothing_to_gain


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ((L + 1) ** 2 - L**2 - 2 * L - 1, True),
        (1 / (L - 1) - 1 / (L + 1) - 2 / (L**2 - 1), True),
        (sp.cos(sp.pi / 5) - (1 + sp.sqrt(5)) / 4, True),
        (L - sp.Rational(7, 10), False),
        (sp.Rational(1, 10) ** 20, False),
    ],
    ids=["polynomial", "fractions", "cosine of pi/5", "zero only at 7/10", "tiny number"],
)
def test_is_zero_detects_identically_zero_expressions(expression, expected):
    assert is_zero(expression) is expected
