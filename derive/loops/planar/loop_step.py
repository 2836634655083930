"""Steps of the solution of loops: each kind is one class that solves, differentiates and explains.

A step determines some joints of a loop from known joints. Its class finds the bodies or struts that
it fits and solves them; its object keeps the vectors of the solution. Its equations are
SymPy expressions in quantities of the step (:func:`quantity`): an article prints these objects in
the symbols of the robot, and a test puts numbers through them.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Mechanism
from .phasors import ONE, ZERO, PhasorSum

HALF = sp.Rational(1, 2)
PLANE, SPACE = "xy", "xyz"
"""Axes of a vector in the plane of a loop, and of a vector in space."""
Quantities = tuple[sp.Symbol, ...]
Weighted = tuple[tuple[sp.Expr, sp.Expr], ...]
"""Quantities, each with the weight of its rate."""


def quantity(letter: str, axis: str = "") -> sp.Symbol:
    """The symbol of a quantity of a step: a number, a vector, or the component of a vector."""
    return sp.Symbol(f"{letter}_{axis}" if axis else letter, real=True)


def letter_and_axis(symbol: sp.Symbol) -> tuple[str, str]:
    """The letter and the axis from which :func:`quantity` made a symbol."""
    letter, _, axis = symbol.name.partition("_")
    return letter, axis


def components(letter: str, axes: str = PLANE) -> Quantities:
    """The symbols of a vector's components."""
    return tuple(quantity(letter, axis) for axis in axes)


def length_of(letter: str) -> sp.Symbol:
    """The symbol of a vector's length."""
    return sp.Symbol(f"|{letter}|", real=True)


class Cross(sp.Function):  # type: ignore[misc]
    """The vector product of two vectors that are quantities of a step."""

    nargs = 2


class Dot(sp.Function):  # type: ignore[misc]
    """The scalar product of two vectors that are quantities of a step."""

    nargs = 2


@dataclass(frozen=True)
class AngleEquation:
    """The angle that turns a vector to another direction.

    Attributes:
        angle: The angle, a named term.
        here: Letter of the vector that is turned.
        there: Components of a vector of the same length in the other direction.
    """

    angle: sp.Symbol
    here: str
    there: tuple[sp.Expr, sp.Expr]


@dataclass(frozen=True)
class RateEquation:
    """A linear equation between the rates of a step's unknowns and the rates of its vectors.

    The sum of ``weight * rate(unknown)`` over ``left`` equals the sum of
    ``weight * rate(quantity)`` over ``right``.

    Attributes:
        left: Unknowns with their weights. The weight of a single unknown is zero at a dead point.
        right: Quantities, or expressions in them, with their weights.
        projected: Two vectors; the left side is the scalar product of the first with the derivative
            of the second. None if the left side is written out.
    """

    left: Weighted
    right: Weighted
    projected: tuple[sp.Expr, ...] = ()


@dataclass(frozen=True)
class StepEquations:
    """The closed form of one step in quantities of the step.

    Attributes:
        vectors: Components of the given vectors by letter, as named terms.
        lengths: Letters of the vectors whose length the equations use.
        scalars: Given numbers that need no name in print, as named terms.
        unknowns: Travels and components of positions that the step gives, as named terms.
        results: Definitions in order, each in the quantities before it.
        angles: The angles that the step gives.
        margin: The margin of the step; None where the step always closes.
        rates: Rates of the unknowns and the angles.
    """

    vectors: Mapping[str, tuple[sp.Expr, ...]] = field(default_factory=dict)
    lengths: tuple[str, ...] = ()
    scalars: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)
    unknowns: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)
    results: tuple[tuple[sp.Symbol, sp.Expr], ...] = ()
    angles: tuple[AngleEquation, ...] = ()
    margin: sp.Expr | None = None
    rates: tuple[RateEquation, ...] = ()


@dataclass(frozen=True, kw_only=True)
class LoopStep(ABC):
    """A solved group of bodies or struts.

    Attributes:
        joints: Names of the pins, slides and struts that hold the group.
        axes: The body in whose axes the equations are written.
        relation: The loop's equation: a sum of turning vectors that is zero.
        turned: The angle from the axes of the body to the axes of the vectors.
        solved: The angles that the step gives, named terms.
        margin: Zero at a dead point, below zero out of reach; None where the step always closes.
        root: The term, up to its sign, that is NaN where the step does not close.
        sign: The sign of the branch; zero where there is a single solution.
        title: Name of the kind of step.
        branches: The name of each branch by its sign: the position of the part that the other
            branch mirrors.
        opening: Words before the equations, where they are not written in the axes of a body.
        reason: A sentence in place of equations, where the step needs none.
        dead_point: Where the margin is 0, in words, with quantities in braces by their letter.
    """

    joints: tuple[str, ...]
    axes: str
    relation: PhasorSum = field(default_factory=PhasorSum)
    turned: sp.Expr = ZERO
    solved: tuple[sp.Symbol, ...] = ()
    margin: sp.Expr | None = None
    root: sp.Expr = ZERO
    sign: int = 0

    title: ClassVar[str]
    branches: ClassVar[Mapping[int, str]] = {}
    opening: ClassVar[str] = ""
    reason: ClassVar[str] = ""
    dead_point: ClassVar[str] = ""

    @abstractmethod
    def equations(self) -> StepEquations:
        """The closed form of the step."""

    @property
    def remark(self) -> str:
        """A sentence on the choice of the root, with quantities in braces by their letter."""
        return ""

    @property
    def branch(self) -> str:
        """Name of the branch; empty where there is a single solution."""
        return self.branches.get(self.sign, "")

    @property
    def is_choice(self) -> bool:
        """Whether another branch takes the other side."""
        return self.sign != 0

    def name(self, mechanism: Mechanism) -> str:
        """Names of the closures and struts that the step closes; its joints where it has none."""
        swings = {strut.swing_name: strut.name for strut in mechanism.struts}
        names = [swings.get(name, name.split(".")[0]) for name in self.joints]
        closers = {closer.name for closer in mechanism.closers}
        closed = [name for name in names if name in closers]
        return " and ".join(dict.fromkeys(closed or names))


def weighted(vector: Quantities, weights: tuple[sp.Expr, ...], factor: sp.Expr = ONE) -> Weighted:
    """The components of a vector, each with the weight of its rate, times a factor."""
    return tuple((part, factor * w) for part, w in zip(vector, weights, strict=True))


def half(total: sp.Expr) -> sp.Expr:
    """Half of a sum, kept as a product so that it prints over one bar."""
    return sp.Mul(HALF, total, evaluate=False)
