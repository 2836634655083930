"""Numbers of terms and symbols, counted without expansion."""

import pytest
import sympy as sp

from chasles.derive.model.sizes import MANY, addends, size

A, B, C = sp.symbols("a b c", real=True)
KNOWN = {C: 7}


@pytest.mark.parametrize(
    ("expression", "terms", "symbols"),
    [
        (A, 1, 1),
        (C, 7, 7),
        (sp.Integer(3), 1, 1),
        (A + B + 1, 3, 3),
        ((A + B) * (A + C), 2 * 8, 2 + 8),
        ((A + B + 1) ** 3, 27, 4),
        ((A + B) ** -2, 1, 3),
        ((A + B) ** B, 1, 3),
        (sp.sin(A + B), 1, 2),
        ((A + B) ** 20, MANY, 3),
    ],
    ids=str,
)
def test_terms_and_symbols_are_counted(expression, terms, symbols):
    assert addends(expression, KNOWN) == terms
    assert size(expression, KNOWN) == symbols


def test_terms_bound_the_expanded_sum():
    expression = (A + B) ** 3 * (A - B + 2)
    assert len(sp.expand(expression).args) <= addends(expression) == 24
