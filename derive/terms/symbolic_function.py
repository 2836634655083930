"""A named function of a robot, from which LaTeX and C are generated."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import sympy as sp

from .role import OTHER, Role
from .terms import Terms


@dataclass(frozen=True)
class Argument:
    """An input: its symbols in row-major order, shape, unit and one-line meaning."""

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
    """An output: its entries in row-major order, shape, unit and one-line meaning.

    The entries of a function with branches are for a single branch, and depend on the signs. The
    first dimension of the shape is the number of branches.
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
        name: The function's name without the robot's prefix.
        summary: One line that states the computed quantity.
        identity: One line with the identity that the function satisfies.
        inputs: The arguments of the function in order.
        outputs: The results of the function in order.
        role: The role, for the runtime.
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

    Each handwritten solver has a subclass. If the solver reads a C structure, the subclass has the
    fields of this structure in the same order; arrays are nested tuples.
    """


@dataclass(frozen=True)
class NativeSolverFunction(Signature):
    """A function that a handwritten solver computes from numerical tables, not from expressions.

    Attributes:
        solver: Name of the solver, which is the same for all robots; each language has a file for
            this solver.
        tables: The numerical data of the robot, in the class of the solver.
        calls: Names of the functions that the solver calls, in the solver's order.
        branches: Number of solutions for which the output has space.
        operations: Approximate operation count, used to divide a batch over threads.
        margin: Name of the function that explains NaN results; the value is empty if there is no
            such function.
        steps: Names of the loops, one per entry, if the function returns margins.
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
    """A call of an iterative solver before the statements of a function.

    Attributes:
        system: Name of the solved equations, and of the C file that contains them.
        entry: Name of the solver's entry point.
        inputs: Names of function inputs, or of outputs of earlier calls.
        outputs: Arrays that the call fills. The symbols of the filled arrays are arguments of the
            later statements.
        operations: Approximate operation count of the call.
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
        terms: The terms and constants on which the entries depend.
        margin: Name of the function that returns the distance of the loops from dead points; the
            value is empty without loops.
        steps: Names of the loops, one per entry, if the function returns margins.
        signs: Symbols with the value 1 or -1, one for each choice between two branches. In branch
            b, the i-th of n signs is -1 if bit n - 1 - i of b is 1, otherwise the sign is 1. The
            first sign varies slowest.
        calls: Solver calls before the statements, in order.
    """

    terms: Terms
    margin: str = ""
    steps: tuple[str, ...] = ()
    signs: tuple[sp.Symbol, ...] = ()
    calls: tuple[Call, ...] = ()

    def __post_init__(self) -> None:
        """Checks that each result has as many entries as its shape."""
        for result in self.outputs:
            assert result.size == self.branches * len(result.entries), (self.name, result.name)

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """The arguments of the statements: the inputs, then the outputs of calls."""
        return (*self.inputs, *(output for call in self.calls for output in call.outputs))

    @property
    def branches(self) -> int:
        """Number of branches; 1 for a function without signs."""
        return int(2 ** len(self.signs))

    def definitions(self) -> list[tuple[sp.Symbol, sp.Expr]]:
        """Returns the shared terms of the outputs, each after the terms in its definition."""
        needed = self.terms.needed(entry for result in self.outputs for entry in result.entries)
        return [(symbol, self.terms.definitions[symbol]) for symbol in needed]

    def expanded(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """Returns each output's entries expressed in inputs, parameters and numbers only.

        The size of the expressions grows exponentially with the chain length.
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
    """Returns the row-major entries of a matrix given by columns."""
    return tuple(entry for row in zip(*columns, strict=True) for entry in row)


def systems_of(functions: Iterable[SymbolicFunction]) -> list[str]:
    """Returns the names of the equations that functions solve, in order."""
    systems = (call.system for function in functions for call in function.calls)
    return list(dict.fromkeys(filter(None, systems)))
