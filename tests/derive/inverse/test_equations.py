"""Solutions of inverse kinematics subproblems satisfy the symbolic equations of the subproblems."""

import pytest
import sympy as sp

from chasles.derive.inverse.subproblems.equations import (
    Direction,
    LineAndPlane,
    LineAndSphere,
    Linear,
    LoopOfThree,
    TwoEllipses,
)

NUMBERS = [sp.Rational(k, 7) for k in (3, -5, 2)]
EQUATIONS = [
    Linear(*NUMBERS),
    Linear(NUMBERS[0], NUMBERS[1], sp.Integer(0)),
    Direction(*NUMBERS[:2]),
    LineAndPlane(*NUMBERS[:2]),
    LineAndSphere(*NUMBERS[:2]),
    LineAndSphere(sp.Integer(0), NUMBERS[1]),
]


def left_side(equation, x):
    if isinstance(equation, Linear):
        return equation.a * sp.cos(x) + equation.b * sp.sin(x) - equation.d
    if isinstance(equation, Direction):
        return equation.a * sp.sin(x) - equation.b * sp.cos(x)
    if isinstance(equation, LineAndPlane):
        return equation.rate * x + equation.rest
    return x**2 + equation.linear * x + equation.constant


def solutions(equation):
    return {sp.N(sum(equation.solution(sp.Integer(sign)))) for sign in (1, -1)}


@pytest.mark.parametrize("equation", EQUATIONS, ids=str)
def test_solutions_satisfy_their_equation(equation):
    found = solutions(equation)
    assert len(found) == (2 if isinstance(equation, Linear | LineAndSphere) else 1)
    assert all(abs(left_side(equation, x)) < 1e-14 for x in found)


@pytest.mark.parametrize("equation", EQUATIONS, ids=str)
def test_mirrored_equation_has_negated_solutions(equation):
    assert all(abs(left_side(equation.mirrored, -x)) < 1e-14 for x in solutions(equation))


@pytest.mark.parametrize(("kind", "count"), [(LoopOfThree, 21), (TwoEllipses, 10)])
def test_coefficients_round_trip_through_equation(kind, count):
    symbols = sp.symbols(f"x:{count}")
    x = list(symbols)
    if kind is LoopOfThree:
        equation = LoopOfThree(*(tuple(x[k : k + 3]) for k in range(0, count, 3)))
    else:
        rows = [tuple(x[k : k + 2]) for k in range(0, count, 2)]
        equation = TwoEllipses((rows[0], rows[1]), (rows[2], rows[3]), rows[4])
    assert equation.coefficients == symbols
    assert equation.with_coefficients(symbols) == equation
