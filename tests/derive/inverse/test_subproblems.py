"""Tests subproblems 1 to 4 and subproblems with prismatic joints.

Each subproblem target has a known solution, or is at the border of the reachable targets.
"""

import itertools

import casadi as ca
import numpy as np
import pytest
import sympy as sp

from chasles.derive.inverse.subproblems.slides import slide_to_plane, slide_to_sphere
from chasles.derive.inverse.subproblems.sp1 import sp1
from chasles.derive.inverse.subproblems.sp2 import sp2
from chasles.derive.inverse.subproblems.sp3 import sp3, squared_across
from chasles.derive.inverse.subproblems.sp4 import sp4
from chasles.derive.inverse.subproblems.turns import direction
from chasles.derive.model import tolerances
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms

SIGN = sp.Symbol("sign", real=True)
N = 500
ANGLES = np.linspace(-np.pi, np.pi, 721)
DIRECTION_FLOOR = tolerances.DIRECTION_FLOOR
MEETING_SOLUTIONS = float(tolerances.MEETING_SOLUTIONS)
NEAR = (0.0, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3)


def symbols(*names):
    return [tuple(sp.symbols(f"{name}1:4", real=True)) for name in names]


def compiled(terms, inputs, outputs):
    """Compile a function that computes an array (M, outputs) from inputs (M, n) and a sign."""
    flat = tuple(x for value in inputs for x in (value if isinstance(value, tuple) else (value,)))
    arguments = (Argument("x", flat, (len(flat),), "", ""), Argument("sign", (SIGN,), (1,), "", ""))
    result = Result("y", tuple(outputs), (len(outputs),), "", "")
    f = lower([SymbolicFunction("f", "F.", "", arguments, (result,), terms)], "test")[0]

    def call(sign, *values):
        X = np.concatenate([np.reshape(value, (len(values[0]), -1)) for value in values], axis=1)
        return np.array(f(ca.DM(X.T), ca.DM(np.full((1, len(X)), sign)))).T

    return call


def turned(k, angle, v):
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = k * np.sum(k * v, axis=1, keepdims=True)
    return along + c * (v - along) + s * np.cross(k, v)


def angle_of(pairs):
    np.testing.assert_allclose(np.hypot(*pairs.T), 1, rtol=0, atol=1e-15)
    return np.arctan2(pairs[:, 1], pairs[:, 0])


def wrapped(angle):
    return np.abs(np.angle(np.exp(1j * angle)))


def rows(rng, count=N):
    return rng.normal(size=(count, 3))


def units(rng, count=N):
    v = rows(rng, count)
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def nearest(distance):
    """Return the minimum of a function on a grid of angles."""
    return np.min([distance(np.full(1, angle)) for angle in ANGLES])


@pytest.fixture(scope="module")
def solve1():
    terms, (k, p, v) = Terms({}), symbols("k", "p", "v")
    turn = sp1(terms, k, p, v).turn
    return compiled(terms, (k, p, v), (turn.c, turn.s))


@pytest.fixture(scope="module")
def solve2():
    terms, vectors = Terms({}), symbols("k", "l", "p", "v")
    first, second = sp2(terms, *vectors, SIGN)
    found = (first.turn.c, first.turn.s, second.turn.c, second.turn.s, first.margin)
    return compiled(terms, vectors, found)


@pytest.fixture(scope="module")
def solve3():
    terms, (k, p0, p, total) = Terms({}), symbols("k", "q", "p", "w")
    across2 = squared_across(terms, k, total, (p0, p))
    found = sp3(terms, k, p0, p, across2, SIGN)
    return compiled(terms, (k, p0, p, total), (found.turn.c, found.turn.s, found.margin))


@pytest.fixture(scope="module")
def solve4():
    terms, (h, k, p), d = Terms({}), symbols("h", "k", "p"), sp.Symbol("d", real=True)
    found = sp4(terms, h, k, p, d, SIGN)
    return compiled(terms, (h, k, p, d), (found.turn.c, found.turn.s, found.margin))


@pytest.fixture(scope="module")
def solve_sphere():
    terms, (u, p), r2 = Terms({}), symbols("u", "p"), sp.Symbol("r", real=True)
    found = slide_to_sphere(terms, u, p, r2, SIGN)
    return compiled(terms, (u, p, r2), (found.length, found.margin))


