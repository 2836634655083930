"""Loop equations in LaTeX articles agree with the derived functions."""

import re
from dataclasses import replace
from functools import cache, reduce

import numpy as np
import pytest
import sympy as sp

from chasles.contract import read_manifest
from chasles.derive import Joint, derive, read, read_text
from chasles.derive.latex import fragments
from chasles.derive.latex.loops.loop_page import LoopPage
from chasles.derive.latex.loops.loops_fragment import residual
from chasles.derive.latex.loops.members import dotted, members, words
from chasles.derive.latex.loops.rates_fragment import Rates
from chasles.derive.latex.loops.tool_position import without_guard
from chasles.derive.latex.setting.names import is_symbol
from chasles.derive.latex.setting.printer import FractionPrinter
from chasles.derive.loops.functions.constraint_functions import equations
from chasles.derive.loops.planar.loop_step import Cross
from chasles.derive.model.mechanism import Closure, Drive, Frame, Mechanism, Strut
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import GENERATED, MECHANISMS, article, committed, description

SOLVED = [
    *("board_installer", "delta", "five_bar", "four_bar", "slider_crank", "well_manipulator"),
]
TURNED_BACK = [*SOLVED, "planar_3rrr", "stewart_gough"]
COMPARED = ("configuration", "margin", "chain", "chain_rates", "constraint")
COMPARED += ("actuators", "actuator_margin", "actuator_rates")
"""Names of the functions that are compared with printed formulas."""
TRUE = 1e-10
NEAR = 0.05
"""Maximum deviation of random joint values from the reference (radian, meter)."""


class Reader:
    """Evaluates the equations of a LaTeX article."""

    def __init__(self, page):
        notation = page.chain.equations.notation
        self.page = page
        self.positions = {}
        self.known = {s: v.evalf(30) for s, v in page.terms.parameters.items()}
        for symbol, meaning in notation.meanings.items():
            if symbol in notation.constants or not meaning.free_symbols & set(notation.q):
                self.known[symbol] = self(meaning)

    def __call__(self, expression):
        value = sp.sympify(expression).xreplace(self.known).evalf(25)
        assert not value.free_symbols, f"{value.free_symbols} are used before they are defined"
        return value

    def give(self, symbols, numbers):
        self.known |= {s: sp.Float(x, 25) for s, x in zip(symbols, numbers, strict=True)}

    def step(self, printed):
        """Evaluate a printed loop solution step, and check that the loop of the step closes."""
        for symbol, value in printed.vectors:
            self.known[symbol] = self(value)
        self.positions |= {
            symbol: np.array([float(self(part)) for part in vector])
            for symbol, vector in printed.positions.items()
        }
        for symbol, value in printed.results:
            found = self.space(value)
            if isinstance(found, np.ndarray):
                self.positions[symbol] = found
                if symbol in printed.points:
                    self.give(printed.points[symbol], found)
            else:
                self.known[symbol] = sp.sympify(found)
        for angle in printed.angles:
            self.known[angle.symbol] = sp.atan2(self(angle.sine), self(angle.cosine))
        left, right = (self.vector(side) for side in (printed.unknown, printed.given))
        assert abs(left - right) < TRUE

    def space(self, value):
        """Evaluate an expression of vectors and numbers. v^2 is a scalar product."""
        if value in self.positions:
            return self.positions[value]
        if not value.free_symbols & {*self.positions}:
            return self(value)
        parts = [self.space(part) for part in value.args]
        if isinstance(value, Cross):
            return np.cross(*parts)
        if isinstance(value, sp.Abs):
            return np.linalg.norm(parts[0])
        if isinstance(value, sp.Pow) and isinstance(parts[0], np.ndarray):
            return (parts[0] @ parts[0]) ** float(value.exp / 2)
        if isinstance(value, sp.Pow):
            return float(parts[0]) ** float(value.exp)
        parts = [p if isinstance(p, np.ndarray) else float(p) for p in parts]
        return sum(parts) if value.is_Add else reduce(np.multiply, parts)

    def vector(self, side):
        total = 0j
        for angle, (x, y) in side:
            total += complex(self(x), self(y)) * np.exp(1j * float(self(angle)))
        return total

    def rates(self, found, printed):
        """Solve the joint rate equations that the LaTeX article prints for a solution step."""
        equations = found.equations(printed)
        for part, symbol in found.inner.items():
            self.known[symbol] = self(found.of(part))
        unknowns = list(dict.fromkeys(s for rate, _ in equations for s, _ in rate.left))
        rows = np.zeros((len(equations), len(unknowns)))
        # A rate equation may contain the joint rate that the preceding equation determines.
        for k, (rate, total) in enumerate(equations):
            for symbol, weight in rate.left:
                rows[k, unknowns.index(symbol)] = float(self(weight))
            if len(rate.left) == 1:
                (symbol,) = [symbol for symbol, _ in rate.left]
                self.known[found.dotted[symbol]] = self(total) / rows[k, unknowns.index(symbol)]
        if any(len(rate.left) > 1 for rate, _ in equations):
            right = [float(self(total)) for _, total in equations]
            self.give([found.dotted[s] for s in unknowns], np.linalg.solve(rows, right))


