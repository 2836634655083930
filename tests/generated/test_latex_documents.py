"""Every LaTeX document compiles without undefined references; no line exceeds the page width."""

import re
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from chasles.derive import Coupling, Joint, Parameter, SerialRobot, derive, read, read_text
from chasles.derive.description.conventions import dh
from chasles.derive.latex import FOLDER, files
from chasles.derive.model.mechanism import Mechanism
from tests.support.derivations import robot_of
from tests.support.generators.planar_platforms import drawn_platform
from tests.support.tools import needs
from tests.support.waiting import SECONDS

pytestmark = needs("pdflatex")

WIDEST_EXCESS = 1.0
"""Maximum extension of a line into the page margin (pt), too small to be visible."""
MAX_PAGES = 12
MAX_PAGES_OF_LOOPS = 20
MAX_PAGES_OF_BUILT = 30
PICTURES = ("drawing.tex", "workspace.tex")
"""Fragments that need the LaTeX package TikZ. A LaTeX article without TikZ omits these fragments.
"""
SHIPPED = ("ur5e", "well_manipulator", "stewart_gough")
"""Tested shipped robots: an arm, a mechanism with loops, and a platform. `make docs` compiles the
documents of all robots."""
PLAIN = r"""\documentclass{article}
\usepackage{amsmath}
\usepackage{booktabs}
\begin{document}
%s
\end{document}
"""
HOSTILE = r"100 % & _all_ {of} #1 ~ ^ \ $x$ <|> \input{x} é β 中 `'\"--- " + "longest" * 30


def hostile():
    """Return a robot with a helical joint, a coupled joint, and special LaTeX characters."""
    h, s_1, long_name = sp.symbols("h s_1 a_length_of_many_words", real=True)
    zero, quarter, odd = sp.Integer(0), sp.pi / 2, sp.Rational(3, 10)
    rows = (
        ("revolute", s_1, quarter, odd),
        ("helical", h, sp.Rational(2, 5), zero),
        ("revolute", long_name, zero, odd),
        ("prismatic", zero, quarter, zero),
        ("revolute", s_1, odd, zero),
    )
    joints = []
    for k, (kind, a, alpha, theta) in enumerate(rows):
        before, after = dh(kind, a=a, alpha=alpha, d=zero, theta=theta)
        pitch = h if kind == "helical" else zero
        given = (("a", a), ("alpha", alpha), ("d", zero), ("theta", theta))
        joints.append(
            Joint(
                f"joint_{k}",
                kind,
                before,
                after,
                limits=(-odd, odd),
                pitch=pitch,
                convention=dh,
                given=given,
            )
        )
    parameters = tuple(Parameter(str(s), odd, meaning=HOSTILE) for s in (h, s_1, long_name))
    return SerialRobot(
        "hostile",
        tuple(joints),
        title=HOSTILE,
        source=HOSTILE,
        parameters=parameters,
        base_frame="base_frame",
        tool_frame="tool_frame",
        notes=(HOSTILE,),
        couplings=(Coupling("joint_2", (("joint_0", -2),), odd),),
    )


def chain(count, *, crossed):
    """Return a chain of ``count`` joints with crossed or parallel axes."""
    zero = sp.Integer(0)
    lengths = [sp.Symbol(f"a{k}", real=True) for k in range(1, count + 1)]
    joints = []
    for k, a in enumerate(lengths):
        alpha = sp.pi / 2 if crossed else zero
        before, after = dh("revolute", a=a, alpha=alpha, d=zero, theta=zero)
        joints.append(Joint(f"joint{k}", "revolute", before, after))
    parameters = tuple(Parameter(str(a), sp.Rational(1, 3)) for a in lengths)
    return SerialRobot("chain", tuple(joints), parameters=parameters)


def calibrated():
    """Return a six-joint robot with symbolic parameters."""
    parameters, joints = [], []
    for k in range(1, 7):
        own = {f: sp.Symbol(f"{f}_{k}", real=True) for f in ("a", "alpha", "d", "theta")}
        parameters += [
            Parameter(str(s), sp.Rational(k, 7), "length" if f in "ad" else "angle")
            for f, s in own.items()
        ]
        joints.append(Joint(f"joint{k}", "revolute", *dh("revolute", **own)))
    return SerialRobot("calibrated", tuple(joints), parameters=tuple(parameters))