def test_direction_matches_atan2_and_is_zero_for_zero_vector():
    terms, (x, y) = Terms({}), sp.symbols("x y", real=True)
    turn = direction(terms, x, y)
    f = compiled(terms, (x, y), (turn.c, turn.s))
    np.testing.assert_array_equal(f(1, np.zeros((1, 1)), np.zeros((1, 1))), [[1, 0]])
    v = rows(np.random.default_rng(0))[:, :2] * 10.0 ** np.arange(-120, 80, 0.4)[:, None]
    there, back = f(1, v[:, :1], v[:, 1:]), f(1, -v[:, :1], -v[:, 1:])
    assert wrapped(angle_of(there) - np.arctan2(v[:, 1], v[:, 0])).max() < 5e-16
    assert np.abs(there + back).max() < 5e-16


def test_sp1_recovers_planted_angle(solve1):
    rng = np.random.default_rng(1)
    k, p, angle = units(rng), rows(rng), rng.uniform(-np.pi, np.pi, N)
    found = angle_of(solve1(1, k, p, turned(k, angle, p)))
    assert wrapped(found - angle).max() < 1e-12


def test_sp1_is_accurate_near_the_axis(solve1):
    rng = np.random.default_rng(11)
    k, angle = units(rng), rng.uniform(-np.pi, np.pi, N)
    p = k + 1e-6 * units(rng)
    assert wrapped(angle_of(solve1(1, k, p, turned(k, angle, p))) - angle).max() < 1e-7


def test_sp1_returns_nearest_angle_if_unreachable(solve1):
    rng = np.random.default_rng(2)
    k, p, v = units(rng, 20), rows(rng, 20), rows(rng, 20)
    found = angle_of(solve1(1, k, p, v))
    for row in range(20):
        one = slice(row, row + 1)

        def away(angle, one=one):
            return np.linalg.norm(turned(k[one], angle, p[one]) - v[one])

        assert away(found[one]) <= nearest(away) + 1e-12


def test_sp1_returns_zero_if_angle_is_arbitrary(solve1):
    k = np.eye(3)
    np.testing.assert_array_equal(solve1(1, k, 2 * k, rows(np.random.default_rng(3), 3))[:, 1], 0)


def test_sp4_recovers_planted_angle_and_both_signs_solve(solve4):
    rng = np.random.default_rng(4)
    h, k, p, angle = rows(rng), units(rng), rows(rng), rng.uniform(-np.pi, np.pi, N)
    d = np.sum(h * turned(k, angle, p), axis=1)
    found = [solve4(sign, h, k, p, d) for sign in (1, -1)]
    angles = [angle_of(y[:, :2]) for y in found]
    for a, y in zip(angles, found, strict=True):
        size = np.linalg.norm(h, axis=1) * np.linalg.norm(p, axis=1)
        assert (np.abs(np.sum(h * turned(k, a, p), axis=1) - d) / size).max() < 2e-15
        assert y[:, 2].min() >= 0
        half = np.sin((angles[0] - angles[1]) / 2) ** 2
        np.testing.assert_allclose(y[:, 2], half, atol=1e-12)
    assert np.min([wrapped(a - angle) for a in angles], axis=0).max() < 1e-7


def test_sp4_sign_selects_rotation_sense(solve4):
    k, h = np.array([[0, 0, 1.0]]), np.array([[1.0, 0, 0]])
    for sign in (1, -1):
        found = angle_of(solve4(sign, h, k, h, np.array([0.5]))[:, :2])
        assert found[0] == pytest.approx(sign * np.pi / 3, abs=1e-15)


def test_sp4_on_a_line_through_the_center_has_opposite_solutions():
    terms, p = Terms({}), sp.symbols("p1:4", real=True)
    zero, one = sp.Integer(0), sp.Integer(1)
    found = sp4(terms, (one, zero, zero), (zero, zero, one), p, zero, SIGN)
    assert found.margin is None
    f = compiled(terms, (p,), (found.turn.c, found.turn.s))
    P = rows(np.random.default_rng(12))
    np.testing.assert_array_equal(f(1, P), -f(-1, P))
    K = np.tile([[0, 0, 1.0]], (N, 1))
    assert np.abs(turned(K, angle_of(f(1, P)), P)[:, 0]).max() < 4e-15


@pytest.mark.parametrize(("side", "angle"), [(1, 0.0), (-1, np.pi)])
def test_sp4_angle_and_margin_are_accurate_at_the_boundary(solve4, side, angle):
    k, h = np.array([[0, 0, 1.0]]), np.array([[1.0, 0, 0]])
    margins = []
    for by in NEAR:
        for sign in (1, -1):
            inside, beyond = (
                solve4(sign, h, k, h, np.array([side * (1 - way * by)]))[0] for way in (1, -1)
            )
            assert wrapped(np.arctan2(beyond[1], beyond[0]) - angle) < 1e-15
            assert abs(inside[0] - side * (1 - by)) <= 4e-15
            margins += [(by, inside[2], beyond[2])]
    for by, inside, beyond in margins:
        assert inside == pytest.approx(by * (2 - by), abs=4e-16)
        assert beyond == pytest.approx(-by * (2 + by), abs=4e-16)


