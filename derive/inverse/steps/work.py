"""The record of a solution in progress: angles, signs, margins, and the steps for the reader."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import sympy as sp

from ...terms.terms import Terms
from ...terms.vectors import Vector
from ..structure.lines import Axis
from ..subproblems.found import FoundLength, FoundTurn
from ..subproblems.turns import CosSin

Found = TypeVar("Found", FoundTurn, FoundLength)


@dataclass(frozen=True)
class InverseStep:
    """A step of a closed-form inverse.

    Attributes:
        joints: Names of the joints whose sum the step finds.
        method: The subproblem, "subproblem 4".
        reason: Why the step holds, in words: which joints its equation does not contain, and why.
        found: The angle or length, with its equation.
        degenerate: Where the value is arbitrary, and which is taken.
    """

    joints: tuple[str, ...]
    method: str
    reason: str
    found: FoundTurn | FoundLength
    degenerate: str = ""


@dataclass(frozen=True)
class NamedVector:
    """A vector that the steps' words refer to.

    Attributes:
        letters: LaTeX letters in order of preference; a letter that a parameter has is avoided.
        meaning: The meaning of the vector, in words.
        vector: Its components (metre where it is a position), in base axes.
        after: Number of steps before it, on which it depends.
    """

    letters: tuple[str, ...]
    meaning: str
    vector: Vector
    after: int


@dataclass(frozen=True)
class Remainder:
    """A joint whose angle follows from a sum that a step found and the other joints of it.

    Attributes:
        joints: Names of the joints whose sum the step found, in its order.
        last: Name of the remaining joint.
    """

    joints: tuple[str, ...]
    last: str


@dataclass(frozen=True)
class Sum:
    """Parallel joints whose sum of angles was found before their own.

    Attributes:
        senses: Index of each joint, with 1 or -1 for the sense in which its angle counts about the
            first of the axes.
        turn: Cosine and sine of the sum.
    """

    senses: tuple[tuple[int, int], ...]
    turn: CosSin


@dataclass
class Work:
    """The state of a derivation, which a family fills step by step.

    Attributes:
        terms: Names of all terms.
        turns: Cosine and sine of each joint's angle, by the joint's index.
        sums: Parallel joints; a value follows from the sum of all, which saves an atan2.
        remainders: Joints that follow from a sum, for the reader.
        lengths: The value of each prismatic joint.
        signs: The symbols that stand for 1 or -1, in the order of the slots.
        settled: The choices, by their number, that make no difference: the first solution is taken.
        choices: Number of choices so far.
        sides: For choices in loops, the loop's name and the names of its sides by the sign.
        steps: The steps in order.
        vectors: Vectors that the steps' words refer to.
    """

    terms: Terms
    turns: dict[int, CosSin] = field(default_factory=dict)
    sums: list[Sum] = field(default_factory=list)
    remainders: list[Remainder] = field(default_factory=list)
    lengths: dict[int, sp.Expr] = field(default_factory=dict)
    signs: list[sp.Symbol] = field(default_factory=list)
    settled: frozenset[int] = frozenset()
    choices: int = 0
    sides: dict[sp.Symbol, tuple[str, Mapping[int, str]]] = field(default_factory=dict)
    steps: list[InverseStep] = field(default_factory=list)
    vectors: list[NamedVector] = field(default_factory=list)

    def sign(self) -> sp.Expr:
        """A new symbol for a choice between two solutions; 1 where the choice is settled."""
        self.choices += 1
        if self.choices - 1 in self.settled:
            return sp.Integer(1)
        self.signs.append(sp.Symbol(f"_sign{len(self.signs) + 1}", real=True))
        return self.signs[-1]

    def name_vector(self, letters: tuple[str, ...], meaning: str, vector: Vector) -> Vector:
        """Gives a vector a name for the article; returns the vector."""
        self.vectors.append(NamedVector(letters, meaning, vector, len(self.steps)))
        return vector

    def step(
        self,
        axes: Sequence[Axis],
        method: str,
        reason: str,
        found: FoundTurn,
        degenerate: str = "",
    ) -> CosSin:
        """Notes a step; an angle about one axis alone is that joint's angle."""
        found = _settled(found)
        self.steps.append(
            InverseStep(tuple(axis.name for axis in axes), method, reason, found, degenerate)
        )
        if len(axes) == 1:
            self.turns[axes[0].joint] = found.turn
        return found.turn

    def slide(self, axis: Axis, method: str, reason: str, found: FoundLength) -> sp.Expr:
        """Notes the step that finds the length of a slide."""
        self.steps.append(InverseStep((axis.name,), method, reason, _settled(found)))
        self.lengths[axis.joint] = found.length
        return found.length

    def note(self, names: Sequence[str], method: str, reason: str, found: FoundTurn) -> CosSin:
        """Notes the step that finds an angle of no joint of the chain."""
        self.steps.append(InverseStep(tuple(names), method, reason, _settled(found)))
        return found.turn

    def note_length(
        self, names: Sequence[str], method: str, reason: str, found: FoundLength
    ) -> sp.Expr:
        """Notes the step that finds a length of no slide of the chain."""
        self.steps.append(InverseStep(tuple(names), method, reason, _settled(found)))
        return found.length

    def remainder(self, axes: Sequence[Axis]) -> None:
        """Notes that the last of these joints follows from the sum of all, which a step found."""
        names = tuple(axis.name for axis in axes)
        self.remainders.append(Remainder(names, names[-1]))

    def margins(self) -> list[sp.Expr]:
        """The margins of all steps that can fail."""
        return [step.found.margin for step in self.steps if step.found.margin is not None]


def _settled(found: Found) -> Found:
    """The result of a step; without a sign and a boundary where its choice is settled."""
    if found.sign is None or found.sign.is_Symbol:
        return found
    return replace(found, sign=None, margin=None)
