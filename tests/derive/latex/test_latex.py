"""Formulas in LaTeX articles are correct, unambiguous and reproducible."""

import os
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from chasles.derive import Joint, SerialRobot, derive, read, read_text
from chasles.derive.latex import FOLDER, brief_files, document, equations, files, fragments
from chasles.derive.latex.chain.given_fragment import parameters
from chasles.derive.latex.setting.layout import aligned, filled
from chasles.derive.latex.setting.names import distinct, escape, parameter
from chasles.derive.latex.setting.notation import Notation
from chasles.derive.latex.setting.page import Page
from chasles.derive.latex.setting.printer import Printer, number
from chasles.derive.latex.setting.screw_displays import printed_screws
from chasles.derive.latex.setting.transforms import matrix, placements
from chasles.derive.latex.setting.widths import LINE, width
from chasles.derive.program.programs import NO_PROGRAMS
from chasles.derive.terms.casadi_graph import lower
from tests.laws.lie import exp_screw
from tests.support.derivations import GENERATED, NAMES, committed, derivation
from tests.support.printed_robots import BY_NAME, awkward, derived, joint, parallel, printed

FILES = [f"{name}.tex" for name in ("parameters", "drawing", "symbols", "screws")]
FILES += ["transforms.tex", "fk.tex", "jacobian.tex", "inverse.tex", "singularities.tex"]
FILES += ["workspace.tex", "example.tex", "references.tex"]
EVALUATED = ("iiwa14", "jaco2", "photo_robot", "awkward", "calibrated", "tilted", "named_wrist")
EVALUATED += ("fourteen", "random0", "random3")
"""Robots whose printed formulas are evaluated. Together, these robots have every kind of joint,
constant and name."""
REPRINTED = ("scara", "iiwa14", "four_bar", "slider_crank", "planar_3rrr", "bricklaying_gantry")
"""Robots of every kind whose new LaTeX articles are compared with the committed articles."""
SMALL = tuple(name for name in EVALUATED if name != "fourteen")
TRUE = 1e-12
"""Tolerance of sums of a few dozen double-precision products of size 1."""
R = sp.Rational


class Reader:
    """Evaluates the equations of a LaTeX article."""

    def __init__(self, found, notation, q):
        self.known = {s: v.evalf(30) for s, v in found.terms.parameters.items()}
        self.known |= {s: sp.Float(v, 30) for s, v in zip(notation.q, q, strict=True)}
        for symbol, meaning in notation.meanings.items():
            self.known[symbol] = self(meaning)

    def __call__(self, expression):
        value = expression.xreplace(self.known).evalf(30)
        assert not value.free_symbols, f"{value.free_symbols} are used before they are defined"
        return value

    def define(self, definitions):
        for symbol, expression in definitions:
            assert symbol not in self.known
            self.known[symbol] = self(expression)

    def matrix(self, entries, rows):
        return np.array([float(self(entry)) for entry in entries]).reshape(rows, -1)


def some_q(found):
    count = len(found.robot.coordinates)
    return np.random.default_rng(7).uniform(-2.5, 2.5, count)


@pytest.mark.parametrize("name", EVALUATED)
def test_printed_fk_and_jacobians_match_compiled_functions(name):
    found = derived(name)
    printed, q = equations(found), some_q(found)
    reader = Reader(found, printed.notation, q)
    for function, rows in (("fk", 4), ("jacobian_mixed", 6), ("jacobian_space", 6)):
        shown = getattr(printed, function)
        reader.define(shown.definitions)
        values = reader.matrix(shown.entries, rows)
        for named, entry in zip(shown.names, shown.entries, strict=False):
            if named is not None:
                reader.define([(named, entry)])
        (kernel,) = lower([found.function(function)], name)
        expected = np.array(kernel(q)).reshape(rows, -1)
        np.testing.assert_allclose(values, expected, rtol=0, atol=TRUE * (1 + abs(expected).max()))