def imported():
    rows = (
        ("mount", "fixed", "1 0 0", "3.14159265358979"),
        ("slider_along_x", "prismatic", "1 0 0", "-1.57079632679"),
        ("slider_along_y", "prismatic", "0 1 0", "1.2246467991473532e-16"),
        ("slider_along_z", "prismatic", "0 0 -1", "0.785398163397"),
        ("bracket", "fixed", "1 0 0", "-3.14159265358979"),
        ("elbow", "revolute", "1 2 3", "1.57079632679"),
    )
    parts = ['<robot name="gantry"><link name="l0"/>']
    for k, (name, kind, axis, roll) in enumerate(rows, 1):
        mimic = '<mimic joint="slider_along_y" offset="0.1"/>' if name == "slider_along_z" else ""
        parts.append(
            f'<link name="l{k}"/><joint name="{name}" type="{kind}"><parent link="l{k - 1}"/>'
            f'<child link="l{k}"/><origin xyz="0.1 0 0.25" rpy="{roll} {roll} {roll}"/>'
            f'<axis xyz="{axis}"/>{mimic}<limit lower="-2" upper="2"/></joint>'
        )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "gantry.urdf"
        path.write_text("".join([*parts, "</robot>"]), encoding="utf-8")
        return read(path)


BUILT = {
    "hostile": hostile,
    "calibrated": calibrated,
    "crossed14": lambda: chain(14, crossed=True),
    "parallel14": lambda: chain(14, crossed=False),
    "imported": imported,
}


@cache
def printed(name):
    """Return a robot, its LaTeX document, and its LaTeX fragments keyed by file name."""
    robot = BUILT[name]() if name in BUILT else robot_of(name)
    return text_and_fragments(robot, ["fk", "ik"] if isinstance(robot, Mechanism) else ["fk"])


def text_and_fragments(robot, functions):
    """Derive some functions of a robot, and return its LaTeX document and fragments."""
    texts = files(derive(robot, functions=functions), None)
    document = texts.pop(f"{robot.name}.tex")
    return robot, document, {Path(path).name: text for path, text in texts.items()}


def compiled(folder, text, shown):
    """Compile a document with its LaTeX fragments, and return the log."""
    (folder / FOLDER).mkdir()
    for name, fragment in shown.items():
        (folder / FOLDER / name).write_text(fragment, encoding="utf-8")
    (folder / "robot.tex").write_text(text, encoding="utf-8")
    run = subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "robot.tex"],
        cwd=folder,
        capture_output=True,
        check=False,
        timeout=SECONDS,
    )
    log = (folder / "robot.log").read_text(encoding="utf-8", errors="replace")
    assert run.returncode == 0, "\n".join(re.findall(r"^!.*\n(?:.*\n){0,4}", log, re.MULTILINE))
    return log


def assert_clean(log, pages=MAX_PAGES):
    excess = [float(pt) for pt in re.findall(r"Overfull \\hbox \(([\d.]+)pt too wide\)", log)]
    assert not [pt for pt in excess if pt > WIDEST_EXCESS]
    assert "undefined" not in log
    assert "LaTeX Warning" not in log
    assert "Missing character" not in log
    count = int(re.search(r"Output written on .*?\((\d+) page", log.replace("\n", " ")).group(1))
    assert 2 <= count <= pages


@pytest.fixture(scope="module", params=[*SHIPPED, *BUILT])
def name(request):
    """Orders the tests by robot, so that a worker rarely derives a robot twice."""
    return request.param


def test_latex_documents_compile_cleanly(name, tmp_path):
    robot, document, shown = printed(name)
    pages = MAX_PAGES_OF_LOOPS if isinstance(robot, Mechanism) else MAX_PAGES
    pages = MAX_PAGES_OF_BUILT if name in BUILT else pages
    assert_clean(compiled(tmp_path, document, shown), pages)


@pytest.mark.parametrize("name", [*SHIPPED, "imported"], indirect=True)
def test_latex_fragments_compile_in_plain_article(name, tmp_path):
    """LaTeX fragments do not print the title or the source."""
    _, _, shown = printed(name)
    inputs = "\n\n".join(rf"\input{{{FOLDER}/{name}}}" for name in shown if name not in PICTURES)
    log = compiled(tmp_path, PLAIN % inputs, shown)
    assert_clean(log, MAX_PAGES_OF_LOOPS)


def test_latex_document_of_random_platform_compiles_cleanly(tmp_path):
    """Oblique prismatic joints and actuator-dependent radii give long equations."""
    platform = drawn_platform(np.random.default_rng(203))
    robot = read_text(platform.text("platform"))
    _, document, shown = text_and_fragments(robot, ["chain_fk"])
    assert_clean(compiled(tmp_path, document, shown), MAX_PAGES_OF_LOOPS)
