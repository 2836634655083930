"""The printed equations of platforms on legs agree with the compiled functions."""

from functools import cache

import numpy as np
import pytest
import sympy as sp

from chasles.derive import derive, read_text
from chasles.derive.latex import files
from chasles.derive.latex.loops.legs_fragment import PrintedLegs, legs
from chasles.derive.latex.loops.loop_page import LoopPage
from chasles.derive.loops.modes.platforms import triad_of
from chasles.derive.loops.planar.loop_step import Cross, Dot
from chasles.derive.program.programs import NO_PROGRAMS
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.planar_platforms import drawn_platform

LEGS = {
    # Each platform is a pair (three legs, number of harmonics), and each leg is a pair (joint
    # types, index of the actuated joint). A leg constrains a platform point to a circle or a line.
    "circles": ((("RRR", 0), ("RRR", 1), ("RPR", 1)), 3),
    "two lines": ((("RRR", 0), ("RPR", 2), ("PRR", 2)), 3),
    "lines that turn alike": ((("PRP", 0), ("PRP", 0), ("RRP", 0)), 1),
}
FUNCTIONS = ["assembly_polynomial", "legs"]
TRUE = 1e-11
ANGLES = (-2.9, 0.4, 1.7)


class Numbers:
    """Evaluates the equations of a LaTeX article."""

    def __init__(self, page, q, phi):
        notation = page.chain.equations.notation
        self.known = {}
        for symbol, meaning in notation.meanings.items():
            if not meaning.free_symbols & set(notation.q):
                self.known[symbol] = meaning.xreplace(self.known).evalf(25)
        self.give((*page.q, page.theta[-1]), (*q, phi))

    def give(self, symbols, values):
        floats = [sp.Float(float(value), 25) for value in values]
        self.known |= dict(zip(symbols, floats, strict=True))

    def name(self, definitions):
        for symbol, value in definitions:
            self.give([symbol], [self(value)])

    def __call__(self, expression):
        value = sp.S(expression).xreplace(self.known).evalf(25)
        assert not value.free_symbols, value.free_symbols
        return float(value)


@cache
def printed(name):
    platform = drawn_platform(np.random.default_rng(6), LEGS[name][0])
    derivation = derive(read_text(platform.text("legs")), functions=FUNCTIONS)
    page = LoopPage.of(derivation)
    return platform, derivation, PrintedLegs(page, triad_of(page.hybrid))


def vectors_of(found, numbers):
    """Return the values of the printed vectors u_i and n_i, keyed by their LaTeX symbols."""
    numbers.name([pair for of in (*found.u, *found.n) for pair in of])
    heads = {"u": range(2, 4), "n": range(4 - len(found.n), 4)}
    parts = {"u": found.u, "n": found.n}
    return {
        rf"\mathbf{{{letter}}}_{{{i}}}": np.array([numbers(symbol) for symbol, _ in components])
        for letter, indices in heads.items()
        for i, components in zip(indices, parts[letter], strict=True)
    }


def put(expression, vectors, numbers, tex):
    """Evaluate an expression with vector products."""
    values = {}
    for product in expression.atoms(Dot, Cross):
        a, b = (vectors[tex[symbol]] for symbol in product.args)
        values[product] = a @ b if product.func is Dot else a[0] * b[1] - a[1] * b[0]
    return numbers(expression.xreplace(values))


@pytest.mark.parametrize("name", LEGS)
def test_printed_leg_elimination_equals_assembly_polynomial(name):
    platform, derivation, shown = printed(name)
    found, tex = shown.equations, shown.page.chain.equations.notation.tex
    polynomial, residual = lower([derivation.function(f) for f in FUNCTIONS], "legs")
    a0, *rest = np.array(polynomial(platform.q)).ravel()
    assert found.harmonics == LEGS[name][1]
    of_three = [np.hypot(a, b) > 1e-12 for a, b in zip(rest[::2], rest[1::2], strict=True)]
    assert of_three == [m <= found.harmonics for m in (1, 2, 3)]
    radii = {f"l{i}": length for i, length in enumerate(shown.legs.L, 1)}
    for phi in ANGLES:
        numbers = Numbers(shown.page, platform.q, phi)
        lengths = [(shown.of(letter[0], letter[1:]), value) for letter, value in radii.items()]
        numbers.name([*lengths, *found.distances])
        vectors = vectors_of(found, numbers)
        numbers.name(found.norms)
        for symbol, value in found.k:
            numbers.give([symbol], [put(value, vectors, numbers, tex)])
        left, right = (put(side, vectors, numbers, tex) for side in found.polynomial)
        pairs = zip((1, 2, 3), rest[::2], rest[1::2], strict=True)
        value = a0 + sum(a * np.cos(m * phi) + b * np.sin(m * phi) for m, a, b in pairs)
        scaled = (left - right) / numbers(found.scale) ** (found.power / 2)
        assert scaled == pytest.approx(value, abs=TRUE)
        _check_position(platform, shown, numbers, vectors, residual, phi)


def _check_position(platform, shown, numbers, vectors, residual, phi):
    """Check that w solves the linear equations, or the line equations of the first two legs."""
    found, tex = shown.equations, shown.page.chain.equations.notation.tex
    (cross,) = found.solution.atoms(Cross)
    a, b = (vectors[tex[symbol]] for symbol in cross.args)
    rest = found.solution.xreplace({cross: sp.Float(a[0] * b[1] - a[1] * b[0], 25)})
    quarter = next(s for s in rest.free_symbols if tex[s] == "J")
    names = {s: vectors[tex[s]] for s in rest.free_symbols if tex[s] in vectors}
    one = [
        numbers(rest.xreplace({quarter: 1, **{s: sp.Float(v[axis], 25) for s, v in names.items()}}))
        for axis in (0, 1)
    ]
    numbers.give(found.w, [-one[1], one[0]])
    x, y = (numbers(value) for value in found.position)
    left = np.array(residual([x, y, phi], platform.q)).ravel()
    lines = slice(3 - len(shown.legs.lines), 3 if shown.legs.L else 2)
    np.testing.assert_allclose(left[lines], 0, atol=1e-9)
    circles = np.array([numbers(L) for L in shown.legs.L])
    squares = (left[: len(circles)] + circles) ** 2 - circles**2
    # The linear equations of the platform position are differences of circle equations.
    np.testing.assert_allclose(squares - squares[:1], 0, atol=1e-9)


def test_article_prints_leg_equations_and_assembly_mode_count():
    _, derivation, _ = printed("two lines")
    texts = files(derivation, NO_PROGRAMS)
    text = texts["latex/legs.tex"]
    assert r"\input{latex/legs}" in texts["legs.tex"]
    assert r"= \ell_i, \quad i = 1, \qquad" in text
    assert r"\mathbf{n}_i \cdot (\mathbf{b}_i - \mathbf{a}_i) = 0, \quad i = 2, 3." in text
    assert "belongs to the platform for $i = 2$ and belongs to another body for $i = 3$" in text
    assert "at most six assembly modes" in text
    assert "at most two assembly modes" in legs(printed("lines that turn alike")[2].page)