@pytest.mark.parametrize("name", SMALL)
def test_printed_link_transforms_multiply_to_the_pose(name):
    found = derived(name)
    notation, q = equations(found).notation, some_q(found)
    links = [matrix(placement, notation) for placement in placements(found.robot, notation.q)]
    reader = Reader(found, notation, q)
    T = np.eye(4)
    for link in links:
        T = T @ reader.matrix(link, 4)
    (kernel,) = lower([found.function("fk")], name)
    np.testing.assert_allclose(T, np.array(kernel(q)).reshape(4, 4), rtol=0, atol=20 * TRUE)


@pytest.mark.parametrize("name", EVALUATED)
def test_product_of_exponentials_of_printed_screws_equals_pose(name):
    found = derived(name)
    notation, q = equations(found).notation, some_q(found)
    screws = printed_screws(found.robot, notation)
    reader = Reader(found, notation, q)
    reader.define(screws.definitions)
    T = sp.eye(4)
    for k, value in enumerate(found.robot.joint_values([sp.Float(x, 30) for x in q])):
        T = T * _exponential(screws.S[:, k].applyfunc(reader), value)
    T = T * screws.M.applyfunc(reader)
    (kernel,) = lower([found.function("fk")], name)
    expected = np.array(kernel(q)).reshape(4, 4)
    np.testing.assert_allclose(np.array(T, float), expected, rtol=0, atol=20 * TRUE)


def _exponential(screw, theta):
    """Return the exponential of a numerical unit screw."""
    symbols = sp.Matrix(sp.symbols("v1:4 w1:4", real=True))
    if all(abs(entry) < TRUE for entry in screw[3:]):
        symbols[3:, 0] = sp.zeros(3, 1)
    values = dict(zip(symbols, screw, strict=True))
    return exp_screw(symbols, theta).xreplace(values)


@pytest.mark.parametrize("name", [*NAMES, "awkward", "calibrated", "tilted"])
def test_no_internal_name_is_printed(name):
    for file, text in printed(name).items():
        assert not re.search(r"(?<![\w\\}$])_[tk]?\d", text), file
        assert "_t" not in text.replace("\\_t", ""), file
        assert "_k" not in text.replace("\\_k", ""), file


def test_fragments_and_document_name_the_same_files():
    texts = files(derivation("scara"), NO_PROGRAMS)
    assert list(texts) == ["scara.tex", *(f"{FOLDER}/{name}" for name in FILES)]
    inputs = re.findall(r"\\input\{latex/(\w+)\}", texts["scara.tex"])
    own = [f"{name}.tex" for name in inputs]
    assert own[0] == "drawing.tex"
    assert sorted(own) == sorted(FILES)


@pytest.mark.parametrize("name", REPRINTED)
def test_printed_article_equals_the_committed_article(name):
    """For robots that are not in REPRINTED, other tests check the committed files."""
    texts = files(derivation(name), NO_PROGRAMS)
    assert texts.pop(f"{name}.tex") == (GENERATED / name / f"{name}.tex").read_text()
    assert texts == {f"{FOLDER}/{file}": text for file, text in committed(name).items()}


def test_partial_derivation_prints_the_full_article():
    robot = derivation("scara").robot
    assert fragments(derive(robot, functions=["twist_mixed"])) == committed("scara")


PRINT = """import sys
from tests.support.printed_robots import printed
sys.stdout.buffer.write("".join(printed("awkward").values()).encode())
"""


def test_article_is_independent_of_hash_seed():
    """Python runs with different hash seeds print the same LaTeX article."""
    seed = "1" if os.environ.get("PYTHONHASHSEED") == "20" else "20"
    done = subprocess.run(
        [sys.executable, "-c", PRINT],
        env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        check=True,
    )
    assert done.stdout.decode() == "".join(printed("awkward").values())


@pytest.mark.parametrize(
    ("name", "tex"),
    [
        ("d1", "d_{1}"),
        ("a_2", "a_{2}"),
        ("alpha_1", r"\alpha_{1}"),
        ("gamma0", r"\gamma_{0}"),
        ("l_HI", "l_{HI}"),
        ("r40", "r_{40}"),
        ("df", "d_{f}"),
        ("z_G", "z_{G}"),
        ("theta_ee", r"\theta_{\mathrm{ee}}"),
        ("reach", r"\mathit{reach}"),
        ("l_2_3", "l_{2,3}"),
    ],
)
def test_parameter_names_become_latex_symbols(name, tex):
    assert parameter(name) == tex


