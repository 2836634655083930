"""Subproblems 5 and 6 find all planted solutions, including double roots."""

import itertools

import casadi as ca
import mpmath
import numpy as np
import pytest
import sympy as sp

from chasles.derive.inverse.subproblems.quartic import circle_roots
from chasles.derive.inverse.subproblems.sp5 import sp5
from chasles.derive.inverse.subproblems.sp6 import sp6
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms

SIGNS = sp.symbols("sign1:3", real=True)
BRANCHES = list(itertools.product((1.0, -1.0), repeat=2))
NEAR_DOUBLE = (0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4)
NEAR_AXIS = (0.0, 1e-12, 1e-10, 1e-9, 3e-9, 1e-8, 3e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)


def lowered(terms, symbols, values):
    """Compile symbolic expressions to a CasADi function of a vector and two branch signs."""
    arguments = (
        Argument("x", tuple(symbols), (len(symbols),), "", ""),
        Argument("signs", SIGNS, (2,), "", ""),
    )
    result = Result("y", tuple(values), (len(values),), "", "")
    return lower([SymbolicFunction("f", "F.", "", arguments, (result,), terms)], "test")[0]


def slots(function, X):
    """Evaluate a function for all four pairs of branch signs.

    The results have the shape (N, 4, outputs).
    """
    values = [
        np.array(function(ca.DM(X.T), ca.DM(np.tile(np.array([signs]).T, (1, len(X))))))
        for signs in BRANCHES
    ]
    return np.stack(values).transpose(2, 0, 1)


def angles_of(turns, limit=1e-15):
    """Return the angles of (cosine, sine) pairs, which must have norm 1."""
    np.testing.assert_allclose(np.hypot(turns[..., 0], turns[..., 1]), 1, rtol=0, atol=limit)
    return np.arctan2(turns[..., 1], turns[..., 0])


def wrapped(angle):
    return np.abs(np.angle(np.exp(1j * angle)))


@pytest.fixture(scope="module")
def solve6():
    terms, v = Terms({}), sp.symbols("v1:11", real=True)
    A1, A2 = ((v[0], v[1]), (v[2], v[3])), ((v[4], v[5]), (v[6], v[7]))
    found = sp6(terms, A1, A2, (v[8], v[9]), SIGNS)
    turns = found.first, found.second
    outputs = [*(x for turn in turns for x in (turn.c, turn.s)), found.margin]
    function = lowered(terms, v, outputs)

    def solve(X):
        """Return angles (N, 4, 2), relative residuals (N, 4) and margins (N, 4) of subproblem
        6."""
        Y = slots(function, X)
        angles = np.stack([angles_of(Y[..., 2 * k : 2 * k + 2]) for k in range(2)], -1)
        x = Y[..., [1, 0, 3, 2]]
        error = np.einsum("nij,nkj->nki", rows_of(X), x) - X[:, None, 8:10]
        return angles, np.abs(error).max(-1) / np.abs(X).max(1)[:, None], Y[..., 4]

    return solve


def rows_of(X):
    return np.stack([X[:, [0, 1, 4, 5]], X[:, [2, 3, 6, 7]]], 1)


def planted6(A, angles):
    x = np.stack([f(t) for t in angles for f in (np.sin, np.cos)], -1)
    return np.concatenate([A, np.einsum("nij,nj->ni", rows_of(A), x)], 1)


def random6(seed, N):
    generator = np.random.default_rng(seed)
    return generator, generator.normal(size=(N, 8)), generator.uniform(-np.pi, np.pi, (2, N))


def assert_solved(residual, margin, limit=1e-12):
    assert residual.min(1).max() <= limit
    assert residual[margin >= 0].max() <= limit


def test_sp6_recovers_planted_angle_pairs(solve6):
    _, A, planted = random6(1, 2_000)
    angles, residual, margin = solve6(planted6(A, planted))
    assert_solved(residual, margin, 1e-14)
    off = wrapped(angles - planted.T[:, None, :]).max(-1).min(1)
    assert off.max() < 1e-7


def test_sp6_solution_count_matches_real_roots(solve6):
    generator, A, planted = random6(2, 40)
    X = np.concatenate([planted6(A, planted), generator.normal(size=(40, 10))])
    angles, residual, margin = solve6(X)
    exists = margin >= 0
    assert residual[exists].max() < 1e-14
    assert residual[~exists].min() > 1e-9
    counts = [real_roots(row) for row in X]
    assert set(counts) == {0, 2, 4}
    for k, count in enumerate(counts):
        distinct = {tuple(np.round(np.exp(1j * pair), 6)) for pair in angles[k, exists[k]]}
        assert len(distinct) == count


