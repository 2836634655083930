"""The assembly polynomial of a planar platform on three rods: elimination, degree and roots."""

import numpy as np
import pytest
import sympy as sp

from chasles.derive.loops.modes.triad import Triad, triad_mirror, triad_polynomial, triad_position
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms

C, S = sp.symbols("c s", real=True)
NAMES = sp.symbols("x1 y1 x2 y2 x3 y3", real=True)
POINTS = tuple(zip(NAMES[::2], NAMES[1::2], strict=True))
# A platform with asymmetric pins and three unequal rods.
PINS = ((sp.Rational(1, 10), sp.Rational(-1, 5)), (sp.Rational(1, 3), 0), (0, sp.Rational(2, 7)))
RODS = (sp.Rational(1, 2), sp.Rational(3, 5), sp.Rational(2, 5))


def harmonics(coefficients, c, s):
    """Evaluate a trigonometric polynomial at the angle with cosine c and sine s."""
    double = c**2 - s**2, 2 * c * s
    triple = double[0] * c - double[1] * s, double[0] * s + double[1] * c
    a0, *rest = coefficients
    pairs = zip(rest[::2], rest[1::2], ((c, s), double, triple), strict=True)
    return a0 + sum(a * cos + b * sin for a, b, (cos, sin) in pairs)


def expanded(terms, expressions):
    """Expand symbolic expressions until they contain only points and parameters."""
    argument = Argument("p", NAMES, (6,), "m", "points")
    result = Result("y", tuple(expressions), (len(expressions),), "1", "")
    return SymbolicFunction("f", "", "", (argument,), (result,), terms).expanded()[0]


def eliminated(points, c, s):
    """Eliminate the position of a platform from three circles with the centers A_i - R b_i.

    A_i are base points, and b_i are platform points. The first circle equation is subtracted from
    the other two equations. Both differences are linear in the platform position, and Cramer's rule
    solves them.
    """
    x, y = sp.symbols("x y", real=True)
    circles = [
        sp.expand((x + c * bx - s * by - ax) ** 2 + (y + s * bx + c * by - ay) ** 2 - rod**2)
        for (ax, ay), (bx, by), rod in zip(points, PINS, RODS, strict=True)
    ]
    one, *others = circles
    pair = [sp.expand(circle - one) for circle in others]
    M = sp.Matrix([[p.coeff(x), p.coeff(y)] for p in pair])
    v = -sp.Matrix([p.subs({x: 0, y: 0}) for p in pair])
    D = M.det()
    X, Y = M.adjugate() * v
    linear = one.coeff(x, 1).subs(y, 0) * X + one.coeff(y, 1).subs(x, 0) * Y
    return one.coeff(x, 2) * (X**2 + Y**2) + D * linear + D**2 * one.subs({x: 0, y: 0})


def test_triad_polynomial_equals_elimination_of_the_position():
    terms = Terms({})
    found = harmonics(expanded(terms, triad_polynomial(terms, Triad(POINTS, PINS, RODS))), C, S)
    ratio = None
    rng = np.random.default_rng(0)
    for _ in range(6):
        t = sp.Rational(int(rng.integers(-20, 20)), 7)
        place = {n: sp.Rational(int(rng.integers(-30, 30)), 11) for n in NAMES}
        c, s = (1 - t**2) / (1 + t**2), 2 * t / (1 + t**2)
        points = [(place[ax], place[ay]) for ax, ay in POINTS]
        value = eliminated(points, c, s) / found.xreplace(place | {C: c, S: s})
        ratio = ratio or value
        assert value == ratio


def test_the_fourth_harmonic_cancels():
    # The square |k_3 u_2 - k_2 u_3|^2 has factors of degree 2.
    z, k0, l0 = sp.symbols("z k0 l0")
    k1, l1, b2, b3, a2, a3 = sp.symbols("k1 l1 b2 b3 a2 a3")
    k1c, l1c, b2c, b3c, a2c, a3c = sp.symbols("k1c l1c b2c b3c a2c a3c")
    N = (l0 + l1 * z + l1c / z) * (b2 * z - a2) - (k0 + k1 * z + k1c / z) * (b3 * z - a3)
    conjugated = (l0 + l1c / z + l1 * z) * (b2c / z - a2c) - (k0 + k1c / z + k1 * z) * (
        b3c / z - a3c
    )
    square = sp.expand(N * conjugated)
    assert square.coeff(z, 4) == 0
    assert square.coeff(z, 3) != 0