@cache
def derivation(name):
    known = {function.name for function in read_manifest(GENERATED / name).functions}
    return derive(read(description(name)), functions=[f for f in COMPARED if f in known])


@cache
def kernels(name):
    functions = derivation(name).functions
    return dict(zip([f.name for f in functions], lower(functions, name), strict=True))


@cache
def page_of(name):
    return LoopPage.of(derivation(name))


def random(count, seed):
    return np.random.default_rng(seed).uniform(-1, 1, count)


def some_q(name):
    hybrid = derivation(name).hybrid
    at = hybrid.at_reference
    q = [
        at[c.moves] / float(hybrid.terms.value(c.ratio)) for c in derivation(name).robot.coordinates
    ]
    return np.array(q) + NEAR * random(len(q), 3)


def close(value, expected, unit):
    difference = float(value) - float(expected)
    if unit == "rad":
        difference = (difference + np.pi) % (2 * np.pi) - np.pi
    return abs(difference) < TRUE


def array(name, function, *arguments):
    return np.array(kernels(name)[function](*arguments)).ravel()


@pytest.mark.parametrize("name", SOLVED)
def test_printed_steps_reproduce_closed_configuration_and_margins(name):
    page, q = page_of(name), some_q(name)
    steps, reader = page.forward_steps, Reader(page)
    reader.give(page.q, q)
    for step in steps:
        reader.step(step)
    z = array(name, "configuration", q)
    for variable, expected in zip(page.hybrid.variables, z, strict=True):
        value = reader(page.printed_terms.sum(page.hybrid.forward.values[variable.name]))
        assert close(value, expected, variable.unit), variable.name
    margins = [float(reader.space(s.margin)) for s in steps if s.margin is not None]
    expected = array(name, "margin", q) if margins else []
    np.testing.assert_allclose(margins, expected, rtol=0, atol=TRUE)


@pytest.mark.parametrize("name", TURNED_BACK)
def test_printed_backward_steps_reproduce_the_actuators(name):
    page = page_of(name)
    at = page.hybrid.at_reference
    theta = np.array([at[joint.name] for joint in page.hybrid.robot.moving])
    if not page.hybrid.forward.open:
        theta = array(name, "chain", some_q(name))
    steps = page.backward_steps
    reader = Reader(page)
    reader.give(page.theta, theta)
    for step in steps:
        reader.step(step)
    expected = array(name, "actuators", theta)
    for c, x in zip(page.mechanism.coordinates, expected, strict=True):
        value = reader(page.printed_terms.sum(page.hybrid.backward.values[c.moves]) / c.ratio)
        assert close(value, x, c.unit), c.name
    margins = [float(reader.space(s.margin)) for s in steps if s.margin is not None]
    if margins:
        np.testing.assert_allclose(
            margins, array(name, "actuator_margin", theta), rtol=0, atol=TRUE
        )


