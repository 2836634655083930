"""Solution steps of kinematic loops.

Each step class solves, differentiates and explains one kind of step.

A step determines some joints of a loop from known joints. The class of a step finds the bodies or
struts to which the step applies, and solves for their joints. An instance of a step class stores
the vectors of one solution. The equations of a step are SymPy expressions in symbols that
``quantity`` returns. The LaTeX article prints the equations of a step with the symbols of the
robot. Tests evaluate the equations of a step numerically.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import sympy as sp

from ...model.mechanism import Mechanism
from ..model.phasors import ONE, ZERO, PhasorSum

HALF = sp.Rational(1, 2)
PLANE, SPACE = "xy", "xyz"
"""Axis letters of planar and of spatial vectors."""
Quantities = tuple[sp.Symbol, ...]
Weighted = tuple[tuple[sp.Expr, sp.Expr], ...]
"""Pairs (quantity, factor) of a weighted sum."""


def quantity(letter: str, axis: str = "") -> sp.Symbol:
    """Return the symbol of a quantity, which is a scalar, a vector or a component of a vector."""
    return sp.Symbol(f"{letter}_{axis}" if axis else letter, real=True)


def letter_and_axis(symbol: sp.Symbol) -> tuple[str, str]:
    """Split the name of a symbol, such as "B_x", at the underscore."""
    letter, _, axis = symbol.name.partition("_")
    return letter, axis


def components(letter: str, axes: str = PLANE) -> Quantities:
    """Return the symbols of the components of a vector."""
    return tuple(quantity(letter, axis) for axis in axes)


def length_of(letter: str) -> sp.Symbol:
    """Return the symbol of the length of a vector."""
    return sp.Symbol(f"|{letter}|", real=True)


class Cross(sp.Function):  # type: ignore[misc]
    """The cross product of two vectors."""

    nargs = 2


class Dot(sp.Function):  # type: ignore[misc]
    """The scalar product of two vectors."""

    nargs = 2


@dataclass(frozen=True)
class AngleEquation:
    """The angle from a vector to a target direction.

    Attributes:
        angle: The symbol of the angle.
        here: One-letter name of the vector before the rotation by the angle.
        there: Components of the rotated vector.
    """

    angle: sp.Symbol
    here: str
    there: tuple[sp.Expr, sp.Expr]


@dataclass(frozen=True)
class RateEquation:
    """A linear equation for the time derivatives of the unknowns of a step.

    Attributes:
        left: Terms of the left side, as pairs (unknown, weight).
        right: Terms of the right side, as pairs (quantity or expression, weight).
        projected: Two vectors. The left side is the scalar product of the first vector with the
            time derivative of the second vector. An empty tuple means that the left side is printed
            as a sum.
    """

    left: Weighted
    right: Weighted
    projected: tuple[sp.Expr, ...] = ()


@dataclass(frozen=True)
class StepEquations:
    """The closed-form equations of one loop step.

    Attributes:
        vectors: Components of each known vector as named terms, keyed by the letter of the vector.
        lengths: Letters of the vectors whose lengths occur in the equations.
        scalars: Named terms for known scalars, such as a squared length, keyed by the symbol of the
            scalar.
        unknowns: Named terms for solved slider displacements and solved position components, keyed
            by symbol.
        results: Definitions of quantities as pairs (symbol, expression). Each expression contains
            only quantities that are defined earlier.
        angles: The solved angles.
        margin: The distance of the step from its dead point, or None if the loop closes for all
            coordinates.
        rates: Linear equations for the time derivatives of the unknowns and angles.
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
    """A solution step, which solves a group of bodies or struts.

    Attributes:
        joints: Names of the pins, slides and struts of the group.
        axes: The body in whose axes the equations are written.
        relation: The loop equation: a sum of rotated vectors that is zero.
        turned: The angle by which the axes of the equations are rotated relative to the axes of the
            body ``axes``.
        solved: The solved angles, as named terms.
        margin: A term that is zero at a dead point and negative if the loop cannot close, or None
            if the loop can always close.
        root: A term that is NaN if the step cannot close the loop. The sign of this term has no
            meaning.
        sign: The branch sign of the step, or zero if the step has a unique solution.
        title: Name of the solution method.
        branches: Names of the branches, keyed by sign. Each name states on which side of the
            mechanism's mirror line the solved bodies lie.
        opening: Text that precedes the printed equations if these equations are not expressed in
            the axes of a body.
        reason: A sentence that is printed if the step has no equations.
        dead_point: Text about the dead points of the step, in which the letters of quantities are
            enclosed in braces.
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
        """Return the equations that solve the step in closed form."""

    @property
    def remark(self) -> str:
        """A sentence about the sign of the root in this step, or empty text.

        The LaTeX article replaces each quantity name in braces in the sentence by the letter of the
        quantity.
        """
        return ""

    @property
    def continues(self) -> bool:
        """Whether the LaTeX article prints the step as a part of the preceding step."""
        return False

    @property
    def branch(self) -> str:
        """Name of the branch, or "" if the solution is unique."""
        return self.branches.get(self.sign, "")

    @property
    def is_choice(self) -> bool:
        """Whether the step has a second branch."""
        return self.sign != 0

    def name(self, mechanism: Mechanism) -> str:
        """Return the names of the closures and struts that belong to the step.

        If the step contains no closure and no strut, return the names of all joints of the step.
        """
        swings = {strut.swing_name: strut.name for strut in mechanism.struts}
        names = [swings.get(name, name.split(".")[0]) for name in self.joints]
        loop_joints = {loop_joint.name for loop_joint in mechanism.loop_joints}
        closed = [name for name in names if name in loop_joints]
        return " and ".join(dict.fromkeys(closed or names))


def weighted(vector: Quantities, weights: tuple[sp.Expr, ...], factor: sp.Expr = ONE) -> Weighted:
    """Return pairs (component, weight) for a rate equation.

    Each weight is multiplied by ``factor``.
    """
    return tuple((part, factor * w) for part, w in zip(vector, weights, strict=True))


def half(total: sp.Expr) -> sp.Expr:
    """Return half of a sum as an unevaluated product."""
    return sp.Mul(HALF, total, evaluate=False)