def real_roots(X):
    """Eliminate theta1, and count the real solutions theta2.

    For a real theta2, the root exp(i theta2) has modulus 1.
    """
    with mpmath.workdps(30):
        a, b, c, d = (mpmath.mpf(x) for x in X[:4])
        adjugate = mpmath.matrix([[d, -b], [-c, a]])
        constant = adjugate * mpmath.matrix(list(X[8:]))
        M = -adjugate * mpmath.matrix([list(X[4:6]), list(X[6:8])])
        polynomial = [mpmath.mpc(0)] * 5
        polynomial[2] -= (a * d - b * c) ** 2
        for i in range(2):
            s, k = M[i, 0] / mpmath.mpc(0, 2), M[i, 1] / 2
            factor = (k + s, constant[i], k - s)
            for m, n in itertools.product(range(3), repeat=2):
                polynomial[m + n] += factor[m] * factor[n]
        roots = mpmath.polyroots(polynomial, maxsteps=200, extraprec=200)
        return sum(abs(abs(root) - 1) < 1e-12 for root in roots)


def singular(A, generator, first, second):
    """Return matrices A with proportional columns for theta1 (``first``) or theta2 (``second``)."""
    A = A.copy()
    if first:
        A[:, 2:4] = generator.normal(size=(len(A), 1)) * A[:, :2]
    if second:
        A[:, 6:8] = generator.normal(size=(len(A), 1)) * A[:, 4:6]
    return A


def circles(generator, N):
    """Return random 2x2 matrices (N, 4), each a rotation times a positive factor."""
    radius, angle = generator.uniform(0.1, 2, N), generator.uniform(-np.pi, np.pi, N)
    c, s = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([c, -s, s, c], 1)


def test_sp6_solves_degenerate_coefficients(solve6):
    generator, A, planted = random6(3, 500)
    N = len(A)
    multiple = generator.normal(size=(N, 1))
    cases = {
        "A1 singular": singular(A, generator, True, False),
        "A1 and A2 singular": singular(A, generator, True, True),
        "rank 1": np.concatenate(
            [A[:, :2], multiple * A[:, :2], A[:, 4:6], multiple * A[:, 4:6]], 1
        ),
        "no second equation": A * [1, 1, 0, 0, 1, 1, 0, 0],
        "no theta1": A * [0, 0, 0, 0, 1, 1, 1, 1],
        "nothing": A * 0,
        "two circles": np.concatenate([circles(generator, N), circles(generator, N)], 1),
        "circle and ellipse": np.concatenate([circles(generator, N), A[:, 4:]], 1),
        "theta2 small": A * np.repeat([[1, 0]], 4, 1).reshape(1, 8)
        + A * np.repeat([[0, 1]], 4, 1) * 10 ** generator.uniform(-9, 0, (N, 1)),
        "of every size": A * 10 ** generator.uniform(-6, 0, (N, 8)),
    }
    for name, coefficients in cases.items():
        X = planted6(coefficients, planted)
        X[:, 9] += name == "nothing"
        _, residual, margin = solve6(X)
        if name == "nothing":
            assert np.isfinite(residual).all()
            continue
        assert_solved(residual, margin)


def test_sp6_solves_right_angles_and_integer_coefficients(solve6):
    generator, A, _ = random6(4, 2_000)
    right = generator.integers(0, 4, (2, len(A))) * np.pi / 2
    whole = generator.integers(-1, 2, A.shape).astype(float)
    for X in (planted6(whole, right), np.rint(planted6(whole, right)), planted6(A, right)):
        _, residual, margin = solve6(X[np.abs(X).max(1) > 0])
        assert_solved(residual, margin)


@pytest.mark.parametrize("distance", NEAR_DOUBLE)
def test_sp6_solves_near_double_roots(solve6, distance):
    generator, A, planted = random6(5, 500)
    along = np.stack([f(t) for t in planted for f in (np.cos, lambda t: -np.sin(t))], -1)
    first, second = (
        np.einsum("nij,nj->ni", rows_of(A)[:, :, k : k + 2], along[:, k : k + 2]) for k in (0, 2)
    )
    factor = generator.normal(size=(len(A), 1))
    change = factor * first - second + distance * generator.normal(size=second.shape)
    A[:, 4:] += (change[:, :, None] * along[:, None, 2:]).reshape(len(A), 4)
    _, residual, margin = solve6(planted6(A, planted))
    assert_solved(residual, margin)


