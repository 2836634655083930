"""A body on several guides whose bearings do not rotate, such as a bridge on two rails.

A closing joint connects the ends of the two branches of a loop. Both frames of the closing joint
must be aligned when all revolute joints have their reference values. If the axes of the unknown
revolute joints are linearly independent, these joints keep their reference values. A linear
equation then gives the displacements of the prismatic joints at which both frame origins of the
closing joint coincide.

The guides have a second assembly mode, in which bearings are rotated by half a turn. The linear
equation does not yield this second mode. The second mode is irrelevant, because bearings are not
mounted rotated by half a turn.

Source: Blanding, Exact Constraint, 1999, ch. 4, for bodies on guides without overconstraint.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import ClassVar

import numpy as np
import sympy as sp

from ...chain.forward import Pose
from ...model.mechanism import Closure
from ...model.robot import Joint
from ...model.tolerances import REPEATED_EQUATION, ZERO_COMPONENT
from ...terms.generic_point import GenericPoint, coordinates_in
from ...terms.vectors import Vector, added, dot, named, subtracted
from ..model.body_frames import pose_along
from ..model.planes import Loop
from ..planar.loop_step import LoopStep, StepEquations
from .struts import Legs

SPACE_AXES = 3


@dataclass(frozen=True, kw_only=True)
class Guides(LoopStep):
    """Solution step for the prismatic joints of a body that slides without rotating."""

    title: ClassVar[str] = "guides"
    reason: ClassVar[str] = (
        "The bearings rotate about independent axes, so their angles stay constant; the"
        " prismatic joints follow from the closure position."
    )

    @classmethod
    def use(cls, legs: Legs, loop: Loop) -> bool:
        """Solve for the unknown prismatic and revolute joints of a loop."""
        found = _Guided(legs, loop).values()
        if not found:
            return False
        legs.known.values.update(found)
        names = (*found, loop.loop_joint.name)
        legs.known.steps.append(cls(joints=names, axes=loop.meeting))
        return True

    def equations(self) -> StepEquations:
        """Return no equations, because each slide travel is a sum of known travels."""
        return StepEquations()


class _Guided:
    """The unknown joints of a loop."""

    def __init__(self, legs: Legs, loop: Loop) -> None:
        self.legs, self.loop, self.terms = legs, loop, legs.terms
        known = legs.known.values
        self.unknown = [joint for joint in loop.joints if joint.name not in known]
        self.slides = [joint for joint in self.unknown if joint.kind == "prismatic"]
        self.turns = [joint for joint in self.unknown if joint.kind == "revolute"]
        self.still: Mapping[str, sp.Expr] = {
            **known,
            **{joint.name: legs.mechanism.reference_of(joint.name) for joint in self.turns},
            **{joint.name: sp.Integer(0) for joint in self.slides},
        }

    def values(self) -> dict[str, sp.Expr]:
        """Return the values of the unknown joints of a loop, keyed by name.

        The dictionary is empty if the step for guides does not apply to the loop.
        """
        loop_joint = self.loop.loop_joint
        both = {joint.name for joint in self.loop.to_a} & {j.name for j in self.loop.to_b}
        if (
            not isinstance(loop_joint, Closure)
            or not self.unknown
            or len(self.slides) + len(self.turns) < len(self.unknown)
            or both
            or len(self.slides) > SPACE_AXES
        ):
            return {}
        (A, p_a), (B, p_b) = self._ends(loop_joint)
        if not self._turns_stay(loop_joint, A, B):
            return {}
        travels = self._travels(loop_joint, A, subtracted(self.terms, p_b, p_a))
        return {} if travels is None else {j.name: self.still[j.name] for j in self.turns} | travels

    def _ends(self, loop_joint: Closure) -> tuple[Pose, Pose]:
        mechanism, terms = self.legs.mechanism, self.terms
        return (
            pose_along(mechanism, terms, self.loop.to_a, loop_joint.a.placement, self.still),
            pose_along(mechanism, terms, self.loop.to_b, loop_joint.b.placement, self.still),
        )

    def _axis(self, joint: Joint) -> Vector:
        """Return a joint's motion direction in the frame of the body where both branches start."""
        path = self.loop.to_a if joint in self.loop.to_a else self.loop.to_b
        before = path[: path.index(joint)]
        axes, _ = pose_along(self.legs.mechanism, self.terms, before, joint.before, self.still)
        return named(self.terms, (joint.direction * x for x in axes[2]))

    def _turns_stay(self, loop_joint: Closure, A: Sequence[Vector], B: Sequence[Vector]) -> bool:
        """Whether the closure frames align at the reference angles, and no rotation is free."""
        along = [dot(self.terms, a, b) for a, b in zip(A, B, strict=True)]
        free = [self._axis(joint) for joint in self.turns]
        agree = {"pin": along[2:], "ball": [], "weld": along, "slider": along}[loop_joint.kind]
        if loop_joint.kind == "pin":
            free.append(A[2])
        if loop_joint.kind == "ball" or not self._vanish([entry - 1 for entry in agree]):
            return False
        numbers = [[self.legs.reference.of(x) for x in axis] for axis in free]
        return not free or bool(
            np.linalg.matrix_rank(np.array(numbers), tol=REPEATED_EQUATION) == len(free)
        )

    def _travels(
        self, loop_joint: Closure, A: Sequence[Vector], d: Vector
    ) -> dict[str, sp.Expr] | None:
        """Return slide displacements that close the loop, or None if this step does not apply."""
        terms = self.terms
        axes = [self._axis(joint) for joint in self.slides]
        if loop_joint.kind == "slider":
            axes.append(A[2])
        crossed = [dot(terms, one, other) for one, other in combinations(axes, 2)]
        if not self._vanish(crossed):
            return None
        travels = {}
        for joint, axis in zip(self.slides, axes, strict=False):
            sense = 1 if joint in self.loop.to_a else -1
            travels[joint.name] = terms.let(sense * dot(terms, axis, d))
        rest = d
        for axis in axes:
            part = dot(terms, axis, d)
            rest = added(terms, rest, named(terms, (-part * x for x in axis)))
        return travels if self._vanish(rest) else None

    def _vanish(self, entries: Sequence[sp.Expr]) -> bool:
        """Whether expressions are always zero, tested at a single generic configuration."""
        generic = GenericPoint(self.terms, coordinates_in(self.terms, entries))
        return all(abs(generic.value(entry)) < ZERO_COMPONENT for entry in entries)