def test_parameters_with_equal_symbols_are_made_distinct():
    assert distinct(["d1", "d_1"]) == {"d1": "d_{1}", "d_1": r"\mathtt{d\_1}"}


def test_letters_used_by_parameters_are_avoided():
    letters = equations(derived("awkward")).notation.letters
    assert letters == {
        "cos": "C",
        "sin": "S",
        "term": "u",
        "constant": r"\kappa",
        "geometry": "b",
        "rotation": "r",
        "position": "o",
    }


def notation_of(count):
    robot = parallel(count)
    found = derive(robot, functions=["fk"])
    q = found.functions[0].inputs[0].symbols
    notation = Notation(robot, found.terms, q)
    return notation, Printer(notation.tex, notation.order), q


@pytest.mark.parametrize(
    ("angle", "cosine", "sine"),
    [
        (lambda q: q[0], "c_{1}", "s_{1}"),
        (lambda q: q[1] + q[2], "c_{23}", "s_{23}"),
        (lambda q: q[0] + q[1] - q[3], r"c_{12\bar{4}}", r"s_{12\bar{4}}"),
        (lambda q: q[3] - q[1], r"c_{2\bar{4}}", r"-s_{2\bar{4}}"),
        (lambda q: q[4] - sp.pi / 4, r"\hat{c}_{5}", r"\hat{s}_{5}"),
        (lambda q: 2 * q[4] + R(1, 10), r"\hat{c}_{5}", r"\hat{s}_{5}"),
    ],
    ids=["q1", "q2+q3", "q1+q2-q4", "q4-q2", "q5-pi/4", "2q5+1/10"],
)
def test_trigonometric_terms_get_short_symbols(angle, cosine, sine):
    notation, printer, q = notation_of(6)
    shown = [notation.trigonometric(f(angle(q), evaluate=False)) for f in (sp.cos, sp.sin)]
    assert [printer.tex(symbol) for symbol in shown] == [cosine, sine]


def test_short_symbols_stay_unique_for_many_joints_and_offsets():
    notation, printer, q = notation_of(14)
    assert printer.tex(notation.trigonometric(sp.cos(q[9] + q[10]))) == "c_{10,11}"
    assert printer.tex(notation.trigonometric(sp.cos(q[11]))) == "c_{12}"
    assert printer.tex(notation.trigonometric(sp.cos(q[0] + q[1]))) == "c_{1,2}"
    assert printer.tex(notation.trigonometric(sp.sin(sum(q)))) == "s_{1:14}"
    assert printer.tex(notation.trigonometric(sp.sin(sum(q[:12]) - q[12]))) == r"s_{1:12,\bar{13}}"
    shifted = [notation.trigonometric(sp.cos(q[6] + R(k, 10))) for k in range(1, 6)]
    assert [printer.tex(symbol) for symbol in shifted] == [
        *(rf"\{accent}{{c}}_{{7}}" for accent in ("hat", "tilde", "check", "breve")),
        r"\hat{c}'_{7}",
    ]


def test_products_and_sums_are_printed_in_conventional_order():
    notation, printer, q = notation_of(6)
    c1, c2, s2 = (notation.trigonometric(e) for e in (sp.cos(q[0]), sp.cos(q[1]), sp.sin(q[1])))
    a1, a2 = sp.symbols("a1 a2", real=True)
    assert printer.tex(c1 * a2 * c2) == "a_{2} c_{1} c_{2}"
    assert printer.tex(-a2 * c2 + a1 * c1) == "a_{1} c_{1} - a_{2} c_{2}"
    assert printer.tex(a2 * c2 - a1 * c1) == "a_{2} c_{2} - a_{1} c_{1}"
    assert printer.tex(-c1 * (c2 - s2 * a2)) == "-c_{1} (c_{2} - a_{2} s_{2})"
    assert printer.tex(c1**2 / 2) == "0.5 c_{1}^{2}"


