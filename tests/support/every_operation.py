"""An expression graph with all operations of the code printers, and inputs with special values."""

import itertools

import numpy as np
import sympy as sp

from chasles.derive.program.operations import (
    CALLS,
    LOGIC,
    Compute,
    Constant,
    Input,
    Operation,
    Program,
    Store,
    Variable,
)
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms

ONLY_ON_LANES = {Operation.RECIPROCAL_SQRT, Operation.SUPPLEMENT}
OPERATIONS = [operation for operation in Operation if operation not in ONLY_ON_LANES]
UNARY = CALLS - {Operation.ATAN2} | {
    Operation.SQUARE,
    Operation.NEGATE,
    Operation.SQRT,
    Operation.ABS,
    Operation.SIGN,
}
X = (Input(0, 0), Input(0, 1))
_NUMBERS = [-2.5, -1.0, -0.0, 0.0, 0.3, 1.0, 4.0, np.nan]
INPUTS = np.array(list(itertools.product(_NUMBERS, _NUMBERS)))


def every_operation(argument: str) -> tuple[SymbolicFunction, Program]:
    condition = Compute(Variable(0), Operation.LESS, X)
    statements: list[Compute | Store] = [condition]
    for k, operation in enumerate(OPERATIONS):
        first, second = Variable(1 + 2 * k), Variable(2 + 2 * k)
        statement = Compute(first, operation, _operands(operation, condition.result))
        statements.append(statement)
        if statement.is_condition:
            values = (first, Constant(2.0), Constant(-3.0))
            statements.append(Compute(second, Operation.SELECT, values))
        statements.append(Store(0, k, second if statement.is_condition else first))
    program = Program("all", (argument,), ("y",), X, tuple(statements))
    entries = (sp.S.Zero,) * len(OPERATIONS)
    y = Result("y", entries, (len(OPERATIONS),), "1", "results")
    x = Argument(argument, sp.symbols("x_0 x_1"), (2,), "1", "numbers")
    function = SymbolicFunction("every", "Every operation.", "", (x,), (y,), terms=Terms({}))
    return function, program


def _operands(operation, condition):
    if operation in LOGIC:
        return (condition,) if operation is Operation.NOT else (condition, condition)
    if operation is Operation.SELECT:
        return (condition, *X)
    return X[:1] if operation in UNARY else X
