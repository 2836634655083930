"""A named function of a robot, from which LaTeX is printed and C is generated."""

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

    A function with branches has the entries of a single branch, in the function's signs; the shape
    covers all branches, which the first dimension counts.
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
        name: The function's name without the robot's.
        summary: The quantity that the function computes, in one line.
        identity: The identity that the function satisfies, in one line.
        inputs: Arguments in order.
        outputs: Results in order.
        role: Its role, for the runtime.
    """

    name: str
    summary: str
    identity: str
    inputs: tuple[Argument, ...]
    outputs: tuple[Result, ...]
    role: Role = field(default=OTHER, kw_only=True)


Table = float | tuple["Table", ...]
"""A number, or an array as nested rows; whole numbers stay ints."""


@dataclass(frozen=True)
class WrittenFunction(Signature):
    """A function that a solver written by hand computes from tables; its results have no entries.

    Attributes:
        solver: Name of the solver, the same for every robot; each language has its files.
        tables: The robot's numbers, in the order in which the solver takes them.
        calls: Names of the functions that the solver calls, in the order in which it takes them.
        branches: Number of slots that it fills.
        operations: About how many operations it takes, by which a batch is divided over threads.
        margin: Name of the function that tells why its results are NaN; empty where none does.
        steps: Names of the loops, one an entry, where the function gives margins.
    """

    solver: str
    tables: tuple[Table, ...]
    calls: tuple[str, ...]
    branches: int
    operations: int
    margin: str = field(default="", kw_only=True)
    steps: tuple[str, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True)
class Call:
    """A call of an iterative solver that precedes the statements of a function.

    Attributes:
        system: Name of the equations that the solver solves; its C is in a file of that name.
        entry: Name of the entry of the solver.
        inputs: Names of inputs of the function, or of outputs of earlier calls.
        outputs: Arrays that the call fills. Their symbols are arguments of the statements.
        operations: About how many operations the call takes.
    """

    system: str
    entry: str
    inputs: tuple[str, ...]
    outputs: tuple[Argument, ...]
    operations: int


@dataclass(frozen=True)
class SymbolicFunction(Signature):
    """A function over shared terms, which the entries of its results name.

    Attributes:
        terms: The terms and constants on which the entries depend.
        margin: Name of the function that gives the distance of the loops in the function from
            their dead points; empty where no loop is in the function.
        steps: Names of the loops, one an entry, where the function gives margins.
        signs: Symbols that are 1 or -1, one for each two-way choice of a function with branches.
            Branch b has the i-th of n signs at -1 where bit n - 1 - i of b is set, else at 1, so
            that the first sign varies slowest.
        calls: Calls of solvers before the statements, in order.
    """

    terms: Terms
    margin: str = ""
    steps: tuple[str, ...] = ()
    signs: tuple[sp.Symbol, ...] = ()
    calls: tuple[Call, ...] = ()

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """The arguments of the statements: the inputs, then the outputs of calls."""
        return (*self.inputs, *(output for call in self.calls for output in call.outputs))

    @property
    def branches(self) -> int:
        """Number of branches; 1 where the function has no signs."""
        return int(2 ** len(self.signs))

    def definitions(self) -> list[tuple[sp.Symbol, sp.Expr]]:
        """The shared terms on which the outputs depend, each after the terms in its definition."""
        needed = self.terms.needed(entry for result in self.outputs for entry in result.entries)
        return [(symbol, self.terms.definitions[symbol]) for symbol in needed]

    def expanded(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """Each output's entries in inputs, parameters and numbers alone, without shared terms.

        The size of the result grows exponentially with the chain.
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
    """Row-major entries of a matrix given by columns."""
    return tuple(entry for row in zip(*columns, strict=True) for entry in row)


def systems_of(functions: Iterable[SymbolicFunction]) -> list[str]:
    """Names of the equations that functions solve, in order."""
    systems = (call.system for function in functions for call in function.calls)
    return list(dict.fromkeys(filter(None, systems)))