@pytest.mark.parametrize(
    ("value", "tex"),
    [
        (R(-17, 40), "-0.425"),
        (sp.Integer(120), "120"),
        (R(1, 3), r"\tfrac{1}{3}"),
        (-R(2, 7), r"-\tfrac{2}{7}"),
        (sp.pi / 2, r"\pi/2"),
        (-3 * sp.pi / 4, r"-3\pi/4"),
        (sp.sqrt(2) / 2, r"\tfrac{\sqrt{2}}{2}"),
        (sp.Float("0.12345678901234567890", 20), r"0.1234567890\ldots"),
        (sp.Float("-0.00001999999999999", 20), r"-0.00001999999999\ldots"),
    ],
)
def test_numbers_are_printed_as_decimals_fractions_or_roots(value, tex):
    assert number(value) == tex


@pytest.mark.parametrize(
    ("text", "tex"),
    [
        ("50 % & more", r"50 \% \& more"),
        ("a_b", r"a\_b"),
        (
            "a_rather_long_one",
            r"a\_\allowbreak{}rather\_\allowbreak{}long\_\allowbreak{}on\allowbreak{}e",
        ),
        (r"\input{x}", r"\textbackslash{}input\{x\}"),
        ("$x^2~#", r"\$x\textasciicircum{}2\textasciitilde{}\#"),
        ("é β 中", r"é \ensuremath{\beta} [U+4E2D]"),
        ("a\n\n b\x00", "a b[U+0000]"),
    ],
    ids=["ampersand", "underscore", "break points", "command", "special", "unicode", "control"],
)
def test_text_is_escaped(text, tex):
    assert escape(text) == tex


@pytest.mark.parametrize("title", ["Peaucellier's linkage", "Scissor lifts", "ABB IRB 460"])
def test_title_is_printed_on_its_own_line(title):
    text = f'name = "r"\ntitle = "{title}"\nconvention = "dh"\njoints = [{{ a = 1 }}]'
    article = document(derive(read_text(text), functions=("fk",)))
    assert f"{{\\LARGE {title}}}\\\\[1ex]\n\\large Kinematics\n" in article


def test_long_words_can_break():
    assert escape("x" * 40).count(r"\allowbreak") == 2


def parameters_of(robot):
    return parameters(Page.of(derive(robot, functions=["fk"])))


def test_mixed_conventions_are_printed_as_table_of_transforms():
    table = printed("awkward")["parameters.tex"]
    assert r"1 & lift & P & $T_z(c_{1})\,T_z(\theta_{1})$" in table
    turned = r"$R_z(\theta_{3})\,T_z(\theta_{3} h)\,T_x(s_{1})\,R_x(\alpha_{2})$"
    assert rf"3 & screw & H & {turned}" in table
    assert r"4 & follow & R & $R_z(\theta_{4})\,T_x(p_{1})\,R_x(\pi/2)$" in table
    assert r"5 & back & R & $R_x(\pi/3)\,T_x(0.25)\,R_z(-\theta_{5})$" in table
    assert table.count(r"\begin{tabular}") == 2
    assert r"\theta_{4} &= 2 q_{2} + 0.1" in printed("awkward")["couplings.tex"]


def test_two_conventions_are_printed_as_parameter_tables():
    robot = awkward()
    table = parameters_of(replace(robot, joints=robot.joints[:4]))
    assert r"1 & lift & P & $0$ & $c_{1} + q_{1}$ & $0$ & $0$" in table
    assert r"3 & screw & H & $q_{3}$ & $0$ & $s_{1}$ & $\alpha_{2}$" in table
    assert r"4 & follow & R & $2 q_{2} + 0.1$" in table


