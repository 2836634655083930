"""A loop step that treats a loop's unknown joints as a serial arm between bodies of known pose.

The step ``ArmStep`` supplements the loop steps in ``derive/loops/spatial/``. By default, the arm
uses the branch that contains the reference configuration.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import ClassVar

import sympy as sp

from ...loops.functions.maps import Maker, actuator_margin, backward_makers
from ...loops.functions.maps import from_chain as from_chain_joints
from ...loops.model.planes import Loop
from ...loops.planar.loop_step import LoopStep, StepEquations, quantity
from ...loops.planar.reference import AtReference, wrapped
from ...loops.solve.solution import from_actuators, from_chain
from ...loops.solve.solved_loops import SolvedLoops
from ...loops.spatial.struts import SIGNS, Legs
from ...model.tolerances import LOOPS_AGREE, RECOVERED
from ...terms.role import side_of
from ...terms.symbolic_function import SymbolicFunction
from ...terms.tangents import Tangent
from ...terms.terms import Terms
from ..mechanisms.moving_chain import locked_joints
from ..mechanisms.substitution import substituted, symbols_behind
from ..steps.work import InverseStep, Work
from .loop_arm import LoopArm, loop_arm

WHOLE = 6
"""Minimum number of joints with which an arm can reach every pose near a nonsingular configuration.
"""
Signs = Sequence[sp.Expr]


@dataclass(frozen=True, kw_only=True)
class ArmStep(LoopStep):
    """A solution step for joints of a serial arm between two bodies of known pose.

    Each solution step of the serial arm has up to two solutions.

    Attributes:
        found: Values of all arm joints if this step is the first step of the arm, otherwise an
            empty tuple.
        arm: The serial arm in its first step, otherwise None. The attribute is also None in the
            step that tests the values of locked joints.
    """

    found: tuple[sp.Expr, ...] = ()
    arm: LoopArm | None = field(default=None, repr=False, compare=False)

    title: ClassVar[str] = "serial arm between known bodies"
    branches: ClassVar[Mapping[int, str]] = {sign: side_of(sign) for sign in SIGNS}
    reason: ClassVar[str] = (
        "Both ends of these joints are known, so that the joints follow as in the inverse"
        " kinematics of a serial arm."
    )

    @classmethod
    def use(cls, legs: Legs, loop: Loop) -> bool:
        """Solve a loop's unknown joints as a serial arm, and return whether this is possible."""
        terms, known = legs.terms, legs.known
        either = _arm(legs, loop)
        signs = None if either is None else either.signs(legs)
        if either is None or signs is None:
            return False
        values, steps = either.on(signs, legs.reference.size)
        known.values.update(values)
        known.steps.extend(replace(step, axes=loop.meeting) for step in steps)
        for symbol in terms.needed(values.values()):
            if symbol in terms.solved:
                known.loops.setdefault(symbol, partial(_rate, *terms.solved[symbol]))
        return True

    @property
    def continues(self) -> bool:
        """Whether an earlier step contains the joint values of the arm."""
        return not self.found

    def equations(self) -> StepEquations:
        """Return the unknown joints and their values, without equations.

        The solution steps of the arm's closed-form inverse kinematics replace the equations.
        """
        return StepEquations(
            unknowns={quantity(f"s{k}"): value for k, value in enumerate(self.found)}
        )


class _SymbolicWork(Work):
    """Derivation state of an arm's inverse kinematics, in which symbols stand for branch signs."""

    def sign(self) -> sp.Expr:
        """Return a new symbol that selects one of two solutions."""
        self.signs.append(sp.Symbol(f"_side{len(self.signs) + 1}", real=True))
        return self.signs[-1]


