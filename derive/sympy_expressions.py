"""Functions of a robot as SymPy expressions, with shared terms or expanded, or as LaTeX."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from chasles.contract import check_type

from .derivation import derive
from .model.errors import InputValueError
from .model.mechanism import Described, Mechanism
from .model.robot import SerialRobot
from .terms.symbolic_function import SymbolicFunction

_MATRIX = 2
_OWN = re.compile("_([a-z]+)([0-9]+)")
"""Symbols that robot files must not use."""


@dataclass(frozen=True)
class Expressions:
    """A function of a robot as SymPy expressions, from ``expressions``.

    To evaluate the function, first substitute the values of parameters, inputs and signs into the
    terms, one after another. Then substitute all values into the outputs.

    Attributes:
        robot: Name of the robot.
        function: Name of the function.
        inputs: For each input, an array of symbols in the shape of the input. Vectors are columns.
        signs: Symbols with the value 1 or -1, which select one branch of a function with several
            branches, such as ``ik``. The outputs describe the selected branch.
        parameters: The exact value of each parameter symbol (meter, radian, 1 or kilogram).
        terms: Pairs (symbol, expression) of common subexpressions. Each expression contains only
            inputs, parameters, signs and earlier terms. The tuple is empty if the function was
            expanded.
        outputs: For each output, an array of expressions in the shape of the output. Vectors are
            columns.
    """

    robot: str
    function: str
    inputs: Mapping[str, sp.Basic]
    signs: tuple[sp.Symbol, ...]
    parameters: Mapping[sp.Symbol, sp.Expr]
    terms: tuple[tuple[sp.Symbol, sp.Expr], ...]
    outputs: Mapping[str, sp.Basic]

    def latex(self) -> str:
        """Return the equations of terms and outputs as an aligned block for LaTeX math mode."""
        equations = [*self.terms, *((sp.Symbol(name), x) for name, x in self.outputs.items())]
        symbols = {symbol for side in equations for part in side for symbol in part.free_symbols}
        names = {symbol: tex for symbol in symbols if (tex := _subscripted(symbol.name))}
        lines = [
            f"{sp.latex(left, symbol_names=names)} &= {sp.latex(right, symbol_names=names)}"
            for left, right in equations
        ]
        rows = " \\\\\n".join(lines)
        return f"\\begin{{aligned}}\n{rows}\n\\end{{aligned}}"

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {self.latex()}$"


def _subscripted(name: str) -> str:
    """Return the LaTeX code of a compiler symbol, or an empty text for other symbols.

    For example, _t12 becomes t_{12}.
    """
    match = _OWN.fullmatch(name)
    if match is None:
        return ""
    letters, index = match.groups()
    base = letters if len(letters) == 1 else rf"\mathrm{{{letters}}}"
    return f"{base}_{{{index}}}"


def expressions(robot: Described, function: str, *, expand: bool = False) -> Expressions:
    """Derive one function of a robot as SymPy expressions.

    Args:
        robot: A serial robot or a mechanism, from ``read`` or built in Python.
        function: Name of the function, such as "fk", "jacobian_mixed" or "ik".
        expand: Whether to substitute all common subexpressions into the outputs. The expressions
            for "ik" may then be very long.

    Raises:
        InputValueError: The robot has no function of this name, or the function has no expressions
            because it is computed by iteration or by handwritten C code.
    """
    check_type("expressions: robot", robot, SerialRobot, Mechanism)
    derivation = derive(robot, functions=[function])
    if function in {written.name for written in derivation.written}:
        raise InputValueError(f"{robot.name}.{function}: a solver in C computes this function")
    found = derivation.function(function)
    if found.calls:
        raise InputValueError(f"{robot.name}.{function}: an iteration computes this function")
    entries = found.expanded() if expand else [result.entries for result in found.outputs]
    outputs = {
        result.name: _array(values, result.shape[1:] if found.signs else result.shape)
        for result, values in zip(found.outputs, entries, strict=True)
    }
    return Expressions(
        robot.name,
        function,
        {argument.name: _array(argument.symbols, argument.shape) for argument in found.inputs},
        found.signs,
        dict(found.terms.parameters),
        () if expand else _terms(found),
        outputs,
    )


def _terms(function: SymbolicFunction) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
    """Return the constants and terms on which a function depends, in order."""
    definitions, all_terms = function.definitions(), function.terms
    parts = [value for _, value in definitions]
    parts += [entry for result in function.outputs for entry in result.entries]
    used = {name for part in parts for name in all_terms.constants_in(part)}
    constants = [(name, value) for name, value in all_terms.constants.items() if name in used]
    return (*constants, *definitions)


def _array(entries: tuple[sp.Expr, ...], shape: tuple[int, ...]) -> sp.Basic:
    """Return entries in row-major order as a matrix or as an array."""
    if len(shape) > _MATRIX:
        return sp.ImmutableDenseNDimArray(entries, shape)
    rows, columns = (*shape, 1, 1)[:_MATRIX]
    return sp.ImmutableMatrix(rows, columns, entries)
