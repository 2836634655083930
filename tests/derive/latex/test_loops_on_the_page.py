"""In LaTeX articles of random mechanisms, example values close the loops and matrix sizes agree."""

import re

import numpy as np
import pytest

from chasles.derive import derive, read_text
from chasles.derive.latex.loops.example_of_loops import worked_example_of_loops
from chasles.derive.latex.loops.loop_page import LoopPage
from chasles.derive.latex.loops.loops_fragment import loops
from chasles.derive.latex.loops.solution_fragment import solution
from chasles.derive.latex.setting.widths import LINE, width
from chasles.derive.model.mechanism import Frame, Mechanism, Strut
from tests.support.generators.drawn_mechanisms import drawn_mechanism
from tests.support.generators.planar_platforms import drawn_platform
from tests.support.loops.loader_arm import LOADER, TWIN
from tests.support.loops.mechanisms import BASE, at, near, pin


def test_worked_example_uses_a_closed_configuration():
    found = derive(drawn_mechanism(2).mechanism, functions=["fk", "chain", "ik"])
    example = worked_example_of_loops(LoopPage.of(found))
    assert "the pose of the tool is" in example
    assert "nan" not in example


@pytest.mark.parametrize("text", [LOADER, TWIN], ids=["loader", "two cylinders"])
def test_worked_example_closes_loops_of_dependent_chain_joints(text):
    functions = ["chain_fk", "actuators_all"]
    example = worked_example_of_loops(LoopPage.of(derive(read_text(text), functions=functions)))
    (angles,) = re.findall(r"At \$\\theta_\{1\} = (.*?)\^.*?\$\\theta_\{2\} = (.*?)\^", example)
    rear, arm = np.radians([float(angle) for angle in angles])
    pin = 0.623 * np.exp(1j * rear) + 0.402 * np.exp(1j * (rear + arm)) - 0.74 + 0.23j
    assert abs(pin) == pytest.approx(0.997, abs=2e-5)
    assert "has one solution" in example
    assert "nan" not in example


def test_displacement_matrices_of_loops_fit_the_line_width():
    platform = read_text(drawn_platform(np.random.default_rng(201)).text("platform"))
    text = loops(LoopPage.of(derive(platform, functions=["chain_fk"])))
    matrices = re.findall(r"^M_\{\d\} = .*?\\end\{array\}", text, re.DOTALL | re.MULTILINE)
    assert len(matrices) == 3
    for matrix in matrices:
        rows = [row.split("&") for row in matrix.split("\n")[1:-1]]
        columns = zip(*(row for row in rows if len(row) == 4), strict=True)
        assert sum(max(map(width, column)) for column in columns) < LINE - 80
    assert r"(to 6 decimals)" in text


def test_article_states_least_squares_closure():
    rods = tuple(
        Strut(name, Frame(BASE, at(x)), Frame("coupler", at(x)), length)
        for name, x, length in (("rod", 2, 1), ("third", 1, "1.0002"))
    )
    whole = Mechanism(
        "three",
        (pin("crank", BASE, "arm"), pin("bar", "arm", "coupler", 1)),
        ("crank",),
        struts=rods,
        tool_body="coupler",
        reference=near(("crank", 1), ("bar", -1)),
        closure="least squares",
    )
    page = LoopPage.of(derive(whole, functions=["fk"]))
    assert "1 constraint is redundant" in loops(page)
    assert "minimizes the sum of squared closure errors" in loops(page)
    assert r"\frac{\partial g}{\partial z_{\mathrm{p}}}" in solution(page)
