"""Legs that are solved from the pose of a platform.

Each leg is a serial arm between two bodies with known poses.

A leg starts at a body with a known pose and ends at a joint that closes a loop. The loop-closing
joint connects the leg to another body. If the pose of this other body is also known, the leg is an
arm whose last link has a known pose. A family of closed-form inverse kinematics solves the leg as
such an arm. Examples with closed forms are the legs of a tripteron (one prismatic and three
parallel joints per leg), of an Exechon, of a 3-UPU, and rods between universal joints.

Several configurations of a leg can have the same actuated coordinate. A single solution slot
represents all configurations of a leg with the same actuated coordinate. The residual of the
solution slot is the smallest residual of all configurations that the slot represents.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import sympy as sp

from ...loops.model.planes import loops
from ...loops.solve.solved_loops import SolvedLoops
from ...terms.role import side_of
from ...terms.terms import Terms
from ..arms.loop_arm import LoopArm, Values, loop_arm
from ..steps.work import Work
from ..tasks.slots import POSE_SYMBOLS
from .substitution import substituted, symbols_behind


@dataclass
class LegWork(Work):
    """State of the derivation that solves one leg.

    Attributes:
        hidden: Indices of the branch signs that do not change the actuated coordinate of the leg.
        passive: Symbols of the branch signs that do not change the actuated coordinate of the leg.
        requested: Number of branch signs that the derivation of the leg has requested so far.
    """

    hidden: frozenset[int] = frozenset()
    passive: list[sp.Symbol] = field(default_factory=list)
    requested: int = 0

    def sign(self) -> sp.Expr:
        """Return a new symbol that selects one of two solutions."""
        self.requested += 1
        if self.requested - 1 not in self.hidden:
            return super().sign()
        self.passive.append(sp.Symbol(f"_passive{len(self.passive) + 1}", real=True))
        return self.passive[-1]


@dataclass(frozen=True)
class LegChain:
    """A leg as a serial arm from a body with a known pose to the joint that closes the loop.

    Attributes:
        arm: The serial arm, which consists of the joints of the leg and its loop-closing joint.
    """

    arm: LoopArm

    @property
    def closure(self) -> str:
        """Name of the joint that closes the loop of the leg."""
        return self.arm.closure

    def solved(
        self, h: SolvedLoops, work: Work, values: Values
    ) -> tuple[dict[str, sp.Expr], sp.Expr]:
        """Return (actuated coordinates of the leg, squared closure error in m^2 and rad^2).

        Args:
            h: The robot.
            work: Object that records the branch signs and the solution steps of the leg.
            values: Values of the known joints, keyed by joint name.
        """
        entries = self.arm.wanted(h.mechanism, h.terms, values)
        first = len(work.signs)
        own = LegWork(
            h.terms,
            signs=work.signs,
            settled=work.settled,
            choices=work.choices,
            hidden=self._hidden(h),
        )
        found, residual = self.arm.solved(own, entries)
        work.choices = own.choices
        self._name_sides(work, own, first)
        passive = set(own.passive)
        work.steps += [
            step
            for step in own.steps
            if step.found.margin is None
            or not passive & symbols_behind(h.terms, [step.found.margin])
        ]
        coordinates = {
            c.name: h.terms.let(found[c.moves] / c.ratio)
            for c in h.mechanism.coordinates
            if c.moves in found
        }
        return coordinates, _least(h.terms, residual, own.passive)

    def _name_sides(self, work: Work, own: LegWork, first: int) -> None:
        joints = {step.found.sign: "+".join(step.joints) for step in own.steps}
        for symbol in work.signs[first:]:
            name = f"{self.closure} at {joints[symbol]}" if symbol in joints else self.closure
            work.sides[symbol] = name, {sign: side_of(sign) for sign in (1, -1)}

    def _hidden(self, h: SolvedLoops) -> frozenset[int]:
        driven = {c.moves for c in h.mechanism.coordinates}
        alone = LegWork(h.terms)
        found, _ = self.arm.solved(alone, POSE_SYMBOLS)
        needed = symbols_behind(h.terms, [x for name, x in found.items() if name in driven])
        return frozenset(k for k, sign in enumerate(alone.signs) if sign not in needed)


def leg_chains(h: SolvedLoops) -> tuple[LegChain, ...] | None:
    """Return the legs that must be solved as serial arms, or None if any joint stays unsolved.

    The returned tuple is empty if the main chain determines all joints in closed form.
    """
    open_ = set(h.backward.open)
    chain = {joint.name for joint in h.robot.moving}
    if open_ & (chain | h.mechanism.coupled):
        return None
    found = []
    for loop in loops(h.mechanism):
        names = {joint.name for joint in loop.joints}
        if not names & open_:
            continue
        arm = loop_arm(h.mechanism, h.terms, loop, open_)
        if arm is None:
            return None
        found.append(LegChain(arm))
        open_ -= {joint.name for joint in arm.unknown}
    return None if open_ else tuple(found)


def _least(terms: Terms, residual: sp.Expr, passive: Sequence[sp.Symbol]) -> sp.Expr:
    residuals = [
        substituted(terms, [residual], dict(zip(passive, map(sp.Integer, signs), strict=True)))[0]
        for signs in product((1, -1), repeat=len(passive))
    ]
    least = residuals[0]
    for other in residuals[1:]:
        least = terms.let(sp.Min(least, other, evaluate=False))
    return least
