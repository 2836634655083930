"""Joints of any convention whose fields are exact numbers."""

import sympy as sp

from chasles.derive import Joint
from chasles.derive.description.conventions import CONVENTIONS

R = sp.Rational


def joint(name, convention, kind="revolute", *, pitch=0, direction=1, mimic=None, **given):
    """A joint with its convention's fields, zero where not given."""
    fields = {field: sp.sympify(given.get(field, 0)) for field in CONVENTIONS[convention].fields}
    before, after = CONVENTIONS[convention].place(kind, **fields)
    return Joint(
        name,
        kind,
        before,
        after,
        pitch=sp.sympify(pitch),
        direction=direction,
        mimic=mimic,
        convention=convention,
        given=tuple(fields.items()),
    )
