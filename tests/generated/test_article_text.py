"""Tests the LaTeX articles of shipped robots: citations, tables, joint names and page layout."""

import re

import pytest

from tests.support.derivations import ALL, GENERATED

every = pytest.mark.parametrize("name", ALL)
CITATION = re.compile(
    r"([A-Z][\w-]+)(?:'s)?(?:(?:, | and )[A-Z]\w+)*(?:'s)? \(?((?:19|20)\d{2})\)?"
)


def fragment(name, part):
    path = GENERATED / name / "latex" / f"{part}.tex"
    return path.read_text() if path.is_file() else ""


def fragments(name):
    paths = sorted((GENERATED / name / "latex").glob("*.tex"))
    return {path.stem: path.read_text() for path in paths}


@every
def test_references_list_each_cited_work(name):
    parts = fragments(name)
    listed = parts.pop("references")
    # The LaTeX fragment ``parameters`` cites the source of the parameter values in full.
    parts.pop("parameters")
    cited = {found for text in parts.values() for found in CITATION.findall(text)}
    assert cited
    for author, year in cited:
        assert any(author in item and year in item for item in listed.split(r"\item")), author


@every
def test_references_stay_with_the_end_of_the_section_before_them(name):
    article = (GENERATED / name / f"{name}.tex").read_text()
    *_, before, last = article.split(r"\section{")
    assert last.startswith("References}")
    assert before.splitlines()[1] == r"\keepwithnext"
    assert article.count(r"\keepwithnext") == 2
    assert fragment(name, "references").startswith(r"{\samepage")


@every
def test_rows_with_fractions_are_higher(name):
    for text in fragments(name).values():
        for table in re.findall(r"\\midrule\n(.*?)\\bottomrule", text, re.DOTALL):
            rows = [row for row in table.splitlines() if r"\frac" in row]
            assert all(row.startswith(r"\rule[") for row in rows)


@every
def test_formulas_contain_no_names_of_functions_of_sympy(name):
    for text in fragments(name).values():
        assert not re.search(r"\\operatorname\{(Abs|Piecewise|sign)\}", text)


@pytest.mark.parametrize("name", ["board_installer", "delta", "five_bar", "well_manipulator"])
def test_default_values_and_meanings_are_one_table(name):
    heads = re.findall(r"\\toprule\nparameter & (.*) \\\\", fragment(name, "parameters"))
    assert heads == ["value & unit & meaning"]


def test_fragment_of_symbols_is_left_out_without_symbols():
    assert not fragment("bricklaying_gantry", "symbols")
    assert (
        "latex/symbols" not in (GENERATED / "bricklaying_gantry/bricklaying_gantry.tex").read_text()
    )


def test_coordinates_keep_the_symbols_that_name_them():
    text = fragment("photo_robot", "parameters")
    assert r"$q = (r_{1}, \theta_{2}, \theta_{3}, r_{4}," in text
    assert "1 & r1 & P" in text
    assert "{}^{0}T_{1}" in fragment("photo_robot", "transforms")
    for part in ("inverse", "singularities", "example"):
        assert not re.search(r"\bq_\{|theta2|\br1\b", fragment("photo_robot", part))


def test_structure_with_fixed_joints_names_the_other_joints():
    text = fragment("well_manipulator", "inverse")
    assert "all other joints are revolute" in text
    assert (
        r"undetermined. The values of $l_{HI}$, $l_{MN}$ and $\theta_{7}$ are further inputs"
        in text
    )
    assert r"l\_HI" not in text


def test_planar_arm_is_drawn_in_its_plane():
    text = fragment("bricklaying_planar", "drawing")
    assert len(re.findall(r"\\filldraw\[pin,driven\] \(\S+\) circle", text)) == 3
    assert {"$x$", "$y$"} <= set(re.findall(r"\\node\[axis name\] at \S+ \{(\$.\$)\}", text))
    assert "{$z$}" not in text


def test_bend_of_a_triangle_is_solved_by_the_law_of_cosines():
    assert "by the law of cosines" in fragment("bricklaying_planar", "inverse")


def test_repeated_steps_of_an_inverse_are_referred_to():
    text = fragment("bricklaying_planar", "inverse")
    assert r"\textbf{Steps 4 and 5:} $q_{2}$ and $q_{1}$ as in steps 1 and 2." in text
    assert text.count("by the law of cosines") == 1


def test_position_of_the_tool_is_printed_in_actuated_coordinates():
    text = fragment("board_installer", "position")
    assert r"o_{z} &= z_{G} + L_{1} - h_{4} + k r \sin q_{3} + t \sin \theta_{7}" in text
    assert set(re.findall(r"\\theta_\{\d\}", text)) == {r"\theta_{7}"}
    assert r"p_{x} &= r_{x} q_{1}" in fragment("bricklaying_gantry", "position")
    assert not fragment("planar_3rrr", "position")


def test_platforms_have_a_worked_example():
    text = fragment("planar_3rrr", "example")
    assert r"\texttt{actuators\_all} has 8 solutions" in text
    assert text.count(r"\\") == 4 + 1 + 8 - 1


def test_figure_of_the_gantry_has_two_pairs_of_rails():
    text = fragment("bricklaying_gantry", "drawing")
    places = re.findall(r"\\filldraw\[pin,driven\] \[shift=\{\((\S+)\)\}", text)
    assert len(set(places)) == 3
    assert text.count(r"\draw[guide]") == 3