@pytest.mark.parametrize("name", SOLVED)
def test_printed_rates_match_chain_rates(name):
    page, q = page_of(name), some_q(name)
    steps = page.forward_steps
    reader, qd = Reader(page), random(len(q), 5)
    reader.give(page.q, q)
    found = Rates(page, {symbol: k for k, symbol in enumerate(page.q)})
    reader.give([found.dotted[symbol] for symbol in page.q], qd)
    for step in steps:
        reader.step(step)
        reader.rates(found, step)
    expected = array(name, "chain_rates", q, qd)
    for joint, x in zip(page.hybrid.robot.moving, expected, strict=True):
        value = reader(found.of(page.printed_terms.sum(page.hybrid.forward.values[joint.name])))
        assert float(value) == pytest.approx(x, abs=1e-8), joint.name


@pytest.mark.parametrize("name", TURNED_BACK)
def test_printed_rates_match_actuator_rates(name):
    if derivation(name).hybrid.forward.open:
        at = derivation(name).hybrid.at_reference
        theta = np.array([at[joint.name] for joint in derivation(name).hybrid.robot.moving])
    else:
        theta = array(name, "chain", some_q(name))
    page = page_of(name)
    steps = page.backward_steps
    reader, thetad = Reader(page), random(len(theta), 7)
    if name == "board_installer":
        # The main chain has more joints than degrees of freedom, so only some joint rate vectors
        # satisfy the loop equations.
        thetad = array(name, "chain_rates", some_q(name), random(6, 7))
    reader.give(page.theta, theta)
    found = Rates(page, {symbol: k for k, symbol in enumerate(page.theta)})
    reader.give([found.dotted[symbol] for symbol in page.theta], thetad)
    for step in steps:
        reader.step(step)
        reader.rates(found, step)
    expected = array(name, "actuator_rates", theta, thetad)
    for c, x in zip(page.mechanism.coordinates, expected, strict=True):
        value = reader(
            found.of(page.printed_terms.sum(page.hybrid.backward.values[c.moves]) / c.ratio)
        )
        assert float(value) == pytest.approx(x, abs=1e-8), c.name


@pytest.mark.parametrize("name", TURNED_BACK)
def test_printed_loop_equations_match_constraint_function(name):
    page = LoopPage.of(derivation(name))
    z = random(len(page.joints), 11)
    expected = array(name, "constraint", z)
    shown = [residual(page, loop) for loop in equations(page.hybrid)]
    reader = Reader(page)
    for variable, x in zip(page.hybrid.variables, z, strict=True):
        reader.give([page.joints[variable.name]], [x])
    values = []
    for definitions, entries in shown:
        for symbol, meaning in definitions:
            reader.known[symbol] = reader(meaning)
        values += [float(reader(entry)) for entry in entries]
    np.testing.assert_allclose(values, expected, rtol=0, atol=TRUE)


def exponential(screw, value):
    v, w = screw[:3], screw[3:]
    X = np.zeros((4, 4))
    X[:3, :3] = [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]
    X[:3, 3] = v
    T, term = np.eye(4), np.eye(4)
    for k in range(1, 40):
        term = term @ X * value / k
        T = T + term
    return T


@pytest.mark.parametrize("name", ["four_bar", "five_bar", "slider_crank", "well_manipulator"])
def test_printed_screws_close_the_loops(name):
    page = page_of(name)
    at = dict(
        zip(
            [v.name for v in page.hybrid.variables],
            array(name, "configuration", some_q(name)),
            strict=True,
        )
    )
    shown = committed(name)["loops.tex"]
    reader = Reader(page)
    for loop in equations(page.hybrid):
        before, after, free = np.eye(4), np.eye(4), None
        home = np.array(
            [[float(reader(page.constant(e))) for e in row] for row in loop.home.tolist()]
        )
        placed = False
        for factor in loop.factors:
            screw = np.array([float(reader(page.constant(e))) for e in factor.screw])
            if factor.name not in at:
                free = screw
                continue
            if factor.side == "b" and not placed:
                after, placed = after @ home, True
            sign = -1 if factor.side == "b" else 1
            minus = "-" if sign < 0 else ""
            tex = page.tex(page.joints[factor.name])
            assert rf"e^{{{minus}[\mathcal{{S}}_{{{tex}}}] {tex}}}" in shown
            T = exponential(screw, sign * at[factor.name])
            before, after = (before @ T, after) if free is None else (before, after @ T)
        if not placed:
            after = after @ home
        turn = np.linalg.inv(before) @ np.linalg.inv(after)
        angle = np.arctan2(
            free[3:] @ [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]],
            np.trace(turn[:3, :3]) - 1,
        )
        np.testing.assert_allclose(turn, exponential(free, angle), rtol=0, atol=1e-9)


