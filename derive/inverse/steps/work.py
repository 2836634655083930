"""Records the steps of a closed-form inverse kinematics solution while they are derived."""

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
    """One step of a closed-form inverse kinematics solution.

    Attributes:
        joints: Names of the joints for which the step solves. A step with two or more joints solves
            for the sum of the joint angles.
        method: The solution method, for example "subproblem 4".
        reason: The reason why the equation of the step contains no other unknown joint.
        found: The angle or displacement that the step computes, with its equation.
        degenerate: Text that names the poses at which the joint value is arbitrary, and the joint
            value that is selected at these poses.
    """

    joints: tuple[str, ...]
    method: str
    reason: str
    found: FoundTurn | FoundLength
    degenerate: str = ""


@dataclass(frozen=True)
class NamedVector:
    """A vector that step descriptions refer to by name.

    Attributes:
        letters: Candidate LaTeX letters for the vector, in order of preference. Letters of robot
            parameters are not used for the vector.
        meaning: Description of the vector.
        vector: The components of the vector in base axes, in meters if the vector is a position.
        after: Number of solution steps that are recorded before the vector. The vector may depend
            on these steps.
    """

    letters: tuple[str, ...]
    meaning: str
    vector: Vector
    after: int


@dataclass(frozen=True)
class Remainder:
    """A joint whose angle follows from a known angle sum.

    The joint angle is the known angle sum minus the angles of the other joints.

    Attributes:
        joints: Names of the joints in the sum, ordered as in the solution step.
        last: Name of the joint whose angle is computed.
    """

    joints: tuple[str, ...]
    last: str


@dataclass(frozen=True)
class Sum:
    """Parallel joints whose angle sum is solved before the single angles.

    Attributes:
        senses: For each joint, its index and the sense (1 or -1) of its angle about the first axis.
        turn: Cosine and sine of the angle sum.
    """

    senses: tuple[tuple[int, int], ...]
    turn: CosSin


@dataclass
class Work:
    """State of the derivation of a closed-form inverse kinematics solution.

    The code of the arm's family adds the solution steps one by one.

    Attributes:
        terms: Table of named terms.
        turns: Cosine and sine of each joint angle, keyed by joint index.
        sums: Angle sums of parallel joints, which need fewer calls of atan2 than single angles.
        remainders: Joints whose angles are computed from an angle sum.
        lengths: The value of each prismatic joint, keyed by joint index.
        locked: Indices of the joints that loops lock.
        signs: The symbols of the signs (1 or -1), in the order of the solution slots.
        settled: Indices of the branch-selecting signs that are not needed and always 1.
        choices: Number of calls of ``sign`` so far, including the calls for signs that are always
            1.
        sides: Loop name and branch names, keyed by the sign symbol that selects the loop branch.
            The branch names are keyed by the sign value (1 or -1).
        steps: The solution steps in order.
        vectors: The named vectors.
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
        """Return a new symbol that selects one of two solutions.

        If the sign is not needed, the function returns the number 1 instead of a symbol.
        """
        self.choices += 1
        if self.choices - 1 in self.settled:
            return sp.Integer(1)
        self.signs.append(sp.Symbol(f"_sign{len(self.signs) + 1}", real=True))
        return self.signs[-1]

    def name_vector(self, letters: tuple[str, ...], meaning: str, vector: Vector) -> Vector:
        """Give a vector a name for the LaTeX article, and return the vector."""
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
        """Record a solution step for a joint angle or for a sum of joint angles.

        If the step has only one axis, the rotation of its joint is also recorded.
        """
        found = _settled(found)
        self.steps.append(
            InverseStep(tuple(axis.name for axis in axes), method, reason, found, degenerate)
        )
        if len(axes) == 1:
            self.turns[axes[0].joint] = found.turn
        return found.turn

    def slide(self, axis: Axis, method: str, reason: str, found: FoundLength) -> sp.Expr:
        """Record a solution step for a prismatic joint."""
        self.steps.append(InverseStep((axis.name,), method, reason, _settled(found)))
        self.lengths[axis.joint] = found.length
        return found.length

    def note(self, names: Sequence[str], method: str, reason: str, found: FoundTurn) -> CosSin:
        """Record a solution step for an angle that is not a joint angle."""
        self.steps.append(InverseStep(tuple(names), method, reason, _settled(found)))
        return found.turn

    def note_length(
        self, names: Sequence[str], method: str, reason: str, found: FoundLength
    ) -> sp.Expr:
        """Record a step that solves for a length that is not a joint displacement."""
        self.steps.append(InverseStep(tuple(names), method, reason, _settled(found)))
        return found.length

    def remainder(self, axes: Sequence[Axis]) -> None:
        """Record that the angle of the last joint follows from the sum of all joint angles."""
        names = tuple(axis.name for axis in axes)
        self.remainders.append(Remainder(names, names[-1]))

    def margins(self) -> list[sp.Expr]:
        """Return the margins of all steps that may have no real solution."""
        return [step.found.margin for step in self.steps if step.found.margin is not None]


def _settled(found: Found) -> Found:
    if found.sign is None or found.sign.is_Symbol:
        return found
    return replace(found, sign=None, margin=None)