def urdf(folder, *joints):
    """Write the URDF file of a chain.

    Each joint is a tuple (name, type, axis, roll, further XML elements).
    """
    parts = ['<robot name="chain"><link name="l0"/>']
    for k, (name, kind, axis, roll, more) in enumerate(joints, 1):
        parts.append(
            f'<link name="l{k}"/><joint name="{name}" type="{kind}"><parent link="l{k - 1}"/>'
            f'<child link="l{k}"/><origin xyz="0.1 0.2 0.5" rpy="{roll} 0 0.3"/>'
            f'<axis xyz="{axis}"/>{more}<limit lower="-2" upper="2"/></joint>'
        )
    path = folder / "chain.urdf"
    path.write_text("\n".join([*parts, "</robot>"]))
    return read(path)


SLIDERS = [("sx", "1 0 0"), ("sy", "0 1 0"), ("sz", "0 0 1")]


def test_urdf_prismatic_variable_has_its_own_column(tmp_path):
    robot = urdf(tmp_path, *((name, "prismatic", axis, "0", "") for name, axis in SLIDERS))
    table = parameters_of(robot)
    roll, pitch, yaw = (rf"$\mathrm{{{angle}}}$" for angle in ("roll", "pitch", "yaw"))
    assert rf"$x$ & $y$ & $z$ & {roll} & {pitch} & {yaw} & $e_x$ & $e_y$ & $e_z$ & $q$ &" in table
    for k, (name, axis) in enumerate(SLIDERS, 1):
        e = " & ".join(f"${x}$" for x in axis.split())
        origin = "$0.1$ & $0.2$ & $0.5$ & $0$ & $0$ & $0.3$"
        assert f"{k} & {name} & P & {origin} & {e} & $q_{{{k}}}$ & $\\pm 2$" in table


def test_urdf_and_toml_files_print_the_same_table(tmp_path):
    robot = urdf(tmp_path, *((name, "prismatic", axis, "0", "") for name, axis in SLIDERS))
    joints = [
        f'[[joints]]\nname = "{name}"\ntype = "prismatic"\nxyz = ["0.1", "0.2", "0.5"]\n'
        f'rpy = [0, 0, "0.3"]\naxis = [{", ".join(axis.split())}]\nlimits = [-2, 2]\n'
        for name, axis in SLIDERS
    ]
    path = tmp_path / "chain.toml"
    path.write_text("\n".join(['name = "chain"\nconvention = "urdf"\n', *joints]))
    assert parameters_of(robot) == parameters_of(read(path))


@pytest.mark.parametrize("convention", ["urdf", "poe"])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_reversed_joint_variable_is_printed_with_minus_sign(convention, kind):
    axis = (R(1), R(0), R(0))
    at = {"urdf": {"xyz": (0, 0, R(1, 2)), "rpy": (0, 0, 0)}, "poe": {"point": (0, 0, R(1, 2))}}
    vectors = {f: tuple(map(sp.sympify, v)) for f, v in at[convention].items()} | {"axis": axis}
    found = BY_NAME[convention]
    before, after = found(kind, **vectors)
    given = found.scalars(vectors)
    back = Joint("back", kind, before, after, direction=-1, convention=found, given=given)
    table = parameters_of(SerialRobot("one", (back,)))
    assert "$q$ & limits" in table
    assert "& $-q_{1}$ & --" in table
    assert "& $0.5$ " in table


@pytest.mark.parametrize(
    ("convention", "turning", "sliding"),
    [
        ("dh", "theta", "d"),
        ("mdh", "theta", "d"),
        ("hayati", "theta", None),
        ("mdh5", "theta", None),
        ("hayati5", "theta", "d"),
        ("s_model", "theta", "z"),
    ],
)
def test_joint_variable_stands_in_column_of_its_convention(convention, turning, sliding):
    joints = (joint("turn", convention), joint("slide", convention, "prismatic"))
    table = parameters_of(SerialRobot("two", joints))
    header, *rows = re.findall(r"^(?:\$i\$|\d) & .*(?= \\\\)", table, re.MULTILINE)
    headings = header.split(" & ")
    for row, field, q in zip(rows, (turning, sliding), ("$q_{1}$", "$q_{2}$"), strict=True):
        cells = dict(zip(headings, row.split(" & "), strict=True))
        assert [head for head, cell in cells.items() if cell == q] == [
            f"${parameter(field)}$" if field else "$q$"
        ]
    assert (r"right after $R_z(\theta)$" in table) == (sliding is None)


