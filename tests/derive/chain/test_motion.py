"""Time derivatives of named terms agree with SymPy, CasADi and mpmath."""

import casadi as ca
import mpmath
import numpy as np
import pytest
import sympy as sp

from chasles.derive.loops.solve.solved_loops import named
from chasles.derive.terms.casadi_graph import lower
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.tangents import Tangent
from chasles.derive.terms.terms import Terms
from tests.support.loops.mechanisms import four_bar, geared, slider_crank, slotted_rocker
from tests.support.loops.solved import solved

a, b, ad, bd, L = sp.symbols("a b ad bd L", real=True)


def written_out(terms, expression):
    while terms.definitions.keys() & expression.free_symbols:
        expression = expression.xreplace(terms.definitions)
    return terms.spelled(expression)


def test_tangent_applies_chain_rule_through_named_terms():
    terms = Terms({L: sp.Rational(1, 2)})
    c, s = terms.cos_sin(a + b)
    u = terms.let(L * c + b**2)
    v = terms.let(sp.sqrt(terms.let(u**2 + 1)) - s * u)
    found = written_out(terms, Tangent(terms, {a: ad, b: bd}).of(v))
    plain = written_out(terms, v)
    expected = sp.diff(plain, a) * ad + sp.diff(plain, b) * bd
    point = {a: 0.4, b: -0.7, ad: 0.3, bd: 1.9, L: 0.5}
    assert float((found - expected).subs(point)) == pytest.approx(0, abs=1e-14)


def test_symbols_without_rate_are_constant():
    terms = Terms({})
    u = terms.let(sp.cos(a) * b)
    assert Tangent(terms, {}).of(u) == 0
    assert written_out(terms, Tangent(terms, {b: bd}).of(u)) == sp.cos(a) * bd
    assert Tangent(terms, {b: bd}).of(sp.Integer(3)) == 0


def test_repeated_rates_reuse_named_terms():
    terms = Terms({})
    u = terms.let(a**2 + b)
    tangent = Tangent(terms, {a: ad, b: bd})
    first = tangent.of(u)
    count = len(terms.definitions)
    assert tangent.of(u) == first
    assert tangent.of_each([u, -u]) == [first, -first]
    assert len(terms.definitions) == count


def test_solved_angle_is_differentiated_through_its_loop_rate():
    """The time derivative of a solved loop angle is the angle's rate from the loop equations.

    The atan2 of this angle is not differentiated.
    """
    terms = Terms({})
    angle = terms.solved_angle(
        *(terms.let(part) for part in (a / sp.sqrt(a**2 + b**2), b / sp.sqrt(a**2 + b**2)))
    )
    c, s = terms.cos_sin(angle + a)
    rate = terms.let((a * bd - b * ad) / (a**2 + b**2))
    asked = []
    tangent = Tangent(terms, {a: ad, b: bd}, {angle: lambda t: asked.append(t) or rate})
    assert tangent.of(angle) == rate
    found = [written_out(terms, tangent.of(part)) for part in (c, s)]
    assert asked == [tangent]
    phi = sp.atan2(b, a) + a
    point = {a: 0.6, b: -0.7, ad: 0.3, bd: 1.9}
    for value, expected in zip(found, (sp.cos(phi), sp.sin(phi)), strict=True):
        slope = sp.diff(expected, a) * ad + sp.diff(expected, b) * bd
        assert float(value.subs(point)) == pytest.approx(float(slope.subs(point)), abs=1e-14)


# --- derivatives of complete loops ---

MECHANISMS = {f.__name__: f for f in (four_bar, slider_crank, slotted_rocker, geared)}


def kernel(h, arguments, values):
    inputs = tuple(
        Argument(f"x{k}", tuple(symbols), (len(symbols),), "", "")
        for k, symbols in enumerate(arguments)
    )
    result = Result("y", tuple(values), (len(values),), "", "")
    (function,) = lower([SymbolicFunction("f", "F.", "", inputs, (result,), h.terms)], "test")
    return function


@pytest.mark.parametrize("name", MECHANISMS)
def test_first_and_second_loop_derivatives_match_casadi(name):
    h = solved(MECHANISMS[name]())
    names = [v.name for v in h.variables]
    values = named(h, h.forward, names)
    q, qd, qdd = (h.arguments[key].symbols for key in ("q", "qd", "qdd"))
    loops = h.forward.loops
    first = Tangent(h.terms, dict(zip(q, qd, strict=True)), loops).of_each(values)
    pairs = dict(zip((*q, *qd), (*qd, *qdd), strict=True))
    second = Tangent(h.terms, pairs, loops).of_each(first)
    f = kernel(h, (q, qd, qdd), (*first, *second))
    plain = kernel(h, (q,), values)
    x, xd, xdd = (ca.SX.sym(s, 1) for s in ("x", "xd", "xdd"))
    rate = ca.jtimes(plain(x), x, xd)
    change = ca.jtimes(rate, ca.vertcat(x, xd), ca.vertcat(xd, xdd))
    oracle = ca.Function("oracle", [x, xd, xdd], [ca.vertcat(rate, change)])
    generator = np.random.default_rng(0)
    for start in generator.uniform(0.3, 2.8, 30) * (10 if name == "geared" else 1):
        u, w = generator.uniform(-1, 1, 2)
        expected = np.array(oracle(start, u, w)).ravel()
        assert np.isfinite(expected).all()
        np.testing.assert_allclose(
            np.array(f(start, u, w)).ravel(), expected, rtol=1e-11, atol=1e-12
        )


def test_four_bar_derivatives_match_freudenstein_in_mpmath():
    """The expected derivatives follow from Freudenstein's half-angle formula."""
    h = solved(four_bar())
    loops = h.forward.loops
    (q,) = h.q
    unit = Tangent(h.terms, {q: sp.Integer(1)}, loops)
    slope = unit.of(named(h, h.forward, ["rocker"])[0])
    bend = unit.of(slope)
    f = kernel(h, (h.q,), (named(h, h.forward, ["rocker"])[0], slope, bend))

    def freudenstein(x):
        r, d, c, b2 = mpmath.mpf(1), mpmath.mpf(3), mpmath.mpf("2.5"), mpmath.mpf(9)
        E = 2 * c * (d - r * mpmath.cos(x))
        F = -2 * c * r * mpmath.sin(x)
        G = r**2 + c**2 + d**2 - b2 - 2 * r * d * mpmath.cos(x)
        return 2 * mpmath.atan2(-F - mpmath.sqrt(E**2 + F**2 - G**2), G - E)

    with mpmath.workdps(40):
        for x in (0.2, 1.1, 2.3, 4.0, 5.9):
            found = np.array(f(x)).ravel()
            expected = [mpmath.diff(freudenstein, mpmath.mpf(x), k) for k in range(3)]
            turns = (found[0] - float(expected[0])) / (2 * np.pi)
            assert turns == pytest.approx(round(turns), abs=1e-15)
            assert found[1:] == pytest.approx([float(e) for e in expected[1:]], rel=1e-13)
