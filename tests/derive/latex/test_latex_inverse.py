"""The IK function in a LaTeX article is readable and agrees with the generated IK function."""

import itertools
import re
from functools import cache

import numpy as np
import pytest
import sympy as sp

from chasles.derive import derive, read_text
from chasles.derive.inverse.structure.rank import rotation
from chasles.derive.inverse.subproblems.equations import Linear, TwoEllipses
from chasles.derive.latex.inverse.inverse_fragment import inverse, printed_tasks
from chasles.derive.latex.setting.page import Page
from chasles.derive.terms.casadi_graph import lower
from tests.support.derivations import (
    ALL,
    GENERATED,
    NAMES,
    committed,
    derivation,
    every_branch,
    kernels,
)
from tests.support.printed_robots import FUNCTIONS as PRINTED_FUNCTIONS
from tests.support.printed_robots import named_wrist

TRUE = 1e-10
"""Tolerance of textbook formulas, whose results are inaccurate in the last digits."""
FUNCTIONS = (*PRINTED_FUNCTIONS, "ik")
"""Names of the functions that the tested LaTeX articles contain."""
INSIDE = 1e-3
"""Minimum margin at which angles are accurate to the tolerance `TRUE`."""
SOLVED = [name for name in NAMES if name != "jaco2"]
EVALUATED = ("iiwa14", "puma560", "lynxmotion", "photo_robot", "scara")
"""One arm of each structure."""
PRINTED = ("jaco2", "lynxmotion", "five_bar", "planar_3rrr", "bricklaying_gantry", "slider_crank")
"""Names of arms and of robots with loops, each with and without a closed-form inverse kinematics
function."""


class Reader:
    """Evaluates the printed inverse kinematics steps for one choice of branch signs."""

    def __init__(self, page, task, numbers, signs):
        notation = page.equations.notation
        self.meanings = notation.meanings
        self.known = {s: v.evalf(25) for s, v in notation.terms.parameters.items()}
        self.known |= {task.symbols[s]: sp.Float(x, 25) for s, x in numbers if s in task.symbols}
        self.known |= dict(zip(task.signs, map(sp.Integer, signs), strict=True))
        self.sums = {}
        self.q = notation.q

    def __call__(self, expression):
        for symbol in sorted(expression.free_symbols - self.known.keys(), key=str):
            assert symbol in self.meanings, f"{symbol} is used before it is defined"
            self.known[symbol] = self.meaning(self.meanings[symbol])
        value = expression.xreplace(self.known).evalf(25)
        assert value.is_number, value
        return value

    def meaning(self, meaning):
        """Evaluate the definition of a symbol in the LaTeX article."""
        if isinstance(meaning, sp.cos | sp.sin) and meaning.args[0] in self.sums:
            return meaning.func(self.sums[meaning.args[0]])
        return self(meaning)

    def define(self, definitions):
        for symbol, expression in definitions:
            assert symbol not in self.known, f"{symbol} is defined twice"
            self.known[symbol] = self(expression)

    def follow(self, task, q):
        self.define(task.definitions)
        coordinates = dict(zip(self.q, q, strict=True))
        for step in task.steps:
            self.define(step.definitions)
            if not step.solution:
                self.known[step.name] = self.sums[step.unknown] = sp.Float(coordinates[step.name])
                continue
            value = sum(map(self, step.solution))
            if isinstance(step.equation, Linear):
                a, b, d = map(self, step.equation.coefficients)
                assert abs(a * sp.cos(value) + b * sp.sin(value) - d) < TRUE
            self.known[step.name] = self.sums[step.unknown] = value
        self.define(task.rest)
        self.close([step for step in task.steps if not step.solution])

    def close(self, steps):
        """Check that the computed angles satisfy the common equation of solution steps."""
        if not steps:
            return
        equation = steps[0].equation
        angles = [float(step.sense * self.known[step.name]) for step in steps]
        given = np.array([float(self(e)) for e in equation.coefficients])
        if isinstance(equation, TwoEllipses):
            x = np.array([f(angle) for angle in angles for f in (np.sin, np.cos)])
            A = np.hstack([given[:4].reshape(2, 2), given[4:8].reshape(2, 2)])
            np.testing.assert_allclose(A @ x, given[8:], atol=TRUE)
            return
        p0, k1, p1, k2, p2, k3, p3 = given.reshape(7, 3)
        R1, R2, R3 = (rotation(k, angle) for k, angle in zip((k1, k2, k3), angles, strict=True))
        np.testing.assert_allclose(p0 + R1 @ p1, R2 @ (p2 + R3 @ p3), atol=TRUE)


