"""Conversion of CasADi's C to typed programs."""

import casadi as ca
import numpy as np
import pytest

from chasles.derive.program import reading
from chasles.derive.program.operations import Constant, Input, Operation, Store
from chasles.derive.terms.casadi_graph import LoweringError

X, Y, Z = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("z")
KNOWN = {
    "add": (X + Y, Operation.ADD),
    "subtract": (X - Y, Operation.SUBTRACT),
    "multiply": (X * Y, Operation.MULTIPLY),
    "divide": (X / Y, Operation.DIVIDE),
    "negate": (-X, Operation.NEGATE),
    "square": (X**2, Operation.SQUARE),
    "sqrt": (ca.sqrt(X), Operation.SQRT),
    "sin": (ca.sin(X), Operation.SIN),
    "cos": (ca.cos(X), Operation.COS),
    "tan": (ca.tan(X), Operation.TAN),
    "atan": (ca.atan(X), Operation.ATAN),
    "atan2": (ca.atan2(X, Y), Operation.ATAN2),
    "abs": (ca.fabs(X), Operation.ABS),
    "sign": (ca.sign(X), Operation.SIGN),
    "min": (ca.fmin(X, Y), Operation.MIN),
    "max": (ca.fmax(X, Y), Operation.MAX),
    "less": (X < Y, Operation.LESS),
    "less or equal": (X <= Y, Operation.LESS_EQUAL),
    "equal": (X == Y, Operation.EQUAL),
    "not equal": (X != Y, Operation.NOT_EQUAL),
    "not": (ca.logic_not(X), Operation.NOT),
    "and": (ca.logic_and(X, Y), Operation.AND),
    "or": (ca.logic_or(X, Y), Operation.OR),
}


def read(*outputs):
    (program,) = reading.programs([ca.Function("f", [X, Y, Z], outputs, ["x", "y", "z"], ["r"])])
    return program


@pytest.mark.parametrize("name", KNOWN)
def test_each_casadi_operation_is_read(name):
    expression, operation = KNOWN[name]
    (statement,) = read(expression).computed
    operands = statement.operands
    assert statement.operation is operation
    assert operands == (Input(0, 0), Input(1, 0))[: len(operands)]


def test_if_else_is_read_as_a_single_select():
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        program = read(ca.if_else(X < Y, Z, -Z))
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(True)
    assert [s.operation for s in program.computed] == [
        Operation.LESS,
        Operation.NEGATE,
        Operation.SELECT,
    ]
    condition, negative, choice = program.computed
    assert choice.operands == (condition.result, Input(2, 0), negative.result)


def test_if_else_with_zero_is_read_as_select():
    (_, choice) = read(ca.if_else(X < Y, Z, 0)).computed
    assert choice.operation is Operation.SELECT
    assert choice.operands[1:] == (Input(2, 0), Constant(0.0))


@pytest.mark.parametrize("value", [0.1, -2.5, 1e-300, 1e22, np.pi, 3])
def test_constants_are_read_to_the_last_place(value):
    (store,) = read(ca.SX(value)).statements
    assert store == Store(0, 0, Constant(float(value)))


@pytest.mark.parametrize(
    ("expression", "named"),
    [(ca.exp(X), "exp"), (ca.log(X), "log"), (ca.floor(X), "floor"), (ca.erf(X), "erf")],
    ids=["exp", "log", "floor", "erf"],
)
def test_error_names_the_unknown_operation(expression, named):
    with pytest.raises(LoweringError, match=f"f: unknown operation '{named}'"):
        read(expression)


def test_sparse_outputs_are_rejected():
    sparse = ca.SX(2, 2)
    sparse[0, 0] = X
    with pytest.raises(LoweringError, match="output 0 is not dense"):
        read(sparse)
