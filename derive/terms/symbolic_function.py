"""One named function of a robot: the object that LaTeX prints and C is generated from."""

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

    Of a function with branches, the entries are those of one branch in the function's signs, and
    the shape is that of all branches, which its first dimension counts.
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
    """What is told of a function.

    Attributes:
        name: The function's name without the robot's.
        summary: What it computes, in one line.
        identity: The identity that it satisfies, in one line.
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
        branches: How many slots it fills.
        operations: About how many operations it takes, by which a batch is divided over threads.
    """

    solver: str
    tables: tuple[Table, ...]
    calls: tuple[str, ...]
    branches: int
    operations: int


@dataclass(frozen=True)
class SymbolicFunction(Signature):
    """A function over shared terms, which the entries of its results name.

    Attributes:
        terms: The terms and constants that the entries rest on.
        margin: Name of the function that tells how far the loops that it rests on are from their
            dead points; empty where it rests on none.
        steps: Of a function of margins: the names of the loops, one an entry.
        signs: Of a function with branches: symbols that are 1 or -1, one for each two-way choice.
            Branch b has the i-th of n signs at -1 where bit n - 1 - i of b is set, else at 1, so
            that the first varies slowest.
    """

    terms: Terms
    margin: str = ""
    steps: tuple[str, ...] = ()
    signs: tuple[sp.Symbol, ...] = ()

    @property
    def branches(self) -> int:
        """How many branches there are; 1 where nothing is to be chosen."""
        return int(2 ** len(self.signs))

    def definitions(self) -> list[tuple[sp.Symbol, sp.Expr]]:
        """The shared terms that the outputs rest on, each after those it uses."""
        needed = self.terms.needed(entry for result in self.outputs for entry in result.entries)
        return [(symbol, self.terms.definitions[symbol]) for symbol in needed]

    def expanded(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """Each output's entries in inputs, parameters and numbers alone, with nothing shared.

        For comparison and for the reader; the size of the result grows fast with the chain.
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
