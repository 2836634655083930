"""LaTeX articles with parametric functions and model reports compile.

The product of the printed parametric transforms equals the tool pose.
"""

import re
import subprocess

import numpy as np
import pytest

from chasles.derive import derive, model_report, read, read_text
from chasles.derive.build.generate import put
from chasles.derive.description.conventions import dh, mdh
from chasles.derive.latex import FOLDER, files, fragments, model_quality
from chasles.derive.latex.chain.parameter_table import parameter_table
from chasles.derive.latex.setting.printer import Printer
from chasles.derive.program.programs import NO_PROGRAMS
from chasles.derive.terms.casadi_graph import lower
from tests.support.convention_robots import sagging_ur5e
from tests.support.derivations import ROBOTS, committed
from tests.support.tools import needs

REPORT = r"""\documentclass{article}
\usepackage{amsmath,booktabs}
\begin{document}
%s
\end{document}
"""


@pytest.fixture(scope="module")
def sagging():
    return derive(read_text(sagging_ur5e()), functions=["fk", "fk_p"])


@pytest.fixture(scope="module")
def written(sagging):
    """Return the LaTeX files of the arm with gravity deflection, keyed by path."""
    return files(sagging, NO_PROGRAMS)


def compiled(folder, name):
    arguments = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", name]
    done = subprocess.run(arguments, cwd=folder, capture_output=True, check=False)
    log = (folder / f"{name}.log").read_text(errors="replace")
    assert done.returncode == 0, log[-2000:]
    assert "undefined" not in log.lower()
    assert max(map(float, re.findall(r"Overfull \\hbox \(([\d.]+)pt", log)), default=0) < 1


@needs("pdflatex")
def test_parametric_article_and_model_report_compile(tmp_path, sagging, written):
    put(written, tmp_path)
    compiled(tmp_path, sagging.robot.name)
    report = model_report(read(ROBOTS / "scara.toml"), conventions=(dh, mdh))
    (tmp_path / "report.tex").write_text(REPORT % model_quality(report))
    compiled(tmp_path, "report")


def test_parametric_fragment_is_printed_only_on_request():
    robot = read(ROBOTS / "scara.toml")
    assert "parametric.tex" in fragments(derive(robot, functions=["fk", "fk_p"]))
    assert "parametric.tex" not in committed("scara")


def test_parametric_fragment_lists_all_parameters(sagging, written):
    text = written[f"{FOLDER}/parametric.tex"]
    count = len(sagging.geometry.parameters)
    assert f"${count}$ parameters" in text
    assert rf"p_{{{count}}}" in text
    assert r"d = 0.1625" in text
    assert r"+ p_{45} \tau_{1}" in text


@needs("pdflatex")
def test_parametric_fragment_of_loops_is_printed_and_compiles(tmp_path):
    derived = derive(read(ROBOTS / "five_bar.toml"), functions=["fk_p"])
    texts = files(derived, NO_PROGRAMS)
    text, count = texts[f"{FOLDER}/parametric.tex"], len(derived.geometry.parameters)
    assert f"${count}$ parameters" in text
    assert rf"p_{{{count}}}" in text
    assert r"\mathit{length} = 0.3" in text
    assert r"\input{latex/parametric}" in texts["five_bar.tex"]
    assert "parametric.tex" not in committed("five_bar")
    (tmp_path / "fragment.tex").write_text(REPORT % text)
    compiled(tmp_path, "fragment")


TOKEN = re.compile(r"([RT])_\{?([xyz])\}?\(([^()]*)\)|(T)\(([^()]*)\)")


def test_printed_parametric_product_equals_the_pose(sagging, written):
    """The product of the printed transforms equals the tool pose, also for changed parameters."""
    text = written[f"{FOLDER}/parametric.tex"]
    random = np.random.default_rng(4)
    q = random.uniform(-2, 2, 6)
    p = [float(sagging.terms.value(g.value)) for g in sagging.geometry.parameters]
    for k, item in enumerate(sagging.geometry.parameters):
        p[k] += random.normal() * 0.1 if item.part in ("base", "joint", "axis", "tool") else 0
    T = np.eye(4)
    for k in range(7):
        (body,) = re.findall(rf"A_\{{{k}\}} &= (.*?)\\end\{{aligned\}}", text, re.DOTALL)
        for kind, axis, argument, _, vector in TOKEN.findall(body):
            values = [number(part, p) for part in (vector or argument).split(",")]
            T = T @ step(kind or "T", axis, values)
        if k < 6:
            T = T @ step("R", "z", [q[k]])
    _, fk_p = lower(sagging.functions, "sagging")
    np.testing.assert_allclose(T, np.array(fk_p(q, p)).reshape(4, 4), atol=1e-12)


def number(text, p):
    terms = re.findall(r"(-?)\s*(?:p_\{(\d+)\}|(\d+(?:\.\d+)?(?:e-?\d+)?))", text)
    values = [p[int(index) - 1] if index else float(constant) for _, index, constant in terms]
    return sum(-v if sign else v for (sign, *_), v in zip(terms, values, strict=True))


def step(kind, axis, values):
    T = np.eye(4)
    if kind == "R":
        i = "xyz".index(axis)
        j, k = (i + 1) % 3, (i + 2) % 3
        c, s = np.cos(values[0]), np.sin(values[0])
        T[j, j], T[j, k], T[k, j], T[k, k] = c, -s, s, c
    elif axis:
        T["xyz".index(axis), 3] = values[0]
    else:
        T[:3, 3] = values
    return T


def first_row(sagging, places):
    """Return the symbols in the first row of the table of base-frame parameters."""
    base = [one for one in sagging.geometry.parameters if one.joint == "base"]
    printer = Printer({one.symbol: f"p_{{{one.symbol.name[1:]}}}" for one in base}, {})
    table = parameter_table([base[k] for k in places], printer)
    return next(line for line in table.splitlines() if "& base &" in line).split(" & ")[0]


@pytest.mark.parametrize(
    ("places", "symbols"),
    [
        pytest.param([0, 1], "$p_{9}$, $p_{10}$", id="two symbols in full"),
        pytest.param([0, 1, 2], r"$p_{9}, \dots, p_{11}$", id="a run by its ends"),
        pytest.param([0, 1, 3], "$p_{9}$, $p_{10}$, $p_{12}$", id="a gap in full"),
    ],
)
def test_table_shortens_runs_of_symbols_only(sagging, places, symbols):
    assert first_row(sagging, places) == symbols
