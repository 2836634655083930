"""Record of a closed form during its derivation: angles, signs, margins and solution steps."""

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
    """One solution step of a closed-form inverse.

    Attributes:
        joints: Names of the joints; with several names, the step solves for the sum of their
            angles.
        method: The subproblem, for example "subproblem 4".
        reason: Reason for the step: which joints its equation does not contain, and why.
        found: The solved angle or displacement, with its equation.
        degenerate: Describes the poses at which the value is arbitrary, and the value selected at
            these poses.
    """

    joints: tuple[str, ...]
    method: str
    reason: str
    found: FoundTurn | FoundLength
    degenerate: str = ""


@dataclass(frozen=True)
class NamedVector:
    """A named vector that the descriptions of the solution steps mention.

    Attributes:
        letters: LaTeX letters in order of preference; letters that denote robot parameters are
            avoided.
        meaning: Description of the vector.
        vector: The components in base axes (in meters for a position).
        after: Number of preceding solution steps on which the vector depends.
    """

    letters: tuple[str, ...]
    meaning: str
    vector: Vector
    after: int


@dataclass(frozen=True)
class Remainder:
    """A joint whose angle is computed from a solved angle sum and the other joints of the sum.

    Attributes:
        joints: Names of the joints in the sum, in the order of the solution step.
        last: Name of the joint that is computed from the sum.
    """

    joints: tuple[str, ...]
    last: str


@dataclass(frozen=True)
class Sum:
    """Parallel joints for which the sum of the angles is solved before the single angles.

    Attributes:
        senses: For each joint, its index and the sense (1 or -1) of its angle about the first axis.
        turn: Cosine and sine of the angle sum.
    """

    senses: tuple[tuple[int, int], ...]
    turn: CosSin


@dataclass
class Work:
    """State of a derivation, which a family of axis structures fills step by step.

    Attributes:
        terms: Table of named terms.
        turns: Cosine and sine of each joint angle, keyed by joint index.
        sums: Angle sums of parallel joints, which save atan2 calls.
        remainders: Joints whose angles follow from an angle sum, for the printed explanation.
        lengths: The value of each prismatic joint, keyed by joint index.
        locked: Indices of the joints that the closed loops of a robot lock.
        signs: The sign symbols (1 or -1), in the order of the solution slots.
        settled: Indices of the redundant branch signs; these signs are always 1.
        choices: Number of branch signs introduced so far.
        sides: The loop name of each loop-branch sign, and the branch names keyed by sign value.
        steps: The solution steps in order.
        vectors: Named vectors that the descriptions of the solution steps mention.
    """

    terms: Terms
    turns: dict[int, CosSin] = field(default_factory=dict)
    sums: list[Sum] = field(default_factory=list)
    remainders: list[Remainder] = field(default_factory=list)
    lengths: dict[int, sp.Expr] = field(default_factory=dict)
    locked: frozenset[int] = frozenset()
    signs: list[sp.Symbol] = field(default_factory=list)
    settled: frozenset[int] = frozenset()
    choices: int = 0
    sides: dict[sp.Symbol, tuple[str, Mapping[int, str]]] = field(default_factory=dict)
    steps: list[InverseStep] = field(default_factory=list)
    vectors: list[NamedVector] = field(default_factory=list)

    def sign(self) -> sp.Expr:
        """Returns a new symbol that selects one of two solutions, or 1 for a redundant sign."""
        self.choices += 1
        if self.choices - 1 in self.settled:
            return sp.Integer(1)
        self.signs.append(sp.Symbol(f"_sign{len(self.signs) + 1}", real=True))
        return self.signs[-1]

    def name_vector(self, letters: tuple[str, ...], meaning: str, vector: Vector) -> Vector:
        """Records the name of a vector for the article, and returns the vector."""
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
        """Records a solution step and, for a single axis, the joint angle."""
        found = _settled(found)
        self.steps.append(
            InverseStep(tuple(axis.name for axis in axes), method, reason, found, degenerate)
        )
        if len(axes) == 1:
            self.turns[axes[0].joint] = found.turn
        return found.turn

    def slide(self, axis: Axis, method: str, reason: str, found: FoundLength) -> sp.Expr:
        """Records the solution step for a prismatic joint."""
        self.steps.append(InverseStep((axis.name,), method, reason, _settled(found)))
        self.lengths[axis.joint] = found.length
        return found.length

    def note(self, names: Sequence[str], method: str, reason: str, found: FoundTurn) -> CosSin:
        """Records a step that solves for an angle that is not a joint angle of the chain."""
        self.steps.append(InverseStep(tuple(names), method, reason, _settled(found)))
        return found.turn

    def note_length(
        self, names: Sequence[str], method: str, reason: str, found: FoundLength
    ) -> sp.Expr:
        """Records a step that solves for a length that is not a joint displacement of the chain."""
        self.steps.append(InverseStep(tuple(names), method, reason, _settled(found)))
        return found.length

    def remainder(self, axes: Sequence[Axis]) -> None:
        """Records that the angle of the last joint is computed from the solved sum."""
        names = tuple(axis.name for axis in axes)
        self.remainders.append(Remainder(names, names[-1]))

    def margins(self) -> list[sp.Expr]:
        """Returns the margins of all solution steps that may have no real solution."""
        return [step.found.margin for step in self.steps if step.found.margin is not None]


def _settled(found: Found) -> Found:
    """Returns the result of a solution step; a unique solution has no sign and no margin."""
    if found.sign is None or found.sign.is_Symbol:
        return found
    return replace(found, sign=None, margin=None)