def test_sp4_is_nearest_out_of_reach_and_zero_if_arbitrary(solve4):
    rng = np.random.default_rng(5)
    h, k, p = rows(rng, 20), units(rng, 20), rows(rng, 20)
    d = 10 * rng.choice((-1, 1), 20) * np.linalg.norm(h, axis=1) * np.linalg.norm(p, axis=1)
    y = solve4(1, h, k, p, d)
    assert y[:, 2].max() < 0
    for row, found in enumerate(angle_of(y[:, :2])):
        one = slice(row, row + 1)

        def away(angle, one=one):
            return np.abs(np.sum(h[one] * turned(k[one], angle, p[one])) - d[one])[0]

        assert away(np.array([found])) <= nearest(away) + 1e-12
    upright = np.tile([[0, 0, 1.0]], (20, 1))
    along = solve4(1, h, upright, upright, h[:, 2])
    np.testing.assert_array_equal(along[:, :2], np.tile([[1, 0]], (20, 1)))


def test_sp2_recovers_planted_angle_pair(solve2):
    rng = np.random.default_rng(6)
    k, m, p = units(rng), units(rng), rows(rng)
    planted = rng.uniform(-np.pi, np.pi, (2, N))
    v = turned(k, planted[0], turned(m, planted[1], p))
    off = []
    for sign in (1, -1):
        y = solve2(sign, k, m, p, v)
        first, second = angle_of(y[:, :2]), angle_of(y[:, 2:4])
        error = np.linalg.norm(turned(k, first, turned(m, second, p)) - v, axis=1)
        apart = np.linalg.norm(np.cross(k, m), axis=1)
        assert (error * apart / np.linalg.norm(p, axis=1)).max() < 1e-14
        assert y[:, 4].min() > -1e-14
        off.append(np.max(wrapped(np.stack([first, second]) - planted), axis=0))
    assert np.min(off, axis=0).max() < 1e-5


def test_sp2_is_accurate_near_the_second_axis(solve2):
    rng = np.random.default_rng(7)
    k, m = np.tile([[0, 0, 1.0]], (200, 1)), np.tile([[1.0, 0, 0]], (200, 1))
    for by in (1e-3, 1e-6, 1e-9, 1e-12):
        p = m + by * units(rng, 200)
        planted = rng.uniform(-np.pi, np.pi, (2, 200))
        v = turned(k, planted[0], turned(m, planted[1], p))
        for sign in (1, -1):
            y = solve2(sign, k, m, p, v)
            back = turned(k, angle_of(y[:, :2]), turned(m, angle_of(y[:, 2:4]), p))
            assert np.linalg.norm(back - v, axis=1).max() < 1e-9 * by + 1e-15


def test_sp2_out_of_reach_has_negative_margin(solve2):
    k, m = np.array([[0, 0, 1.0]]), np.array([[1.0, 0, 0]])
    # The axis of the second rotation is the unit vector x, so only the first rotation moves x, in
    # the plane z = 0. The target vector is outside the plane z = 0.
    y = solve2(1, k, m, m, np.array([[0, 0.6, 0.8]]))
    assert y[0, 4] < 0
    assert np.isfinite(y).all()


def test_sp2_out_of_reach_is_finite_where_the_second_angle_is_arbitrary():
    """The first angle of subproblem 2 is its least-squares angle.

    This angle rotates v onto the second axis.
    """
    terms, (v,) = Terms({}), symbols("v")
    k, m, p = [tuple(map(sp.Rational, row)) for row in ("001", "100", ("2", "1/2", "0"))]
    first, second = sp2(terms, k, m, p, v, SIGN)
    found = (first.turn.c, first.turn.s, second.turn.c, second.turn.s, first.margin)
    y = compiled(terms, (v,), found)(1, np.array([[1.0, 0, 0]]))
    assert y[0, 4] < 0
    np.testing.assert_array_equal(y[0, :4], [1, 0, 1, 0])


def test_sp2_guards_no_division_if_both_angles_always_exist():
    terms, v = Terms({}), sp.symbols("v1:4", real=True)
    zero, one = sp.Integer(0), sp.Integer(1)
    first, _ = sp2(terms, (zero, zero, one), (one, zero, zero), (zero, one, zero), v, SIGN)
    assert first.margin is None
    floors = [value for value in terms.definitions.values() if value.has(DIRECTION_FLOOR)]
    assert len(floors) == 1  # the first angle is arbitrary if v is parallel to z