def test_moving_joints_are_numbered_separately_from_fixed_joints(tmp_path):
    robot = urdf(
        tmp_path,
        ("mount", "fixed", "1 0 0", "0", ""),
        ("leader", "revolute", "0 0 1", "0", ""),
        ("bracket", "fixed", "1 0 0", "0", ""),
        ("follower", "revolute", "0 0 1", "0", '<mimic joint="leader" multiplier="2"/>'),
    )
    found = fragments(derive(robot, functions=["fk"]))
    table, screws = found["parameters.tex"], found["screws.tex"]
    assert "$i$ & $k$ & joint" in table
    for row in ("1 & -- & mount", "2 & 1 & leader", "3 & -- & bracket", "4 & 2 & follower"):
        assert row in table
    assert "3 & -- & -- & -- & -- & --" in table
    assert r"\theta_{2} &= 2 q_{1}" in found["couplings.tex"]
    assert r"$\mathcal{S}_{k} = (v_{k}; \omega_{k})$" in screws


def test_snapped_numbers_are_printed_as_a_table(tmp_path):
    half, tiny = "3.1416", "1.2e-16"
    joints = [("a_1", half), ("b", tiny), ("c", half)]
    robot = urdf(tmp_path, *((name, "revolute", "0 0 1", roll, "") for name, roll in joints))
    table = parameters_of(robot)
    assert r"in total, the replacements change the pose of the tool by at most $" in table
    assert r"$3.1416$ & $\pi$ & roll of a\_1; roll of c" in table
    assert r"up to $1.2 \cdot 10^{-16}$ & $0$ & roll of b" in table
    assert "Notes" not in table


def test_robot_notes_are_printed_with_escapes():
    robot = SerialRobot("noted", (joint("j", "dh"),), notes=("100 % new", "a_b"))
    table = parameters_of(robot)
    assert r"Notes: 100 \% new; a\_b." in table


def test_plain_angle_symbols_precede_accented_symbols():
    rows = committed("panda")["symbols.tex"]
    assert rows.index("$c_{7}$") < rows.index(r"$\hat{c}_{7}$")


def test_units_are_stated_only_once():
    found = printed("awkward")
    assert found["parameters.tex"].count("in meters and radians") == 1
    assert "where the joint positions are" in found["screws.tex"]
    assert not re.search("^with", found["screws.tex"], re.MULTILINE)


def test_long_sums_break_between_terms():
    terms = ["a", *["+ a"] * 200]
    lines = filled(terms, LINE)
    assert " ".join(lines).split() == " ".join(terms).split()
    assert all(width(line) <= LINE for line in lines)
    assert len(lines) == pytest.approx(width(" ".join(terms)) / LINE, abs=3)
    assert aligned([("y", terms)]).count(r"\quad") == len(lines) - 1


def test_article_size_grows_linearly_with_joint_count():
    derivations = [derive(parallel(n), functions=["fk"]) for n in (2, 4)]
    lengths = [sum(map(len, fragments(found).values())) for found in derivations]
    assert lengths[1] < 1.5 * lengths[0]


def test_brief_article_inputs_exactly_its_fragments():
    written = brief_files(derivation("scara"), None)
    inputs = re.findall(r"\\input\{(latex/\w+)\}", written["scara.tex"])
    assert sorted(f"{name}.tex" for name in inputs) == sorted(set(written) - {"scara.tex"})
    assert "latex/fk.tex" in written
    assert "latex/example.tex" not in written


def test_worked_example_prints_its_own_configuration():
    text = committed("ur5e")["example.tex"]
    assert "has 8 solutions" in text
    assert "$20.00$ & $-50.00$ & $70.00$ & $30.00$ & $40.00$ & $-60.00$" in text


def test_references_list_only_cited_works():
    listed = committed("ur5e")["references.tex"]
    assert "Brockett" in listed
    assert "Denavit" in listed
    assert "Raghavan" not in listed
    assert "Raghavan" in committed("jaco2")["references.tex"]