@pytest.fixture(scope="module")
def compiled():
    """Compile functions for a triad's polynomial, platform position and mirrored position."""
    terms = Terms({})
    phi = sp.Symbol("phi", real=True)
    cs = terms.cos_sin(phi)
    p = Argument("p", NAMES, (6,), "m", "points")
    angle = Argument("phi", (phi,), (), "rad", "angle")
    a = triad_polynomial(terms, Triad(POINTS, PINS, RODS))
    functions = [
        SymbolicFunction("a", "", "", (p,), (Result("a", a, (7,), "1", ""),), terms),
        *(
            SymbolicFunction(
                name,
                "",
                "",
                (p, angle),
                (Result("x", way(terms, Triad(POINTS, PINS, RODS), *cs), (2,), "m", ""),),
                terms,
            )
            for name, way in (("position", triad_position), ("mirror", triad_mirror))
        ),
    ]
    return [lambda *x, f=f: np.array(f(*x)).ravel() for f in lower(functions, "triad")]


def platform_with(pose, directions):
    pins = np.array(PINS, float) @ np.array(
        [[np.cos(pose[2]), np.sin(pose[2])], [-np.sin(pose[2]), np.cos(pose[2])]]
    )
    lines = np.stack([np.cos(directions), np.sin(directions)], -1)
    return (pose[:2] + pins - np.array(RODS, float)[:, None] * lines).ravel()


def test_every_pose_is_a_root_and_its_position_is_recovered(compiled):
    polynomial, position, _ = compiled
    rng = np.random.default_rng(1)
    for _ in range(300):
        pose = np.append(rng.uniform(-1, 1, 2), rng.uniform(-np.pi, np.pi))
        p = platform_with(pose, rng.uniform(-np.pi, np.pi, 3))
        a = polynomial(p)
        assert 1e-3 < np.abs(a).max() < 1e3
        assert abs(harmonics(a, np.cos(pose[2]), np.sin(pose[2]))) < 1e-13 * max(abs(a))
        np.testing.assert_allclose(position(p, pose[2]), pose[:2], atol=1e-7)


def test_collinear_centers_give_double_root_and_both_positions(compiled):
    polynomial, position, mirror = compiled
    pose = np.array([0.3, -0.2, 0.7])
    # The centers of the circles of possible platform positions are on a line parallel to the base's
    # x axis.
    heights = np.arcsin(0.25 / np.array(RODS, float))
    p = platform_with(pose, heights)
    a = polynomial(p)
    values = [harmonics(a, np.cos(0.7 + d), np.sin(0.7 + d)) for d in (-1e-4, 0, 1e-4)]
    # The assembly polynomial has a double root at the angle 0.7.
    assert abs(values[1]) < 1e-14
    assert values[0] * values[2] > 0
    assert 1e-12 < abs(values[0]) < 1e-4
    found = sorted([position(p, 0.7), mirror(p, 0.7)], key=lambda v: v[1])
    np.testing.assert_allclose(found, [[0.3, -0.7], [0.3, -0.2]], atol=1e-12)


def test_polynomial_has_double_root_where_rods_stay_parallel(compiled):
    terms = Terms({})
    rods = [sp.Rational(1, 2)] * 3
    a = triad_polynomial(terms, Triad(POINTS, PINS, rods))
    place = dict(zip(NAMES, (v for pin in PINS for v in pin), strict=True))
    found = harmonics(expanded(terms, a), C, S).subs(place)
    # At the angle 0, the platform pins coincide with the first rod ends.
    assert found.subs({C: 1, S: 0}) == 0
    assert sp.diff(found, S).subs({C: 1, S: 0}) == 0