def test_sp3_recovers_planted_angle_and_both_signs_solve(solve3):
    rng = np.random.default_rng(8)
    k, p0, p, angle = units(rng), rows(rng), rows(rng), rng.uniform(-np.pi, np.pi, N)
    total = p0 + turned(k, angle, p)
    away = units(rng) * np.linalg.norm(total, axis=1, keepdims=True)
    off = []
    for sign in (1, -1):
        y = solve3(sign, k, p0, p, away)
        found = angle_of(y[:, :2])
        length = np.linalg.norm(p0 + turned(k, found, p), axis=1)
        size = np.linalg.norm(p0, axis=1) + np.linalg.norm(p, axis=1)
        assert (np.abs(length - np.linalg.norm(total, axis=1)) / size).max() < 1e-7
        assert y[:, 2].min() > -1e-14
        off.append(wrapped(found - angle))
    assert np.min(off, axis=0).max() < 1e-6


@pytest.mark.parametrize(("P", "Q"), [("1", "1"), ("2", "1/2")])
def test_sp3_with_constant_lengths_is_accurate_at_both_ends(P, Q):
    """The sine and the margin of a stretched or folded elbow are accurate, not only the cosine."""
    terms, square = Terms({}), sp.Symbol("D", real=True)
    zero, one = sp.Integer(0), sp.Integer(1)
    p0, p = (sp.Rational(P), zero, zero), (sp.Rational(Q), zero, zero)
    found = sp3(terms, (zero, zero, one), p0, p, square, SIGN)
    f = compiled(terms, (square,), (found.turn.c, found.turn.s, found.margin))
    P, Q = float(sp.Rational(P)), float(sp.Rational(Q))
    for end, angle in ((P + Q, 0.0), (abs(P - Q), np.pi)):
        for sign, by in itertools.product((1, -1), (1e-3, 1e-6)):
            phi = angle + sign * by
            D2 = (P - Q) ** 2 + 4 * P * Q * np.cos(phi / 2) ** 2
            y = f(sign, np.array([D2]))
            assert wrapped(angle_of(y[:, :2]) - (phi if angle == 0 else -phi))[0] < 1e-9
            assert y[0, 2] == pytest.approx(np.sin(phi) ** 2, rel=1e-3)
        beyond = f(1, np.array([(end + 0.1 if angle == 0 else max(end - 0.1, 0)) ** 2]))
        assert beyond[0, 2] < 0 or end == 0
        assert wrapped(angle_of(beyond[:, :2]) - angle)[0] < 1e-15


def test_sp3_folds_if_squared_distance_rounds_below_zero():
    terms, square = Terms({}), sp.Symbol("D", real=True)
    zero, one = sp.Integer(0), sp.Integer(1)
    found = sp3(terms, (zero, zero, one), (one, zero, zero), (zero, one, zero), square, SIGN)
    f = compiled(terms, (square,), (found.turn.c, found.turn.s, found.margin))
    for D2 in (-1e-16, -1e-300, 0.0):
        y = f(1, np.array([D2]))
        np.testing.assert_allclose(y[0, :2], [0, 1], atol=1e-15)
        assert abs(y[0, 2]) < 1e-15
    # If the squared distance is 1e-18 (distance 1e-9), the elbow does not count as folded.
    y = f(1, np.array([1e-18]))
    assert abs(y[0, 0]) == pytest.approx(1e-9, rel=1e-6)


@pytest.mark.parametrize(
    ("D2", "whole", "apart"),
    [
        (4 * (1 - MEETING_SOLUTIONS / 2), 4, 0),
        (4 * (1 - 3 * MEETING_SOLUTIONS), 4, 4 * np.sqrt(3 * MEETING_SOLUTIONS)),
        (MEETING_SOLUTIONS / 2, 1, 0),
        (MEETING_SOLUTIONS / 2, MEETING_SOLUTIONS / 2, 2 * np.sqrt(MEETING_SOLUTIONS / 2)),
    ],
    ids=["stretched", "nearly stretched", "folded", "nearly folded"],
)
def test_sp3_merges_solutions_that_rounding_does_not_separate(D2, whole, apart):
    """The squared distance D2 has the rounding error of a float of magnitude `whole`."""
    terms, square, size = Terms({}), *sp.symbols("D W", real=True)
    zero, one = sp.Integer(0), sp.Integer(1)
    p = (one, zero, zero)
    found = sp3(terms, (zero, zero, one), p, p, square, SIGN, rounding=size)
    f = compiled(terms, (square, size), (found.turn.c, found.turn.s))
    above, below = (angle_of(f(sign, [[D2]], [[whole]]))[0] for sign in (1, -1))
    assert wrapped(above - below) == pytest.approx(apart, rel=1e-3, abs=1e-15)


