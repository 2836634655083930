"""Equations in LaTeX articles of platforms on legs agree with the derived functions."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp

from chasles.derive import derive, read
from chasles.derive.latex.loops.loop_page import LoopPage
from chasles.derive.latex.loops.platforms_fragment import PrintedPlatform, platform
from chasles.derive.loops.modes.platforms import is_platform
from chasles.derive.loops.planar.loop_step import Cross, Dot
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import GENERATED, ROBOTS, committed
from tests.support.loops.mechanisms import at

PLATFORMS = ["delta", "planar_3rrr", "slider_crank", "stewart_gough"]
TRIADS = ["planar_3rrr", "crooked"]
WRITTEN = ("rods", "velocity_relation")
ELIMINATED = (*WRITTEN, "assembly_polynomial", "assembly_position")
"""Names of the functions that are compared with printed formulas."""
TRUE = 1e-12
ROUNDING = 1e-9


@cache
def derived(name):
    """Derive the functions of a shipped robot, or of a planar platform with three unequal rods."""
    if name != "crooked":
        written = ELIMINATED if name in TRIADS else WRITTEN
        return derive(read(ROBOTS / f"{name}.toml"), functions=written)
    plain = read(ROBOTS / "planar_3rrr.toml")
    lengths = (sp.Rational(13, 100), sp.Rational(3, 20), sp.Rational(17, 100))
    rods = tuple(replace(s, length=x) for s, x in zip(plain.struts, lengths, strict=True))
    base = at(sp.Rational(1, 5), 0, 0, ("z", sp.pi / 6))
    tool = at(sp.Rational(1, 50), sp.Rational(-1, 20), 0, ("z", sp.pi / 4))
    return derive(replace(plain, base=base, tool=tool, struts=rods), functions=ELIMINATED)


@cache
def functions(name):
    found = derived(name).functions
    return dict(zip([f.name for f in found], lower(found, name), strict=True))


def called(name, function, *arguments):
    results = functions(name)[function](*arguments)
    results = results if isinstance(results, tuple) else (results,)
    outputs = derived(name).function(function).outputs
    return [np.array(r).reshape(o.shape) for r, o in zip(results, outputs, strict=True)]


@cache
def printed(name):
    return PrintedPlatform(LoopPage.of(derived(name)))


class Numbers:
    """Evaluates the equations of a LaTeX article."""

    def __init__(self, name, theta, q):
        page = printed(name).page
        notation = page.chain.equations.notation
        self.known = {s: v.evalf(30) for s, v in page.terms.parameters.items()}
        for symbol, meaning in notation.meanings.items():
            if not meaning.free_symbols & set(notation.q):
                self.known[symbol] = meaning.xreplace(self.known).evalf(25)
        self.give((*page.theta, *page.q), (*theta, *q))

    def give(self, symbols, values):
        values = [sp.Float(float(value), 25) for value in values]
        self.known |= dict(zip(symbols, values, strict=True))

    def __call__(self, expression):
        value = sp.S(expression).xreplace(self.known).evalf(25)
        assert not value.free_symbols, value.free_symbols
        return float(value)

    def array(self, entries):
        return np.array([[self(entry) for entry in row] for row in entries])


def somewhere(name, seed=0):
    hybrid = derived(name).hybrid
    rng, reference = np.random.default_rng(seed), hybrid.at_reference
    theta = np.array([reference[joint.name] for joint in hybrid.robot.moving])
    q = np.array([reference[c.moves] for c in hybrid.mechanism.coordinates])
    return (x + rng.uniform(-0.1, 0.1, len(x)) for x in (theta, q))


@pytest.mark.parametrize("name", [*PLATFORMS, "crooked"])
def test_printed_rods_match_residual_function(name):
    theta, q = somewhere(name)
    numbers = Numbers(name, theta, q)
    found = printed(name)
    a, b = (numbers.array([getattr(rod, end) for rod in found.rods]) for end in "ab")
    lengths = [numbers(rod.length) for rod in found.rods]
    (expected,) = called(name, "rods", theta, q)
    excess = np.linalg.norm(b - a, axis=1) - lengths
    np.testing.assert_allclose(excess, expected, rtol=0, atol=TRUE)


@pytest.mark.parametrize("name", [*PLATFORMS, "crooked"])
def test_printed_pins_are_constant_in_platform_frame(name):
    theta, q = somewhere(name)
    numbers, found = Numbers(name, theta, q), printed(name)
    b, pins = (numbers.array([getattr(rod, of) for rod in found.rods]) for of in ("b", "pin"))
    p = numbers.array([found.tool])
    # Neither the scalar products of the pin vectors nor the pin coordinates in the platform frame
    # depend on the platform's rotation.
    gram = (b - p) @ (b - p).T
    np.testing.assert_allclose(pins @ pins.T, gram, rtol=0, atol=TRUE)
    other = Numbers(name, *somewhere(name, seed=1))
    np.testing.assert_array_equal(pins, other.array([rod.pin for rod in found.rods]))


@pytest.mark.parametrize("name", [*PLATFORMS, "crooked"])
def test_printed_velocity_relation_matches_function(name):
    theta, q = somewhere(name)
    numbers, found = Numbers(name, theta, q), printed(name)
    a, b = (numbers.array([getattr(rod, end) for rod in found.rods]) for end in "ab")
    n = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
    for symbols, values in ((found.n, n), (found.r, b - numbers.array([found.tool]))):
        for row, entries in zip(symbols, values, strict=True):
            numbers.give(row, entries)
    J_x, J_q = called(name, "velocity_relation", theta, q)
    np.testing.assert_allclose(numbers.array(found.J_x.tolist()), J_x, rtol=0, atol=TRUE)
    np.testing.assert_allclose(numbers.array(found.J_q.tolist()), J_q, rtol=0, atol=TRUE)


def eliminated(numbers, triad, length, phi):
    """Return both sides of the printed equation at a platform angle, and the first rod vector."""
    numbers.give([triad.phi], [phi])
    (rod,) = triad.equations.polynomial[1].free_symbols - triad.equations.solution.free_symbols
    numbers.give([rod], [length])
    for definitions in (*triad.u, triad.norms, triad.k):
        for symbol, value in definitions:
            numbers.give([symbol], [numbers(value)])
    u2, u3 = (np.array([numbers(symbol) for symbol, _ in u]) for u in triad.u)
    k2, k3 = (numbers(symbol) for symbol, _ in triad.k)
    area = u2[0] * u3[1] - u2[1] * u3[0]
    products = {Dot: u2 @ u3, Cross: area}

    def side(equation):
        known = {p: products[p.func] for p in equation.atoms(Dot, Cross)}
        return numbers(equation.xreplace(known))

    left, right = map(side, triad.equations.polynomial)
    solution = triad.equations.solution
    vectors = solution.atoms(Cross).pop().args
    axes = (dict(zip(vectors, (u2[k], u3[k]), strict=True)) for k in (0, 1))
    # The matrix J in the printed formula is the rotation by 90 degrees.
    one = {next(s for s in solution.free_symbols if str(s) == "J"): 1}
    cross = dict.fromkeys(solution.atoms(Cross), area)
    x, y = (numbers(solution.xreplace(cross).xreplace(one | axis)) for axis in axes)
    w = np.array([-y, x])
    u, k = max(((u2, k2), (u3, k3)), key=lambda pair: pair[0] @ pair[0])
    return left, right, w, u, k


@pytest.mark.parametrize("name", TRIADS)
def test_printed_elimination_equals_assembly_polynomial(name):
    theta, q = somewhere(name)
    triad, numbers = printed(name).triad, Numbers(name, theta, q)
    (coefficients,) = called(name, "assembly_polynomial", q)
    a0, *rest = coefficients
    length = numbers(printed(name).rods[0].length)
    for phi in np.linspace(-3, 3, 9):
        left, right, *_ = eliminated(numbers, triad, length, phi)
        pairs = zip((1, 2, 3), rest[::2], rest[1::2], strict=True)
        value = a0 + sum(a * np.cos(m * phi) + b * np.sin(m * phi) for m, a, b in pairs)
        scaled = (left - right) / numbers(triad.scale) ** 3
        assert scaled == pytest.approx(value, abs=TRUE)


@pytest.mark.parametrize("name", TRIADS)
def test_printed_position_solves_rods_at_each_polynomial_root(name):
    theta, _ = somewhere(name)
    reference = derived(name).hybrid.at_reference
    q = [reference[c.moves] for c in derived(name).robot.coordinates]
    triad, numbers = printed(name).triad, Numbers(name, theta, q)
    length = numbers(printed(name).rods[0].length)
    (coefficients,) = called(name, "assembly_polynomial", q)
    a0, *rest = coefficients
    half = [(a + 1j * b) / 2 for a, b in zip(rest[::2], rest[1::2], strict=True)]
    xi = np.roots([*np.conj(half[::-1]), a0, *half])
    angles = np.angle(xi[np.abs(np.abs(xi) - 1) < 1e-6])
    assert len(angles) >= 2
    for phi in angles:
        *_, w, u, k = eliminated(numbers, triad, length, phi)
        numbers.give(triad.w, w)
        shown = [numbers(value) for value in triad.position]
        (expected,) = called(name, "assembly_position", q, phi)
        np.testing.assert_allclose(shown, expected[:2], rtol=0, atol=ROUNDING)
        across = np.sqrt(length**2 * (u @ u) - k**2) * np.array([-u[1], u[0]])
        both = [(k * u + sign * across) / (u @ u) for sign in (1, -1)]
        assert min(np.abs(w - one).max() for one in both) < ROUNDING
        (residual,) = called(name, "rods", [*shown, phi], q)
        np.testing.assert_allclose(residual, 0, atol=ROUNDING)


def test_planar_3rrr_equations_are_printed_as_in_papers():
    shown = platform(printed("planar_3rrr").page)
    assert r"(S_{A} \cos q_{3},\; S_{A} \sin q_{3} + r_{b})" in shown
    assert r"(x - r_{p} \sin \phi,\; y + r_{p} \cos \phi)" in shown
    assert r"\mathbf{r}_{1x} \mathbf{n}_{1y} - \mathbf{r}_{1y} \mathbf{n}_{1x}" in shown
    assert r"S_{A} \mathbf{n}_{1y} \cos q_{1} - S_{A} \mathbf{n}_{1x} \sin q_{1}" in shown
    assert r"\bar{\ell}^2 = L^{2} + 3 r_{p}^{2}" in shown
    assert r"k_{2} &= -\frac{|\mathbf{u}_{2}|^{2}}{2}" in shown
    assert "at most six assembly modes" in shown


def test_rods_of_several_lengths_are_listed():
    shown = platform(printed("crooked").page)
    assert r"\ell_{1} &= 0.13" in shown
    assert r"\ell_{3} &= 0.17" in shown
    assert r"k_{3} &= \frac{0.012 - |\mathbf{u}_{3}|^{2}}{2}" in shown


def test_printing_platform_twice_gives_identical_text():
    page = printed("planar_3rrr").page
    assert platform(page) == platform(page)


def test_slider_crank_prints_a_single_rod():
    shown = platform(printed("slider_crank").page)
    assert "supported by connecting rod. It has the length" in shown
    assert r"(\mathbf{J}_q)_{11} &= r \mathbf{n}_{1y} \cos q_{1}" in shown
    assert "all other entries" not in shown


def test_stewart_gough_article_prints_legs_and_solution_bound():
    shown = platform(printed("stewart_gough").page)
    assert r"\ell_{6} &= l_{0} + q_{6}" in shown
    assert r"\mathbf{J}_q &= 1." in shown
    assert "at most forty solutions" in shown
    assert "harmonics" not in shown


def test_only_platforms_on_legs_have_the_platform_fragment():
    for name in ("planar_3rrr", "slider_crank"):
        assert "platform.tex" in committed(name)
        assert r"\input{latex/platform}" in (GENERATED / name / f"{name}.tex").read_text()
    assert "platform.tex" not in committed("five_bar")
    assert "latex/platform" not in (GENERATED / "five_bar/five_bar.tex").read_text()


def test_cylinder_or_rod_off_the_platform_is_not_a_platform_leg():
    plain = read(ROBOTS / "planar_3rrr.toml")
    assert is_platform(plain)
    first, *others = plain.struts
    spring = replace(first, is_cylinder=True)
    assert not is_platform(replace(plain, struts=(spring, *others)))
    on_crank = replace(first, b=replace(first.b, body="crank_2"))
    assert not is_platform(replace(plain, struts=(on_crank, *others)))
