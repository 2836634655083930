"""Solved triangles of planar loops agree with 30-digit arithmetic, also near dead points."""

import math
import random

import casadi as ca
import mpmath
import numpy as np
import pytest
import sympy as sp

from chasles.derive.loops.model.phasors import ZERO, PhasorSum
from chasles.derive.loops.planar.arm import Arm, arm, turn_of
from chasles.derive.loops.planar.pin_pin_slide import circle_and_line, rate_of_third
from chasles.derive.loops.planar.pin_slide_slide import two_lines
from chasles.derive.loops.planar.three_pins import rate_of_first, rate_of_second, two_circles
from chasles.derive.loops.planar.two_pins import rate_of_direction
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.tangents import Tangent
from chasles.derive.terms.terms import Terms

mpmath.mp.dps = 30
EPS = 2.0**-52
x1, x2, x3, x4, x5, x6 = X = sp.symbols("x1:7", real=True)


def compiled(terms, symbols, *values):
    """Compile symbolic expressions to a CasADi function of a vector."""
    argument = Argument("x", tuple(symbols), (len(symbols),), "", "")
    result = Result("y", tuple(sp.sympify(value) for value in values), (len(values),), "", "")
    (function,) = lower([SymbolicFunction("f", "F.", "", (argument,), (result,), terms)], "test")
    return function


def moving(terms, x, y):
    """Return a body-fixed vector whose components are coordinates."""
    return Arm((x, y), ZERO, terms.let(x * x + y * y))


def circles(v, w, d, sign):
    """Intersect two circles in the complex plane, with 30-digit arithmetic."""
    v, w, d = (mpmath.mpc(*map(mpmath.mpf, pair)) for pair in (v, w, d))
    a, b, c = abs(v), abs(w), abs(d)
    along = (c**2 + a**2 - b**2) / (2 * c)
    across = sign * mpmath.sqrt(a**2 - along**2)
    C = d / c * mpmath.mpc(along, across)
    return C, C - d, C / v, (C - d) / w, across * c


def random_triangle(generator):
    while True:
        v, w, d = ((generator.uniform(-1, 1), generator.uniform(-1, 1)) for _ in range(3))
        a, b, c = (math.hypot(*pair) for pair in (v, w, d))
        if abs(a - b) < c < a + b:
            return v, w, d


@pytest.mark.parametrize("sign", [1, -1])
def test_two_circles_intersection_matches_mpmath(sign):
    terms = Terms({})
    arms = [moving(terms, *pair) for pair in ((x1, x2), (x3, x4), (x5, x6))]
    found = two_circles(terms, *arms, sign)
    first, second = turn_of(terms, found.C, arms[0]), turn_of(terms, found.W, arms[1])
    f = compiled(terms, X, *found.C, *found.W, *first, *second, found.height, found.margin)
    generator = random.Random(0)
    for _ in range(200):
        v, w, d = random_triangle(generator)
        C, W, turn_v, turn_w, height = circles(v, w, d, sign)
        margin = (height / (abs(mpmath.mpc(*v)) * abs(mpmath.mpc(*w)))) ** 2
        expected = [part for z in (C, W, turn_v, turn_w) for part in (z.real, z.imag)]
        expected = np.array([float(part) for part in (*expected, height, margin)])
        result = np.array(f([*v, *w, *d])).ravel()
        # Rounding errors are larger for thin triangles (small margin) and for short triangle sides.
        thin = 1 / min(1.0, *(math.hypot(*pair) for pair in (v, w, d))) ** 3
        assert np.abs(result - expected).max() < 50 * EPS * thin / math.sqrt(float(margin))


def area(kind):
    """Compile the third corner and the height of a triangle with one variable side."""
    terms = Terms({})
    a, b = sp.Rational(3, 10), sp.Rational(7, 10)
    fixed = [arm(terms, PhasorSum.of((length, ZERO))) for length in (a, b)]
    varying = moving(terms, x1, ZERO)
    order = {"base": (*fixed, varying), "arm": (varying, *fixed)}[kind]
    return compiled(
        terms, [x1], *(two_circles(terms, *order, 1).C), two_circles(terms, *order, 1).height
    )