def test_sp6_out_of_reach_is_finite_with_negative_margin(solve6):
    generator, A, _ = random6(6, 500)
    b = generator.normal(size=(len(A), 2)) * 10 ** generator.uniform(2, 9, (len(A), 1))
    angles, _, margin = solve6(np.concatenate([A, b], 1))
    assert np.isfinite(angles).all()
    assert margin.max() < 0


def test_sp6_with_constant_coefficients_satisfies_both_equations():
    terms, v = Terms({}), sp.symbols("v1:3", real=True)
    A1, A2 = ((sp.S(2), sp.S(0)), (sp.S(0), sp.sqrt(2))), ((sp.S(1), sp.S(0)), (sp.S(0), sp.S(1)))
    found = sp6(terms, A1, A2, v, SIGNS)
    function = lowered(terms, v, (found.first.s, found.first.c, found.second.s, found.second.c))
    rows = np.array([[2, 0, 1, 0], [0, np.sqrt(2), 0, 1]])
    t = np.random.default_rng(7).uniform(-np.pi, np.pi, (2, 1000))
    b = np.stack([f(x) for x in t for f in (np.sin, np.cos)], -1) @ rows.T
    error = np.abs(slots(function, b) @ rows.T - b[:, None]).max(-1)
    assert error.min(1).max() < 1e-14


@pytest.fixture(scope="module")
def roots():
    terms, v = Terms({}), sp.symbols("v1:6", real=True)
    root = circle_roots(terms, v[0], v[1:3], v[3:5], SIGNS)
    function = lowered(terms, v, (root.turn.c, root.turn.s, root.margin))

    def solve(X):
        """Return four roots per polynomial, the polynomial values and the margins, each (N, 4)."""
        Y = slots(function, X)
        phi = angles_of(Y, 1e-14)
        a0, a1, b1, a2, b2 = X.T[:, :, None]
        value = a0 + a1 * np.cos(phi) + b1 * np.sin(phi)
        return phi, value + a2 * np.cos(2 * phi) + b2 * np.sin(2 * phi), Y[..., 2]

    return solve


def polynomial_of(angles):
    """Return the coefficients of trigonometric polynomials with four specified roots each.

    Each row of `angles` contains the four roots phi of sum(c_k e^(i k phi)), k = -2 ... 2. The
    largest absolute value of the real coefficients in a row is 1.
    """
    coefficients = []
    for row in angles:
        c = np.poly(np.exp(1j * row)) * np.exp(-0.5j * row.sum())
        coefficients.append(
            [c[2].real, 2 * c[1].real, -2 * c[1].imag, 2 * c[0].real, -2 * c[0].imag]
        )
    coefficients = np.array(coefficients)
    return coefficients / np.abs(coefficients).max(1)[:, None]


@pytest.mark.parametrize(("equal", "near"), [(1, 1e-8), (2, 1e-5), (3, 1e-2), (4, 1e-2)])
def test_repeated_trigonometric_roots_are_found(roots, equal, near):
    generator = np.random.default_rng(equal)
    angles = generator.uniform(-np.pi, np.pi, (500, 4))
    angles[:, :equal] = angles[:, :1]
    phi, value, _ = roots(polynomial_of(angles))
    # Rounding errors separate n equal roots by about the nth root of 1e-16.
    assert np.abs(value).min(1).max() < 1e-12
    off = wrapped(phi[:, :, None] - angles[:, None, :]).min(1).max()
    assert off < near


def test_lower_degree_trigonometric_polynomials_are_solved(roots):
    generator = np.random.default_rng(9)
    phi0 = generator.uniform(-np.pi, np.pi, 500)
    basis = np.stack([np.cos(phi0), np.sin(phi0), np.cos(2 * phi0), np.sin(2 * phi0)], 1)
    for kept in (
        (1, 1, 0, 0),
        (0, 0, 1, 1),
        (1, 0, 1, 0),
        (0, 1, 1, 0),
        (1, 0, 0, 0),
        (0, 1, 0, 1),
    ):
        for scale in (1.0, 1e-3, 1e-8, 1e-12, 1e-16):
            a = generator.normal(size=basis.shape) * kept * [1, 1, scale, scale]
            a0 = -(a * basis).sum(1, keepdims=True)
            X = np.concatenate([a0, a], 1)
            X = X / np.abs(X).max(1)[:, None]
            _, value, margin = roots(X)
            assert np.abs(value).min(1).max() < 1e-13
            assert np.abs(value[margin >= 0]).max() < 1e-13


