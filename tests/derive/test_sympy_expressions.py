"""The exported SymPy expressions have the same values as the compiled functions."""

import numpy as np
import pytest
import sympy as sp

import chasles
from chasles.derive import expressions, read


def evaluated(found, inputs, signs=()):
    """Evaluate each symbolic output of a function at numeric inputs and branch signs."""
    known = dict(zip(found.signs, map(sp.Integer, signs), strict=True))
    known |= {symbol: sp.N(value, 30) for symbol, value in found.parameters.items()}
    for name, symbols in found.inputs.items():
        known |= dict(zip(sp.flatten(symbols), map(sp.Float, np.ravel(inputs[name])), strict=True))
    for term, definition in found.terms:
        known[term] = sp.N(definition.xreplace(known))
    return {
        name: np.array([float(entry.xreplace(known)) for entry in sp.flatten(entries)])
        for name, entries in found.outputs.items()
    }


@pytest.mark.parametrize("expand", [False, True], ids=["shared", "expanded"])
@pytest.mark.parametrize(
    ("name", "function"),
    [("ur5e", "fk"), ("scara", "hessian_mixed"), ("four_bar", "jacobian_mixed")],
)
def test_expressions_equal_the_compiled_function(name, function, expand):
    robot = chasles.load(name)
    q = np.asarray(robot.q_reference) + 0.01
    found = expressions(read(name), function, expand=expand)
    (values,) = evaluated(found, {"q": q}).values()
    np.testing.assert_allclose(values, np.ravel(getattr(robot, function)(q)), atol=1e-13)
    assert (found.terms == ()) == expand


def test_expressions_of_the_inverse_are_those_of_one_branch():
    robot = chasles.load("ur5e")
    T = robot.fk(robot.q_reference)
    found = expressions(read("ur5e"), "ik")
    assert len(found.signs) == 3
    for branch, signs in {0: (1, 1, 1), 5: (-1, 1, -1)}.items():
        values = evaluated(found, {"T": T}, signs)
        np.testing.assert_allclose(values["q"], robot.ik(T).q[branch], atol=1e-12)


def test_expanded_expression_contains_coordinates_and_parameters_alone():
    found = expressions(read("scara"), "fk", expand=True)
    (T,) = found.outputs.values()
    q1, q2 = found.inputs["q"][:2]
    own = {symbol.name: symbol for symbol in found.parameters}
    expected = own["a1"] * sp.cos(q1) + own["a2"] * sp.cos(q1 + q2)
    assert sp.expand(T[0, 3] - expected) == 0
    assert T.free_symbols <= {*own.values(), *found.inputs["q"]}


def test_latex_names_terms_without_underscores():
    found = expressions(read("ur5e"), "ik")
    tex = found.latex()
    assert tex.startswith(r"\begin{aligned}")
    assert tex.count(" &= ") == len(found.terms) + len(found.outputs)
    assert r"\mathrm{sign}_{1}" in tex
    assert "r_{11}" in tex
    assert not any(f"_{letter}" in tex for letter in "ktrp")
    assert found._repr_latex_() == f"$\\displaystyle {tex}$"


@pytest.mark.parametrize(
    ("name", "function", "message"),
    [
        ("stewart_gough", "fk", "stewart_gough.fk: an iteration computes this function"),
        ("jaco2", "ik", "jaco2.ik: a solver in C computes this function"),
        ("scara", "fkk", "scara has no function fkk"),
    ],
)
def test_function_without_expressions_is_refused(name, function, message):
    with pytest.raises(chasles.InputValueError, match=message):
        expressions(read(name), function)
