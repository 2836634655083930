"""Shortened symbolic expressions have the same values as the original expressions."""

import pytest
import sympy as sp
from sympy.abc import a, b, c, d

from chasles.derive.latex.setting.printer import Printer
from chasles.derive.latex.setting.shorter import gathered, reduced
from chasles.derive.model.roots import drawn_out

ROOT = sp.sqrt(3)


@pytest.mark.parametrize(
    ("long", "short"),
    [
        (ROOT / 2 * (-ROOT / 3 * a - ROOT / 3 * b), -a / 2 - b / 2),
        (sp.cos(a) * sp.cos(b) * c - sp.sin(a) * sp.sin(b) * c, c * sp.cos(a + b)),
        (a + b, a + b),
        ((a + b) * (c + d), (a + b) * (c + d)),
    ],
    ids=["roots", "angle sum", "sum", "product"],
)
def test_constants_are_multiplied_out_if_the_result_is_shorter(long, short):
    assert reduced(long) == short


def test_common_root_is_factored_out():
    long = c * (ROOT / 2 * a + ROOT / 2 * b) - d * (ROOT / 2 * a - ROOT / 2 * b)
    found = gathered(long)
    assert found.is_Mul
    assert sum(part == ROOT for part in sp.preorder_traversal(found)) == 1
    assert sp.expand(found - long) == 0


def test_terms_with_different_roots_are_unchanged():
    assert gathered(ROOT * a + sp.sqrt(2) * b) == ROOT * a + sp.sqrt(2) * b


def test_square_factors_are_extracted_from_roots():
    assert drawn_out(sp.sqrt(4 * a + 4 * b)) == 2 * sp.sqrt(a + b)
    assert drawn_out(sp.sqrt(2 * a + 2 * b)) == sp.sqrt(2 * a + 2 * b)


def test_factor_is_printed_before_a_cosine():
    printer = Printer({a: "a", b: "b"}, {})
    assert printer.tex(sp.cos(a) * b) == r"b \cos a"
