"""Tests the printed numbers of articles: the digits of given and computed values, and powers of
ten."""

import random
import re
from functools import cache

import pytest
import sympy as sp

from chasles.derive import derive, read_text
from chasles.derive.latex import fragments
from chasles.derive.latex.chain.tables import limits, tabular
from chasles.derive.latex.setting.nested_roots import as_angle, as_trigonometric
from chasles.derive.latex.setting.notation import LENGTH, TERM
from chasles.derive.latex.setting.printer import Printer, cut, decimal, number
from chasles.derive.model.tolerances import GIVEN_DIGITS

R = sp.Rational
LONG = R("0.0001839675682371554044092221147366217337548732757568359375")


@pytest.mark.parametrize(
    ("value", "tex"),
    [
        (R("0.1625"), "0.1625"),
        (R("-0.12837996050958084"), "-0.12837996050958084"),
        (R(1, 3), r"\tfrac{1}{3}"),
        (sp.Integer(10) ** 20, "100000000000000000000"),
        (LONG, r"0.0001839675682\ldots"),
        (-LONG, r"-0.0001839675682\ldots"),
        (R(10**20 + 1, 3 * 10**20), r"0.3333333333\ldots"),
        (R("-7.346e-6"), r"-7.346 \cdot 10^{-6}"),
        (R("0.00001"), "0.00001"),
        (R("4.5198788796441125e-7"), r"4.5198788796441125 \cdot 10^{-7}"),
    ],
)
def test_numbers_are_printed_with_limited_digits(value, tex):
    assert number(value) == tex


@pytest.mark.parametrize(
    ("value", "tex"),
    [
        (sp.cos(sp.pi / 15), r"\cos 12^\circ"),
        (sp.sin(sp.pi / 15) / 4, r"0.25 \sin 12^\circ"),
        (sp.cos(2 * sp.pi / 5) * -3, r"-3 \sin 18^\circ"),
        (sp.sqrt(3) * sp.cos(sp.pi / 10) / 2, r"\tfrac{\sqrt{3}}{2} \cos 18^\circ"),
        (sp.cos(sp.pi / 8), r"\cos 22.5^\circ"),
        (sp.cos(47 * sp.pi / 180) / 2, r"0.5 \cos 47^\circ"),
        (sp.sqrt(5) / 4, ""),
        (sp.Rational(1, 4) + sp.sqrt(3) / 4, ""),
        (sp.cos(sp.pi / 15) + sp.sin(sp.pi / 8), ""),
    ],
)
def test_nested_roots_are_printed_as_sines_and_cosines(value, tex):
    shown = as_trigonometric(value)
    assert shown == tex


def test_angle_of_nested_roots_is_a_multiple_of_pi():
    angle = sp.atan2(sp.sin(sp.pi / 15), sp.cos(sp.pi / 15))
    assert as_angle(angle) == r"\pi/15"
    assert not as_angle(sp.Rational(21, 100))


TWELVE_DEGREES = """name = "arm"
convention = "dh"
units = { length = "mm", angle = "deg" }
joints = [
  { name = "a1", d = 321, a = 83, alpha = 78 },
  { name = "a2", d = 77, a = 402, alpha = -12 },
  { name = "a3", d = -51, a = 365, alpha = 84 },
  { name = "a4", d = 118, a = 43, alpha = 90 },
]
"""


@cache
def twelve_degrees():
    """Return the LaTeX fragments of an arm with a twist angle alpha of -12 degrees."""
    return fragments(derive(read_text(TWELVE_DEGREES), functions=["fk"]))


def test_constant_table_has_no_empty_cell_and_no_nested_root():
    text = twelve_degrees()["symbols.tex"]
    rows = [row for row in text.splitlines() if row.startswith(r"$\kappa")]
    assert r"\sin 12^\circ" in text
    assert rows
    assert not any(re.search(r"\$ &  & \$", row) for row in rows)
    assert not re.search(r"sqrt\{[^}]*sqrt", text)