def test_article_states_angle_relation_of_translating_arm():
    shown = committed("board_installer")["solution.tex"]
    assert r"The angles $\theta_{3}$, $\theta_{4}$, $\theta_{5}$ of the main chain have a" in shown
    assert r"L_{2} - k r + k r \cos q_{3} - k q_{2}" in shown
    assert r"L_{1} + k r \sin q_{3}" in shown


def test_article_states_missing_closed_form():
    shown = committed("planar_3rrr")["solution.tex"]
    assert r"There is no closed form for $x$, $y$, $\phi$" in shown
    assert "Newton's iteration" in shown
    solved = committed("four_bar")["solution.tex"]
    assert "no closed form" not in solved


def test_article_prints_mobility_counts():
    counted = committed("four_bar")["mobility.tex"]
    assert "3 (4 - 1 - 4) + 4 = 1" in counted
    assert "All counts agree." in counted
    overconstrained = committed("board_installer")["mobility.tex"]
    assert "gives $-9$, the rank gives $6$" in overconstrained


def test_four_bar_loop_is_printed_as_in_textbooks():
    found = committed("four_bar")
    loops = found["loops.tex"]
    assert (
        r"0 &= a \cos \theta_{1} + b \cos(\theta_{1} + \theta_{2}) - c \cos \psi_{1} - d" in loops
    )
    assert (
        r"b \,\mathrm{e}^{\mathrm{i}\varphi_{1}} - c \,\mathrm{e}^{\mathrm{i}\psi_{1}}"
        in (found["solution.tex"])
    )


@pytest.mark.parametrize("name", MECHANISMS)
def test_no_internal_name_is_printed(name):
    texts = committed(name)
    assert texts
    for file, text in texts.items():
        assert not re.search(r"(?<![\w\\}$])_[tkz]?\d", text), file
        assert "zoo" not in text, file
        assert not re.search(r"\bnan\b", text), file
        assert "sqrt(" not in text, file


GEARED = """
name = "geared"
convention = "urdf"
actuated = ["motor"]
[[joints]]
name = "x"
type = "prismatic"
axis = [1, 0, 0]
[[drives]]
name = "motor"
kind = "belt"
joint = "x"
teeth = 20
pitch = "0.005"
"""


@pytest.mark.parametrize("name", ["four_bar", "bricklaying_gantry"])
def test_article_contains_the_figure_of_its_mechanism(name):
    assert committed(name)["drawing.tex"] == article(name)["drawing.tex"]


def test_loop_fragments_exist_only_for_closed_loops():
    with_loops = committed("four_bar")
    geared = fragments(derive(read_text(GEARED)))
    assert {"drawing.tex", "mobility.tex", "loops.tex", "solution.tex", "rates.tex"} <= {
        *with_loops
    }
    assert "loops.tex" not in geared
    assert "solution.tex" in geared
    text = (GENERATED / "four_bar" / "four_bar.tex").read_text()
    inputs = re.findall(r"\\input\{latex/(\w+)\}", text)
    assert inputs[0] == "drawing"
    assert sorted(f"{name}.tex" for name in inputs) == sorted(with_loops)
    assert "tikz" in text