@pytest.mark.parametrize("kind", ["base", "arm"])
@pytest.mark.parametrize("dead", [0.4, 1.0])
def test_triangle_height_is_accurate_near_dead_points(kind, dead):
    """Heron's formula is accurate where a difference of squares loses digits."""
    f = area(kind)
    checked = 0
    for exponent in range(-2, -15, -1):
        for part in (1.0, 3.7, 7.3):
            x = dead + (part if dead < 0.5 else -part) * 10.0**exponent
            a, b, c = mpmath.mpf(3) / 10, mpmath.mpf(7) / 10, mpmath.mpf(x)
            s = (a + b + c) / 2
            height = 2 * mpmath.sqrt(s * (s - a) * (s - b) * (s - c))
            # Rounding the lengths 3/10 and 7/10 to doubles causes an error of 1e-16.
            away = abs(x - dead)
            assert float(f([x])[2]) == pytest.approx(
                float(height), rel=8 * EPS / away + 8 * EPS, abs=0
            )
            checked += 1
    assert checked == 39


def test_out_of_reach_is_nan_with_a_negative_margin():
    terms = Terms({})
    arms = [moving(terms, *pair) for pair in ((x1, x2), (x3, x4), (x5, x6))]
    found = two_circles(terms, *arms, 1)
    f = compiled(terms, X, *found.C, found.margin)
    for d in (2.5, 0.3):
        *C, margin = np.array(f([1, 0, 0, 0.6, d, 0])).ravel()
        assert np.isnan(C).all()
        assert margin < 0
    assert float(f([1, 0, 0, 0.6, 1.6, 0])[2]) == pytest.approx(0, abs=1e-15)


# --- rates ---


def derivatives(terms, given, values, loops, angles):
    """Return joint rates from the loop equations and from automatic differentiation."""
    symbols = X[: len(given)]
    rates = sp.symbols("r1:7", real=True)[: len(given)]
    tangent = Tangent(terms, dict(zip(symbols, rates, strict=True)), loops)
    found = [tangent.of(angle) for angle in angles]
    f = compiled(terms, (*symbols, *rates), *found)
    plain = compiled(terms, symbols, *values)
    x, xd = ca.SX.sym("x", len(given)), ca.SX.sym("xd", len(given))
    oracle = ca.Function("oracle", [x, xd], [ca.jtimes(plain(x), x, xd)])
    return f, oracle