@dataclass(frozen=True)
class _EitherBranch:
    """An arm's inverse kinematics solution for all branches, with symbols as branch signs.

    Attributes:
        arm: The arm.
        work: The solution steps.
        sides: The branch signs on which the values of the unknown joints depend.
        values: Values of the unknown joints, keyed by joint name.
        residual: The squared pose error (m^2 and rad^2).
    """

    arm: LoopArm
    work: _SymbolicWork
    sides: tuple[sp.Symbol, ...]
    values: dict[str, sp.Expr]
    residual: sp.Expr

    @classmethod
    def of(cls, terms: Terms, arm: LoopArm, entries: Sequence[sp.Expr]) -> "_EitherBranch | None":
        """Return the solution of an arm, or None if its branches have no smooth formulas."""
        work = _SymbolicWork(terms)
        values, residual = arm.solved(work, entries)
        used = symbols_behind(terms, [*values.values()])
        sides = tuple(symbol for symbol in work.signs if symbol in used)
        solved = tuple(step.found.sign for step in work.steps if step.found.sign in used)
        if solved != sides or not _is_smooth(terms, values.values()):
            return None
        return cls(arm, work, sides, values, residual)

    def signs(self, legs: Legs) -> Signs | None:
        """Return the requested branch signs, or the branch signs at the reference configuration.

        If no branch is requested, and the reference configuration is in no branch or in several
        branches, return None.
        """
        keys = [(self.arm.closure, symbol.name) for symbol in self.sides]
        if legs.branch is not None:
            return [sp.S.One * legs.branch.side(key) for key in keys]
        choices = [*product(SIGNS, repeat=len(keys))]
        near = [signs for signs in choices if self._distance(legs.reference, signs) < RECOVERED]
        if len(near) != 1:
            return None
        legs.reference.sides.update(zip(keys, near[0], strict=True))
        return [sp.Integer(sign) for sign in near[0]]

    def _distance(self, reference: AtReference, signs: Sequence[int]) -> float:
        """Return the distance of a branch from the reference configuration.

        For this distance, displacements of prismatic joints are divided by the size of the robot.
        """
        at = _with_signs(reference, self.values, dict(zip(self.sides, signs, strict=True)))
        near = reference.assumed | reference.given
        apart = [
            (at.of(self.values[joint.name]) - near[joint.name]) / reference.size
            if joint.kind == "prismatic"
            else wrapped(at.of(self.values[joint.name]) - near[joint.name])
            for joint in self.arm.unknown
        ]
        return math.hypot(*apart)

    def on(self, signs: Signs, size: float) -> tuple[dict[str, sp.Expr], list[ArmStep]]:
        """Return the values of the unknown joints, and the solution steps, for one branch.

        Args:
            signs: The branch signs.
            size: The longest length of the mechanism (meter).
        """
        terms = self.work.terms
        at = dict.fromkeys(self.work.signs, sp.S.One) | dict(zip(self.sides, signs, strict=True))
        found = substituted(terms, [*self.values.values()], at)
        values = dict(zip(self.values, found, strict=True))
        first, *others = [
            self._step(step, at) for step in self.work.steps if self._fails(step)
        ] or [ArmStep(joints=(self.arm.closure,), axes="")]
        margins = [step.margin for step in (first, *others) if step.margin is not None]
        if len(self.arm.robot.moving) < WHOLE:
            (residual,) = substituted(terms, [self.residual], at)
            tolerance = LOOPS_AGREE * min(size, 1.0)
            agree = terms.let(1 - residual / sp.Float(tolerance**2))
            least = agree if first.margin is None else _least(terms, [first.margin, agree])
            first, margins = replace(first, margin=least), [*margins, agree]
        first = replace(
            first,
            joints=tuple(dict.fromkeys((*first.joints, *values))),
            root=terms.let(sp.sqrt(_least(terms, margins))) if margins else sp.S.Zero,
            found=found,
            arm=self.arm,
        )
        return values, [first, *others]

    def _fails(self, step: InverseStep) -> bool:
        """Whether an inverse kinematics step has two solutions, or may have no solution."""
        return step.found.margin is not None or step.found.sign in self.sides

    def _step(self, step: InverseStep, at: Mapping[sp.Symbol, sp.Expr]) -> ArmStep:
        """Convert an inverse kinematics step to a solution step of the arm for one branch.

        In the returned step, ``joints`` starts with the name of the loop closure.
        """
        margin, sign = step.found.margin, step.found.sign
        if margin is not None:
            (margin,) = substituted(self.work.terms, [margin], at)
        names = [name for name in step.joints if name in self.values] or [self.arm.closure]
        return ArmStep(
            joints=(self.arm.closure, *names),
            axes="",
            margin=margin,
            sign=at[sign] if sign in self.sides else 0,
        )


def _arm(legs: Legs, loop: Loop) -> _EitherBranch | None:
    """Solve for the unknown joints of a loop with the inverse kinematics of a serial arm.

    Return None if the unknown joints cannot be solved as a serial arm.
    """
    terms, mechanism, values = legs.terms, legs.mechanism, legs.known.values
    open_ = frozenset(joint.name for joint in loop.joints if joint.name not in values)
    if not open_:
        return None
    arm = terms.memoize(
        ("arm of a loop", mechanism, loop.loop_joint.name, open_),
        lambda: loop_arm(mechanism, terms, loop, open_),
    )
    if arm is None:
        return None
    entries = arm.wanted(mechanism, terms, values)
    return terms.memoize(
        ("arm on either branch", mechanism, arm.closure, open_, *entries),
        lambda: _EitherBranch.of(terms, arm, entries),
    )