def geared():
    """Return a mechanism with a geared motor, a pin closure and a rod."""
    joints = (
        Joint("theta", "revolute", link="one", parent="0"),
        Joint("q_1", "revolute", link="two", parent="0"),
        Joint("rod_angle", "revolute", link="three", parent="one"),
    )
    pin = Closure("pin", "pin", Frame("three"), Frame("two"))
    rod = Strut("rod", Frame("one"), Frame("two"), length=sp.Integer(1))
    drive = Drive("motor", "theta", sp.Rational(1, 2))
    return Mechanism("geared", joints, ("motor",), (pin,), (rod,), (drive,), tool_body="one")


def test_loop_joints_get_conventional_symbols():
    assert members(geared()).of == {
        "theta": r"\theta",
        "q_1": r"\psi_{1}",
        "rod_angle": r"\psi_{2}",
        "rod_swing": r"\psi_{3}",
    }
    well = members(read(description("well_manipulator")))
    assert well.theta == (
        *(rf"\theta_{{{k}}}" for k in (1, 2, 3)),
        "l_{HI}",
        r"\theta_{5}",
        "l_{MN}",
        r"\theta_{7}",
    )
    assert well.of["cylinder_1"] == "q_{2}"
    assert well.of["theta8"] == r"\theta_{8}"
    planar = members(read(description("planar_3rrr")))
    assert planar.theta == ("x", "y", r"\phi")
    assert planar.of["theta_1"] == "q_{1}"


def test_member_names_are_printed_as_readable_text():
    struts = {f"{name}_swing": name for name in ("side_a", "side_b")}
    assert words("cylinder_1.end", {}) == "far end of cylinder 1"
    assert words("boom_cylinder.piston", {}) == "piston of boom cylinder"
    assert words("boom_swing", struts) == "boom swing"
    assert words("side_a_swing", struts) == "near end of side a"
    shared = "pin between near end of side a and near end of side b"
    assert words("side_a_swing.side_b_swing", struts) == shared
    assert words("arm_1.rod_2.end", {}) == "pin between arm 1 and far end of rod 2"
    assert [is_symbol(name) for name in ("l_HI", "theta8", "x", "yaw")] == [True, True, True, False]
    assert dotted(r"\theta_{1}") == r"\dot{\theta}_{1}"
    assert dotted("x") == r"\dot{x}"


@pytest.mark.parametrize(
    ("expression", "tex"),
    [
        ("a*b/c**2", r"\frac{a b}{c^{2}}"),
        ("-a/2", r"-\frac{a}{2}"),
        ("3*a/5", "0.6 a"),
        ("a/(3*c)", r"\frac{\tfrac{1}{3} a}{c}"),
        ("(a + b)/c", r"\frac{a + b}{c}"),
        ("Abs(a)", "|a|"),
        ("b*sin(a)**2", r"b \sin^{2} a"),
        ("cos(a + b)**2", r"\cos^{2}(a + b)"),
        ("1/c", r"\frac{1}{c}"),
    ],
)
def test_quotients_are_printed_as_fractions(expression, tex):
    a, b, c = symbols = sp.symbols("a b c", real=True)
    printer = FractionPrinter(
        {s: s.name for s in symbols}, {s: (1, (k,)) for k, s in enumerate(symbols)}
    )
    assert printer.tex(sp.sympify(expression, locals={"a": a, "b": b, "c": c})) == tex


@pytest.mark.parametrize("name", ["five_bar", "bricklaying_gantry"])
def test_printed_position_is_the_position_of_the_forward_kinematics(name):
    found = derive(read(description(name)), functions=["fk"])
    fk = found.function("fk")
    entries = [without_guard(found.hybrid.terms, fk.outputs[0].entries[k]) for k in (3, 7, 11)]
    position = replace(fk, outputs=(replace(fk.outputs[0], entries=tuple(entries), shape=(3,)),))
    (whole, printed) = lower([fk, replace(position, name="position")], name)
    q = found.hybrid.q_at_reference
    np.testing.assert_allclose(
        np.array(printed(q)).ravel(), np.array(whole(q)).reshape(4, 4)[:3, 3], rtol=0, atol=1e-15
    )