@pytest.fixture(scope="module")
def solve5():
    terms, v = Terms({}), sp.symbols("v1:22", real=True)
    found = sp5(terms, *(v[3 * k : 3 * k + 3] for k in range(7)), SIGNS)
    turns = found.first, found.second, found.third
    outputs = [*(x for turn in turns for x in (turn.c, turn.s)), found.margin]
    function = lowered(terms, v, outputs)

    def solve(p0, k1, p1, k2, p2, k3, p3):
        """Return angles (N, 4, 3), relative closure errors (N, 4) and margins (N, 4)."""
        Y = slots(function, np.concatenate([p0, k1, p1, k2, p2, k3, p3], 1))
        angles = np.stack([angles_of(Y[..., 2 * k : 2 * k + 2]) for k in range(3)], -1)
        p0, k1, p1, k2, p2, k3, p3 = (x[:, None] for x in (p0, k1, p1, k2, p2, k3, p3))
        one, two, three = (Y[..., 2 * k : 2 * k + 2] for k in range(3))
        gap = p0 + turned(k1, one, p1) - turned(k2, two, p2 + turned(k3, three, p3))
        size = np.sqrt(sum((x**2).sum(-1) for x in (p0, p1, p2, p3)))
        return angles, np.abs(gap).max(-1) / size, Y[..., 6]

    return solve


def turned(k, turn, p):
    """Rotate vectors by Rodrigues' formula."""
    c, s = turn[..., :1], turn[..., 1:]
    along = k * (k * p).sum(-1, keepdims=True)
    return along + c * (p - along) + s * np.cross(k, p)


def pair(angle):
    return np.stack([np.cos(angle), np.sin(angle)], -1)


def closing(t, k1, p1, k2, p2, k3, p3):
    """Return the vectors of a loop.

    The vector p0 is chosen so that the loop closes at the angles t.
    """
    w = p2 + turned(k3, pair(t[2]), p3)
    return turned(k2, pair(t[1]), w) - turned(k1, pair(t[0]), p1), k1, p1, k2, p2, k3, p3


def random5(seed, N):
    generator = np.random.default_rng(seed)
    k1, k2, k3, p1, p2, p3 = generator.normal(size=(6, N, 3))
    k1, k2, k3 = (k / np.linalg.norm(k, axis=1, keepdims=True) for k in (k1, k2, k3))
    return generator, (k1, p1, k2, p2, k3, p3), generator.uniform(-np.pi, np.pi, (3, N))


def test_sp5_recovers_planted_angle_triples(solve5):
    _, vectors, planted = random5(11, 2_000)
    angles, residual, margin = solve5(*closing(planted, *vectors))
    assert_solved(residual, margin, 1e-14)
    off = wrapped(angles - planted.T[:, None, :]).max(-1).min(1)
    assert off.max() < 1e-7


@pytest.mark.parametrize("distance", NEAR_AXIS)
def test_sp5_is_accurate_near_the_second_axis(solve5, distance):
    generator, (k1, p1, k2, p2, k3, p3), planted = random5(12, 500)
    w = p2 + turned(k3, pair(planted[2]), p3)
    p2 = p2 - (w - k2 * (w * k2).sum(1, keepdims=True)) + distance * generator.normal(size=w.shape)
    _, residual, margin = solve5(*closing(planted, k1, p1, k2, p2, k3, p3))
    assert residual.min(1).max() < 1e-12
    assert residual[margin >= 0].max() < 1e-9


def test_sp5_solves_axes_at_right_angles(solve5):
    """Test all combinations of coordinate axes and angles that are multiples of 90 degrees."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    grid = np.array(list(itertools.product(range(3), range(6), range(6), *[range(4)] * 3)))
    k1, k2, k3 = (axes[grid[:, k]] for k in range(3))
    t = grid[:, 3:].T * np.pi / 2
    generator, checked = np.random.default_rng(13), 0
    for make in (
        lambda: generator.integers(-2, 3, k1.shape).astype(float),
        lambda: generator.normal(size=k1.shape),
    ):
        vectors = closing(t, k1, make(), k2, make(), k3, make())
        _, residual, margin = solve5(*vectors)
        assert residual.min(1).max() < 1e-12
        assert residual[margin >= 0].max() < 1e-9
        checked += len(t.T)
    assert checked == 2 * 6912


def test_sp5_out_of_reach_is_finite_with_negative_margin(solve5):
    _, (k1, p1, k2, p2, k3, p3), _ = random5(14, 500)
    angles, residual, margin = solve5(100 * p2, k1, p1, k2, p2, k3, p3)
    assert np.isfinite(angles).all()
    out = residual.min(1) > 1e-9
    assert out.mean() > 0.9
    assert margin[out].max() < 0
