"""A named function of a robot, from which LaTeX and C are generated."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import sympy as sp

from .role import OTHER, Role
from .terms import Terms


@dataclass(frozen=True)
class Argument:
    """An input with its symbols (row-major), shape, unit and meaning."""

    name: str
    symbols: tuple[sp.Symbol, ...]
    shape: tuple[int, ...]
    unit: str
    meaning: str

    @property
    def size(self) -> int:
        """Number of doubles."""
        return len(self.symbols)


@dataclass(frozen=True)
class Result:
    """An output with its entries (row-major), shape, unit and meaning.

    If the function has solution branches, the entries describe the single branch that the values of
    the sign symbols select. For a function with branches, the first dimension of the shape is the
    number of branches.
    """

    name: str
    entries: tuple[sp.Expr, ...]
    shape: tuple[int, ...]
    unit: str
    meaning: str

    @property
    def size(self) -> int:
        """Number of doubles."""
        return math.prod(self.shape)


@dataclass(frozen=True)
class Signature:
    """Name, meaning, inputs and outputs of a function.

    Attributes:
        name: The name of the function without the prefix of the robot.
        summary: One line that states what the function computes.
        identity: One line with the identity that the function satisfies.
        inputs: The input arguments in order.
        outputs: The symbolic expressions that the function returns, in order.
        role: Machine-readable description of what the function returns, for the runtime.
    """

    name: str
    summary: str
    identity: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Result, ...]
    role: Role = field(default=OTHER, kw_only=True)


@dataclass(frozen=True)
class Tables:
    """Numerical data of a robot for a handwritten solver.

    If the solver reads these data as a C structure, the Python fields have the order of this
    structure. Arrays are nested tuples.
    """


@dataclass(frozen=True)
class NativeSolverFunction(Signature):
    """A function that a handwritten solver computes from tables of numbers.

    Attributes:
        solver: Name of the handwritten solver, whose code does not depend on the robot. Each output
            language has a file with the name of the solver.
        tables: Numerical data of the robot that the solver reads.
        calls: Names of the functions that the solver calls, in the order that the solver expects.
        branches: Number of solutions that fit into the output.
        operations: Approximate number of operations of the function, which the runtime uses to
            divide a batch among threads.
        margin: Name of the function that states why a result is NaN, or an empty string.
        steps: Names of the loops, one per margin, if the function returns margins.
    """

    solver: str
    tables: Tables
    calls: tuple[str, ...]
    branches: int
    operations: int
    margin: str = field(default="", kw_only=True)
    steps: tuple[str, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True)
class Call:
    """A call of an iterative solver, placed before the other statements of a function.

    Attributes:
        system: Name of the system of equations that the solver solves, and of the C file with these
            equations.
        entry: Name of the C function to call.
        inputs: Names of function inputs, or of outputs of earlier calls.
        outputs: Arrays that the call fills. The symbols of the arrays are arguments of the later
            statements.
        operations: Approximate number of operations of the call.
    """

    system: str
    entry: str
    inputs: tuple[str, ...]
    outputs: tuple[Argument, ...]
    operations: int


@dataclass(frozen=True)
class SymbolicFunction(Signature):
    """A function whose result entries are expressions in shared terms.

    Attributes:
        terms: The definitions of all symbols in the result entries.
        margin: Name of the function that returns the distance of the loops from dead points, or an
            empty string for a robot without loops.
        steps: Names of the loops, one per margin, if the function returns margins.
        signs: Symbols with the value 1 or -1, each of which selects one of two solution branches.
            In branch b, the i-th of n signs is -1 if bit n - 1 - i of b is 1, otherwise the sign is
            1. From branch to branch, the first sign varies slowest.
        calls: Calls of iterative solvers that run before the other statements of the function, in
            the order of execution.
    """

    terms: Terms
    margin: str = ""
    steps: tuple[str, ...] = ()
    signs: tuple[sp.Symbol, ...] = ()
    calls: tuple[Call, ...] = ()

    def __post_init__(self) -> None:
        for result in self.outputs:
            assert result.size == self.branches * len(result.entries), (self.name, result.name)

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """Arguments of the statements, first the inputs and then the outputs of solver calls."""
        return (*self.inputs, *(output for call in self.calls for output in call.outputs))

    @property
    def branches(self) -> int:
        """Number of solution branches, or 1 if the function has no branch signs."""
        return int(2 ** len(self.signs))

    def definitions(self) -> list[tuple[sp.Symbol, sp.Expr]]:
        """Return the shared terms in the outputs, with their definitions.

        Each term follows the terms on which its definition depends.
        """
        needed = self.terms.needed(entry for result in self.outputs for entry in result.entries)
        return [(symbol, self.terms.definitions[symbol]) for symbol in needed]

    def expanded(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """Return the entries of each output as expressions in inputs, parameters and numbers.

        The size of the expressions grows exponentially with the length of the chain.
        """
        definitions: dict[sp.Symbol, sp.Expr] = {}
        for symbol, constant in self.terms.constants.items():
            definitions[symbol] = constant.xreplace(definitions)
        for symbol, term in self.definitions():
            definitions[symbol] = term.xreplace(definitions)
        return tuple(
            tuple(entry.xreplace(definitions) for entry in result.entries)
            for result in self.outputs
        )


def matrix_entries(columns: Iterable[Iterable[sp.Expr]]) -> tuple[sp.Expr, ...]:
    """Return the row-major entries of a matrix that is given by its columns."""
    return tuple(entry for row in zip(*columns, strict=True) for entry in row)


def systems_of(functions: Iterable[SymbolicFunction]) -> list[str]:
    """Return the names of the equation systems that functions solve, in the order of first use."""
    systems = (call.system for function in functions for call in function.calls)
    return list(dict.fromkeys(filter(None, systems)))