def test_terms_follow_the_entries_that_need_them():
    text = twelve_degrees()["fk.tex"]
    rotation, position = text.split("With the further terms")
    assert "p_{x} &=" in position
    assert "r_{11} &=" in rotation
    # The rotation equations use the terms that are printed before the position equations.
    for name in re.findall(r"^(t_\{\d+\}) &=|& (t_\{\d+\}) &=", rotation, re.MULTILINE):
        assert rotation.count("".join(name)) > 1


def test_figure_prints_joint_names_as_in_the_file():
    text = twelve_degrees()["drawing.tex"]
    assert "{$q_{1}$ a1}" in text


def test_terms_with_mixed_order_keys_are_sorted():
    x, y, z = sp.symbols("x y z")
    order = {x: (TERM, (1, "b")), y: (TERM, ("a",)), z: (LENGTH, (1, (2, "c")))}
    printer = Printer({s: s.name for s in order}, order)
    assert printer.tex(y + x + z) == "z + x + y"
    assert printer.tex(y * x * z) == "z x y"


def test_cut_numbers_keep_their_leading_digits():
    dice = random.Random(1)
    for _ in range(300):
        text = f"{dice.uniform(0.1, 99):.20f}"
        shown = cut(R(text), 10).removesuffix(r"\ldots")
        assert text.startswith(shown)
        small, power = cut(R(text) / 10**9, 10).split(r" \cdot 10^")
        digits = small.removesuffix(r"\ldots").replace(".", "")
        assert text.replace(".", "").lstrip("0").startswith(digits)
        assert power == ("{-9}" if float(text) >= 1 and float(text) < 10 else power)


def test_rounded_numbers_are_accurate_at_any_magnitude():
    dice = random.Random(2)
    for _ in range(300):
        value = R(f"{dice.uniform(-1, 1):.20f}") / 10 ** dice.randint(0, 40)
        digits, _, power = decimal(value).partition(r" \cdot 10^")
        shown = R(digits) * R(10) ** int(power.strip("{}") or 0)
        assert abs(shown - value) <= abs(value) / 10**9


def test_long_limits_are_cut_and_fractions_are_kept():
    assert limits((R(0), R(50, 3))) == r"$[0, \tfrac{50}{3}]$"
    assert limits((R("-1.1344640137963142"), R(2))) == r"$[-1.134464013\ldots, 2]$"
    assert limits((-sp.pi, sp.pi)) == r"$\pm 180^\circ$"


def test_no_literal_of_an_article_is_longer_than_a_double():
    """The arm has measured geometric errors.

    The nominal dimensions of the arm are exact doubles.
    """
    text = """
    name = "measured"
    convention = "dh"
    joints = [
      { d = "0.15643", alpha = "-1.5707889803614505" },
      { a = "0.425000012345678", d = "0.0053759431319972" },
      { a = "0.392250032145678", alpha = "0.0000073464102034785" },
      { d = "0.1333", alpha = "1.5707889803614505" },
      { d = "0.0997", alpha = "-1.5707889803614505" },
      { d = "0.0996" },
    ]
    """
    robot = read_text(text)
    texts = fragments(derive(robot, functions=["fk"]))
    found = [run for text in texts.values() for run in re.findall(r"[0-9]*\.[0-9]+", text)]
    digits = [len(run.replace(".", "").lstrip("0")) for run in found]
    assert len(digits) > 100
    assert max(digits) <= GIVEN_DIGITS


def test_squared_cosine_of_a_number_keeps_decimals():
    square = sp.cos(R("0.091")) ** 2 * sp.sin(R("0.228")) * R("0.371")
    assert Printer({}, {}).tex(square) == r"0.371 \cos^{2}(0.091) \sin(0.228)"


def test_wide_tuple_in_a_table_breaks_after_a_comma():
    point = "$(0.2515930647751045, 0.2888700224972675, 0.10858072107526351)$"
    text = "frame's width, between the rails of the platform and the end of the belt"
    table = tabular([("at", [point, text])], 0)
    assert r"$(0.2515930647751045,\allowbreak 0.2888700224972675,\allowbreak 0.1" in table
    assert text in table