def target_of(name, function, rng):
    """Return reachable input values of an inverse kinematics function."""
    q = rng.uniform(-1.2, 1.2, len(derivation(name).robot.moving))
    T = np.array(kernels(name)["fk"](q)).reshape(4, 4)
    p, z = T[:3, 3], T[:3, 2]
    given = dict(zip((f"q{k + 1}" for k in range(len(q))), q, strict=True))
    if function.name == "ik_position":
        # The position task determines only the first three joint values. The other joint values are
        # 0.
        q[3:] = 0.0
        p = np.array(kernels(name)["fk"](q)).reshape(4, 4)[:3, 3]
    known = {
        "T": T.ravel(),
        "p": p,
        "swivel": [0.3],
        "ik_position_pitch": [*p, np.arcsin(z[2])],
        "ik_position_direction": [*p, *z],
        "ik_planar": [*p[:2], np.arctan2(T[1, 0], T[0, 0])],
    }
    return [
        list(np.atleast_1d(known.get(a.name, given.get(a.name, known.get(function.name)))))
        for a in function.inputs
    ]


@cache
def page_and_tasks(name):
    page = Page.of(derivation(name))
    return page, printed_tasks(page, page.inverse, {})


def check(page, tasks, name, function_of, target):
    """Compare the printed solutions with the generated function, and count them."""
    compared = 0
    for task in tasks.values():
        function = task.solved.function
        numbers = target(function)
        q, _, margin = every_branch(function, function_of(function.name), *numbers)
        q = q.reshape(function.branches, -1)
        symbols = [s for argument in function.inputs for s in argument.symbols]
        values = list(zip(symbols, itertools.chain(*numbers), strict=True))
        for slot, signs in enumerate(itertools.product((1, -1), repeat=len(task.signs))):
            if margin[slot] < INSIDE:
                continue
            reader = Reader(page, task, values, signs)
            reader.follow(task, q[slot])
            found = np.array([float(reader.known.get(s, 0.0)) for s in page.equations.notation.q])
            slides = [joint.kind == "prismatic" for joint in page.robot.moving]
            off = np.angle(np.exp(1j * (found - q[slot])))
            off[slides] = (found - q[slot])[slides]
            np.testing.assert_allclose(off, 0.0, atol=TRUE, err_msg=name)
            compared += 1
    return compared


@pytest.mark.parametrize("name", EVALUATED)
def test_printed_steps_reproduce_the_compiled_inverse(name):
    (page, tasks), rng = page_and_tasks(name), np.random.default_rng(5)
    count = check(page, tasks, name, kernels(name).get, lambda f: target_of(name, f, rng))
    assert count >= len(page.inverse.solved)


ARM = """name = "arm"
convention = "dh"
joints = [{}]
"""
QUARTIC = {
    "loop": "{a=0.1, alpha=1.1}, {a=0.4, d=0.1, alpha=0.7}, {a=0.1, alpha=1.3}, "
    "{d=0.4, alpha='pi/2'}, {alpha='-pi/2'}, {d=0.1}",
    "ellipses": "{d=0.1, alpha='pi/2'}, {a=0.4}, {a=0.3}, {d=0.1, a=0.05, alpha=1.2}, "
    "{a=0.06, d=0.1, alpha=1.3}, {d=0.1}",
}
"""Arms whose first solution step has an equation in several angles: subproblems 5 and 6."""


@pytest.mark.parametrize("kind", QUARTIC)
def test_printed_multi_angle_equations_reproduce_the_inverse(kind):
    text = ARM.format(re.sub(r"=(-?[\d.]+)", r"='\1'", QUARTIC[kind]).replace("=", " = "))
    found = derive(read_text(text, file="arm.toml"), functions=FUNCTIONS)
    page = Page.of(found)
    tasks = printed_tasks(page, page.inverse, {})
    names = [function.name for function in found.functions]
    made = dict(zip(names, lower(found.functions, "arm"), strict=True))
    T = np.array(made["fk"](np.array([0.3, -0.7, 0.9, 0.4, 1.1, -0.2]))).ravel()
    assert check(page, tasks, kind, made.get, lambda _: [T]) >= 2
    written = inverse(page)
    assert "Steps 1 to" in written
    assert "up to four real roots" in written


def test_printed_inverse_with_named_tilts_matches_and_stays_short():
    """The printed inverse names six constant axis directions, and prints their components."""
    found = derive(named_wrist(), functions=FUNCTIONS)
    page = Page.of(found)
    tasks = printed_tasks(page, page.inverse, {})
    made = dict(zip((f.name for f in found.functions), lower(found.functions, "arm"), strict=True))
    T = np.array(made["fk"](np.array([0.3, -0.7, 0.9, 0.4, 1.1, -0.2]))).ravel()
    assert check(page, tasks, "named_wrist", made.get, lambda _: [T]) == 8
    longest = max(len(page.tex(e)) for e in page.equations.notation.meanings.values())
    assert longest < 4_000