def test_sp3_with_variable_lengths_is_accurate_near_fold():
    """The vectors of subproblem 3 have lengths 1 and 1 + 3e-8, and the elbow is nearly folded."""
    terms, (p0, p) = Terms({}), symbols("a", "b")
    square = sp.Symbol("D", real=True)
    k = (sp.Integer(0), sp.Integer(0), sp.Integer(1))
    found = sp3(terms, k, p0, p, square, SIGN)
    f = compiled(terms, (p0, p, square), (found.turn.c, found.turn.s))
    P, Q = 1.0, 1.0 + 3e-8
    for bend in (1e-7, 1e-6, 1e-5):
        D2 = (P - Q) ** 2 + 4 * P * Q * np.sin(bend / 2) ** 2
        y = f(1, np.array([[P, 0, 0]]), np.array([[Q, 0, 0]]), np.array([D2]))
        off = np.arctan2(-y[0, 1], -y[0, 0])
        assert abs(off) == pytest.approx(bend, rel=1e-6)


def test_prismatic_step_moves_point_into_plane():
    terms, (h, u, p), d = Terms({}), symbols("h", "u", "p"), sp.Symbol("d", real=True)
    found = slide_to_plane(terms, h, u, p, d)
    assert found.sign is None
    assert found.margin is None
    f = compiled(terms, (h, u, p, d), (found.length,))
    rng = np.random.default_rng(9)
    h, u, p, d = rows(rng), units(rng), rows(rng), rng.normal(size=N)
    t = f(1, h, u, p, d)
    size = np.linalg.norm(h, axis=1) * (1 + np.abs(t[:, 0]))
    assert (np.abs(np.sum(h * (p + t * u), axis=1) - d) / size).max() < 1e-14


def test_prismatic_step_reaches_sphere_at_both_signs(solve_sphere):
    rng = np.random.default_rng(10)
    u, p, planted = units(rng), rows(rng), rng.normal(size=N)
    r2 = np.sum((p + planted[:, None] * u) ** 2, axis=1)
    off = []
    for sign in (1, -1):
        t, margin = solve_sphere(sign, u, p, r2).T
        back = np.sum((p + t[:, None] * u) ** 2, axis=1)
        assert (np.abs(back - r2) / (r2 + np.sum(p**2, axis=1))).max() < 1e-14
        assert margin.min() >= 0
        assert np.all(sign * (t + np.sum(u * p, axis=1)) >= 0)
        off.append(np.abs(t - planted))
    assert np.min(off, axis=0).max() < 1e-6


def test_prismatic_step_is_nearest_if_sphere_is_missed(solve_sphere):
    u, p = np.array([[1.0, 0, 0]]), np.array([[0.3, 2, 0]])
    margins = [solve_sphere(1, u, p, np.array([4 + by]))[0, 1] for by in (-1e-3, -1e-12, 0, 1e-12)]
    assert margins[0] < margins[1] < 0 == margins[2] < margins[3]
    for sign in (1, -1):
        assert solve_sphere(sign, u, p, np.array([1.0]))[0, 0] == -0.3


@pytest.mark.parametrize("is_parameter", [False, True])
def test_direction_of_constant_zero_is_zero_angle(is_parameter):
    a, y = sp.symbols("a y", real=True)
    terms = Terms({a: sp.Integer(0)})
    zero = terms.let(2 * a) if is_parameter else sp.Integer(0)
    turn = direction(terms, zero, zero)
    assert (float(terms.value(turn.c)), float(terms.value(turn.s))) == (1, 0)
    found = direction(terms, zero, y)
    at = compiled(terms, (y,), (found.c, found.s))(1, np.array([[0.0], [2.0], [-1e-9]]))
    np.testing.assert_allclose(at, [[1, 0], [0, 1], [0, -1]], rtol=0, atol=1e-15)


def test_direction_of_rounding_noise_is_zero_angle():
    """The function ``direction`` replaces rounding errors, such as 1e-17, by 0."""
    terms, noise = Terms({}), sp.Rational(1, 10**17)
    turn = direction(terms, noise, -noise)
    assert [float(terms.value(x)) for x in (turn.c, turn.s)] == [1.0, 0.0]