def test_two_circles_rates_match_automatic_differentiation():
    terms = Terms({})
    arms = [moving(terms, *pair) for pair in ((x1, x2), (x3, x4), (x5, x6))]
    found = two_circles(terms, *arms, 1)
    turns = turn_of(terms, found.C, arms[0]), turn_of(terms, found.W, arms[1])
    angles = [terms.solved_angle(*turn) for turn in turns]
    loops = {
        angles[0]: rate_of_first(found, *turns[0]),
        angles[1]: rate_of_second(found, *turns[1]),
    }
    f, oracle = derivatives(terms, X, angles, loops, angles)
    generator = random.Random(1)
    for _ in range(100):
        v, w, d = random_triangle(generator)
        x, xd = [*v, *w, *d], [generator.uniform(-1, 1) for _ in range(6)]
        expected = np.array(oracle(x, xd)).ravel()
        np.testing.assert_allclose(np.array(f([*x, *xd])).ravel(), expected, rtol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_circle_and_line_solution_and_rates_match_references(sign):
    terms = Terms({})
    direction = (sp.Rational(3, 5), sp.Rational(4, 5))
    r = moving(terms, x3, x4)
    found = circle_and_line(terms, (x1, x2), direction, r, sign)
    turn = turn_of(terms, found.vector, r)
    angle = terms.solved_angle(*turn)
    f = compiled(terms, X[:4], found.travel, *found.vector, angle, found.margin)
    rate, oracle = derivatives(
        terms, X[:4], [found.travel, angle], {angle: rate_of_third(found)}, [found.travel, angle]
    )
    generator, checked = random.Random(2), 0
    for _ in range(100):
        x = [generator.uniform(-1, 1) for _ in range(4)]
        e, o, rr = complex(0.6, 0.8), complex(*x[:2]), complex(*x[2:])
        across = (e.conjugate() * o).imag
        travel, *vector, phi, margin = np.array(f(x)).ravel()
        assert margin == pytest.approx(1 - (across / abs(rr)) ** 2, abs=1e-14, rel=1e-12)
        if margin < 1e-3:
            assert margin > 0 or np.isnan(travel)
            continue
        expected = [
            mpmath.findroot(
                lambda t, o=o, rr=rr, e=e: (
                    abs(mpmath.mpc(o) + t * mpmath.mpc(e)) ** 2 - abs(mpmath.mpc(rr)) ** 2
                ),
                start,
            )
            for start in (10, -10)
        ]
        t = max(expected) if sign > 0 else min(expected)
        assert travel == pytest.approx(float(t), abs=1e-12)
        assert complex(*vector) == pytest.approx(o + travel * e, abs=1e-12)
        assert rr * complex(math.cos(phi), math.sin(phi)) == pytest.approx(complex(*vector))
        xd = [generator.uniform(-1, 1) for _ in range(4)]
        expected = np.array(oracle(x, xd)).ravel()
        np.testing.assert_allclose(np.array(rate([*x, *xd])).ravel(), expected, rtol=1e-10)
        checked += 1
    assert checked > 40


def test_circle_and_line_is_accurate_near_the_dead_point():
    terms = Terms({})
    r = arm(terms, PhasorSum.of((sp.Rational(1, 2), ZERO)))
    found = circle_and_line(terms, (ZERO, x1), (sp.S.One, ZERO), r, 1)
    f = compiled(terms, [x1], found.travel)
    for exponent in range(-2, -15, -1):
        x = 0.5 - 10.0**exponent
        expected = mpmath.sqrt(mpmath.mpf("0.25") - mpmath.mpf(x) ** 2)
        assert float(f([x])) == pytest.approx(float(expected), rel=4 * EPS, abs=0)


def test_line_through_the_pin_has_no_dead_point():
    terms = Terms({})
    r = moving(terms, x1, x2)
    found = circle_and_line(terms, (x3, ZERO), (sp.S.One, ZERO), r, -1)
    assert found.margin == 1
    assert float(compiled(terms, X[:3], found.travel)([3, 4, 2])) == -7


def test_two_lines_intersection_matches_linear_solution():
    terms = Terms({})
    t, u = two_lines(terms, (x1, x2), (x3, x4), (x5, x6))
    f = compiled(terms, X, t, u)
    generator = random.Random(3)
    for _ in range(50):
        x = [generator.uniform(-1, 1) for _ in range(6)]
        M = mpmath.matrix([[x[2], x[4]], [x[3], x[5]]])
        expected = mpmath.lu_solve(M, mpmath.matrix(x[:2]))
        scale = 1 / abs(x[2] * x[5] - x[3] * x[4])
        found = np.array(f(x)).ravel()
        np.testing.assert_allclose(found, [float(e) for e in expected], atol=20 * EPS * scale**2)


def test_rate_of_angle_between_vectors_matches_differentiation():
    terms = Terms({})
    here = moving(terms, x3, x4)
    loop = rate_of_direction((x1, x2), here)
    c, s = turn_of(terms, (x1, x2), here)
    size = terms.let(sp.sqrt((x1**2 + x2**2) * here.square))
    angle = terms.solved_angle(
        terms.let((x1 * x3 + x2 * x4) / size), terms.let((x2 * x3 - x1 * x4) / size)
    )
    f, oracle = derivatives(terms, X[:4], [angle], {angle: loop}, [angle])
    assert c != s
    generator = random.Random(4)
    for _ in range(50):
        x, xd = ([generator.uniform(-1, 1) for _ in range(4)] for _ in "xd")
        np.testing.assert_allclose(float(f([*x, *xd])), float(oracle(x, xd)), rtol=1e-10)


def test_squared_length_of_constant_strut_is_exact():
    terms = Terms({})
    length = sp.sqrt(2) / 3
    assert arm(terms, PhasorSum.of((length, ZERO))).square == sp.Rational(2, 9)
    turning = arm(terms, PhasorSum.of((length, ZERO), x1))
    assert (turning.angle, turning.square) == (x1, sp.Rational(2, 9))