@pytest.mark.parametrize("name", PRINTED)
def test_every_article_prints_its_inverse_or_the_reason(name):
    found = derivation(name)
    text = committed(name).get("inverse.tex")
    if found.hybrid is not None and found.hybrid.forward.open:
        assert text is None
        return
    assert ("There is no closed form" in text) == (not found.inverse.solved)
    assert name not in NAMES or bool(found.inverse.solved) == (name in SOLVED)
    steps = [step for solved in found.inverse.solved.values() for step in solved.work.steps]
    assert len(re.findall(r"\\textbf\{Step", text)) >= bool(steps)
    assert (text.count(r"$\det M$") == 1) == bool(found.inverse.written)
    assert_readable(text)


@pytest.mark.parametrize("name", ALL)
def test_committed_inverses_print_no_internal_name(name):
    path = GENERATED / name / "latex" / "inverse.tex"
    assert path.exists() or name not in NAMES
    if path.exists():
        text = path.read_text()
        assert_readable(text)
        assert name not in NAMES or ("There is no closed form" in text) == (name not in SOLVED)


def assert_readable(text):
    """Assert that the printed inverse kinematics function is short and has no internal names."""
    assert not re.search(r"(?<![\w\\}$])_(sign|[tkrpuc])?\d", text)
    for unwanted in ("zoo", "nan", "sqrt(", "Piecewise", "e-150", "e-300", "_swivel", "_total"):
        assert unwanted not in text
    assert len(text) < 12_000


@pytest.mark.parametrize("name", EVALUATED)
def test_every_coordinate_is_solved_fixed_or_free(name):
    page, tasks = page_and_tasks(name)
    for task in tasks.values():
        symbols = {s for _, given in task.inputs for s in given}
        found = {step.name for step in task.steps} | {q for q, _ in task.rest} | {*task.free}
        assert {*page.equations.notation.q} <= found | symbols


def test_ur5e_inverse_is_printed_as_in_textbooks():
    text = committed("ur5e")["inverse.tex"]
    assert r"It solves $-W_{y} \cos q_{1} + W_{x} \sin q_{1} = d_{4}$" in text
    assert r"W_{x} &= p_{x} - d_{6} r_{13}" in text
    assert r"\theta_{2} = q_{2} + q_{3} + q_{4}$" in text
    assert r"It solves $2 a_{2} a_{3} \cos q_{3} = C_{5}$" in text
    assert r"q_{4} &= \theta_{2} - q_{2} - q_{3}." in text
    assert r"$\sigma_{3}$ ($q_{3}$) & $+$ & $-$" in text


def test_wrist_equations_use_sum_of_parallel_joint_angles():
    text = committed("puma560")["inverse.tex"]
    assert r"B_{4} &= c_{23} t_{21} + s_{23} r_{33}" in text


def test_printed_inverse_avoids_letters_of_parameters():
    arm = """name = "arm"
convention = "dh"
[parameters]
A1 = "0.1"
C = "0.2"
W = "0.3"
[[joints]]
a = "A1 + W"
[[joints]]
a = "C"
[[joints]]
a = "W"
"""
    text = inverse(Page.of(derive(read_text(arm, file="arm.toml"), functions=["fk"])))
    assert r"\mathcal{C}_{1} &=" in text
    assert r"\mathcal{A}_{2} &=" in text or "A_{2}" not in text
    assert r"V_{x} &= p_{x} - W r_{11}" in text


def test_article_measures_deviation_from_nearest_structure():
    text = committed("jaco2")["inverse.tex"]
    assert "spherical wrist: it requires that axes" in text
    assert "(off by up to 37 mm)" in text
    assert r"\ell" in text


def test_angle_sums_respect_axis_sense_and_direction():
    """The sign of a joint angle in a sum depends on the joint axis and the coordinate direction."""
    arm = read_text(
        """name = "arm"
convention = "dh"
[[joints]]
a = "0.4"
direction = -1
[[joints]]
a = "0.3"
alpha = "pi"
[[joints]]
a = "0.2"
""",
        file="arm.toml",
    )
    page = Page.of(derive(arm, functions=["fk"]))
    (total,) = [
        s.unknown
        for s in printed_tasks(page, page.inverse, {})["ik"].steps
        if not s.unknown.is_Symbol
    ]
    one, two, three = page.equations.notation.q
    assert total == one - two + three
