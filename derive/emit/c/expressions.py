"""Prints operands and operations as C."""

import textwrap
from collections.abc import Callable

from ...program.operations import Compute, Constant, Input, Operand, Operation, Program

WIDTH = 100
"""Maximum line length of generated C."""
Naming = Callable[[Operand], str]
_INFIXES = {
    Operation.ADD: "+",
    Operation.SUBTRACT: "-",
    Operation.MULTIPLY: "*",
    Operation.DIVIDE: "/",
    Operation.LESS: "<",
    Operation.LESS_EQUAL: "<=",
    Operation.EQUAL: "==",
    Operation.NOT_EQUAL: "!=",
    Operation.AND: "&&",
    Operation.OR: "||",
}
_TEMPLATES = {
    Operation.NEGATE: "-{0}",
    Operation.NOT: "!{0}",
    Operation.SQUARE: "{0} * {0}",
    Operation.SIGN: "{0} < 0.0 ? -1.0 : {0} > 0.0 ? 1.0 : {0}",
    Operation.SELECT: "{0} ? {1} : {2}",
}
FUNCTIONS = {
    Operation.SIN: "sin",
    Operation.COS: "cos",
    Operation.TAN: "tan",
    Operation.ATAN: "atan",
    Operation.ATAN2: "atan2",
    Operation.SQRT: "sqrt",
    Operation.ABS: "fabs",
    Operation.MIN: "fmin",
    Operation.MAX: "fmax",
}
"""Functions of ``math.h``."""


def wrapped(line: str, indent: str = "") -> list[str]:
    """Split a C statement into lines of at most `WIDTH` characters."""
    return textwrap.wrap(
        line,
        WIDTH,
        initial_indent=indent,
        subsequent_indent=f"{indent}    ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def number(value: float) -> str:
    """Return the shortest decimal text that parses to a given double."""
    return repr(value)


def naming(program: Program) -> Naming:
    """Return a function that gives operands their C names, such as ``v3``, ``q_0`` or ``0.25``."""

    def name(operand: Operand) -> str:
        match operand:
            case Constant(value):
                return number(value)
            case Input(argument, entry):
                return f"{program.arguments[argument]}_{entry}"
            case _:
                return f"v{operand.number}"

    return name


def expression(statement: Compute, name: Naming) -> str:
    """Return the right-hand side of a statement in plain C.

    Raises:
        KeyError: The operation of the statement exists only in SIMD code.
    """
    operation, terms = statement.operation, [name(operand) for operand in statement.operands]
    if operation in _INFIXES:
        return f"{terms[0]} {_INFIXES[operation]} {terms[1]}"
    if operation in _TEMPLATES:
        return _TEMPLATES[operation].format(*terms)
    return f"{FUNCTIONS[operation]}({', '.join(terms)})"