def _with_signs(
    reference: AtReference, values: dict[str, sp.Expr], signs: dict[sp.Symbol, int]
) -> AtReference:
    """Return the values of terms at the reference configuration for given branch signs."""
    terms, moved = reference.terms, set(signs)
    used = {symbol for value in values.values() for symbol in value.free_symbols}
    for symbol in terms.needed(values.values()):
        behind = terms.definitions[symbol].free_symbols
        if behind & moved:
            moved.add(symbol)
            used |= behind
    known = {symbol: reference.of(symbol) for symbol in used - moved}
    return AtReference(terms, known | {s: float(v) for s, v in signs.items()}, {})


def _is_smooth(terms: Terms, values: Iterable[sp.Expr]) -> bool:
    """Whether the expressions, and the terms on which they depend, contain neither Min nor Max."""
    waiting, seen = [*values], set[sp.Symbol]()
    while waiting:
        entry = waiting.pop()
        if isinstance(entry, sp.Min | sp.Max):
            return False
        if isinstance(entry, sp.Piecewise):
            waiting += [value for value, _ in entry.args]
        elif entry in terms.definitions and entry not in seen:
            seen.add(entry)
            waiting.append(terms.definitions[entry])
        else:
            waiting += entry.args
    return True


def _rate(c: sp.Expr, s: sp.Expr, tangent: Tangent) -> sp.Expr:
    """Return the rate of an angle from the cosine c, the sine s and their rates."""
    return tangent.terms.let(c * tangent.of(s) - s * tangent.of(c))


def _least(terms: Terms, margins: Sequence[sp.Expr]) -> sp.Expr:
    """Return the smallest of several margins."""
    least = margins[0]
    for margin in margins[1:]:
        least = terms.let(sp.Min(least, margin, evaluate=False))
    return least


def with_arms(h: SolvedLoops) -> SolvedLoops:
    """Solve the loop joints that are still unknown as serial arms.

    If the actuators do not determine all joints, even when serial arms are used, ``h`` is returned
    unchanged.
    """
    if not h.forward.open or h.is_overdetermined or h.least_squares_closure is not None:
        return h
    loops = replace(h.loops, last_step=ArmStep.use)
    forward = from_actuators(loops, h.terms, h.q, closed=h.at_reference)
    if forward.open:
        return h
    backward = (from_chain_with_arms(h) or h).backward
    return replace(h, loops=loops, forward=forward, backward=backward)


def makers(h: SolvedLoops) -> dict[str, Maker]:
    """Return builders of the functions that need the inverse kinematics of a serial arm.

    Each built function takes the joint values of the main chain as an input.
    """
    arms = from_chain_with_arms(h)
    if arms is None:
        return {}
    found = {**backward_makers(from_chain_joints(arms)), "actuator_margin": actuator_margin}
    return {name: partial(_with, arms, maker) for name, maker in found.items()}


def _with(arms: SolvedLoops, maker: Maker, _: SolvedLoops) -> SymbolicFunction:
    return maker(arms)


def from_chain_with_arms(h: SolvedLoops) -> SolvedLoops | None:
    """Solve the loops for given values of the joints in the main chain.

    Some solution steps of the loops use the inverse kinematics of serial arms.

    Return None if all actuators can be computed without serial arms, or if serial arms do not
    determine all actuators.
    """
    actuated = {coordinate.moves for coordinate in h.mechanism.coordinates}
    if actuated.isdisjoint(h.backward.open) or h.least_squares_closure is not None:
        return None
    loops = replace(h.loops, last_step=ArmStep.use)
    moving = h.robot.moving
    locked = {k: moving[k].direction * value for k, value in locked_joints(h).items()}
    known = {moving[k].name: value for k, value in locked.items()}
    backward = h.terms.memoize(
        ("arms from the chain", h),
        lambda: from_chain(loops, h.terms, h.theta, closed=h.at_reference, locked=known),
    )
    if not actuated.isdisjoint(backward.open):
        return None
    steps = (*([_at_rest(h, locked)] if locked else []), *backward.steps)
    return replace(h, loops=loops, backward=replace(backward, steps=steps))


def _at_rest(h: SolvedLoops, locked: Mapping[int, sp.Expr]) -> ArmStep:
    """Return a step whose margin is negative if the locked joints do not keep their values."""
    terms, joints = h.terms, [h.robot.moving[k] for k in locked]
    units = [h.numbers.size if joint.kind == "prismatic" else 1.0 for joint in joints]
    apart = [
        (h.theta[k] - value) / sp.Float(LOOPS_AGREE * unit)
        for (k, value), unit in zip(locked.items(), units, strict=True)
    ]
    margin = terms.let(1 - sum((terms.let(x) ** 2 for x in apart), sp.S.Zero))
    names = tuple(joint.name for joint in joints)
    root = terms.let(sp.sqrt(margin))
    return ArmStep(joints=names, axes=h.mechanism.base_frame, margin=margin, root=root)
