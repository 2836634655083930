"""Legs that are solved from the pose of a platform.

Each leg is a serial arm between two known bodies.

A leg starts at a known body and ends at a closure. If the other body of the closure is also known,
the leg is an arm whose last link has a known pose. A family of closed-form inverses solves this
arm. Examples with closed forms are a tripteron (one prismatic and three parallel joints per leg),
an Exechon, a 3-UPU, and rods between universal joints.

Several configurations of a leg can have the same actuated coordinate. These configurations share a
solution slot. The residual of the slot is the smallest residual of these configurations.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import sympy as sp

from ...chain.forward import Pose
from ...loops.model.body_frames import pose_along
from ...loops.model.planes import Loop, loops
from ...loops.solve.solved_loops import SolvedLoops
from ...model.mechanism import Closure, Frame
from ...model.robot import Joint, SerialRobot
from ...terms.role import side_of
from ...terms.terms import Terms
from ...terms.vectors import Vector, dot, subtracted
from ..chain_solution import solve_chain
from ..classify import Attempt, classify
from ..families import FAMILIES, LEG_FAMILIES
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import Lines, home_of
from ..tasks.slots import POSE_SYMBOLS, pose_errors, squares, tool_of, values_of
from ..tool_axis import with_still_axis
from .substitution import substituted

Values = Mapping[str, sp.Expr]
FREEDOMS: Mapping[str, tuple[Joint, ...]] = {
    "pin": (Joint("closure", "revolute"),),
    "slider": (Joint("closure", "prismatic"),),
    "weld": (),
}
"""The joints that replace a closure at the end of a leg, keyed by the kind of closure."""


@dataclass
class LegWork(Work):
    """State of the derivation of one leg.

    Attributes:
        hidden: Indices of the branch signs that do not change the actuated coordinate of the leg.
        passive: Symbols of the branch signs that do not change the coordinate.
        requested: Number of branch signs of the leg so far.
    """

    hidden: frozenset[int] = frozenset()
    passive: list[sp.Symbol] = field(default_factory=list)
    requested: int = 0

    def sign(self) -> sp.Expr:
        """Returns a new symbol that selects one of two solutions."""
        self.requested += 1
        if self.requested - 1 not in self.hidden:
            return super().sign()
        self.passive.append(sp.Symbol(f"_passive{len(self.passive) + 1}", real=True))
        return self.passive[-1]


@dataclass(frozen=True)
class LegChain:
    """A leg as a serial arm from a known body to a closure.

    Attributes:
        closure: Name of the closure.
        known: The known joints before the leg, from the common body of the loop.
        unknown: The moving joints of the leg.
        back: The known joints from the common body to the other body of the closure.
        end: The frame of the closure on its other body.
        robot: A serial robot: the leg, and the joints that replace its closure.
        lines: The axes of the leg joints.
        found: The structure that solves the leg.
    """

    closure: str
    known: tuple[Joint, ...]
    unknown: tuple[Joint, ...]
    back: tuple[Joint, ...]
    end: Frame
    robot: SerialRobot
    lines: Lines
    found: Attempt

    def solved(
        self, h: SolvedLoops, work: Work, values: Values
    ) -> tuple[dict[str, sp.Expr], sp.Expr]:
        """Returns (actuated coordinates of the leg, squared closure error in m^2 and rad^2).

        Args:
            h: The robot.
            work: State of the derivation, which receives the signs and solution steps of the leg.
            values: Values of the known joints by name.
        """
        entries = self._wanted(h, values)
        first = len(work.signs)
        own = LegWork(
            h.terms,
            signs=work.signs,
            settled=work.settled,
            choices=work.choices,
            hidden=self._hidden(h),
        )
        found, residual = self._solution(own, entries)
        work.choices = own.choices
        self._name_sides(work, own, first)
        passive = set(own.passive)
        work.steps += [
            step
            for step in own.steps
            if step.found.margin is None or not passive & _behind(h.terms, [step.found.margin])
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
        found, _ = self._solution(alone, POSE_SYMBOLS)
        needed = _behind(h.terms, [x for name, x in found.items() if name in driven])
        return frozenset(k for k, sign in enumerate(alone.signs) if sign not in needed)

    def _solution(
        self, work: Work, entries: Sequence[sp.Expr]
    ) -> tuple[dict[str, sp.Expr], sp.Expr]:
        terms, robot = work.terms, self.robot
        solve_chain(
            work, self.lines, self.found, of_pose(terms, entries, home_of(robot, terms)), {}
        )
        values = values_of(work, robot, {})
        moved, turned = pose_errors(tool_of(terms, robot, values), entries)
        joints = zip(robot.moving, values, strict=True)
        found = {joint.name: joint.direction * value for joint, value in joints}
        names = [joint.name for joint in self.unknown]
        residual = terms.let(squares(terms, moved) + squares(terms, turned) / 2)
        return {name: found[name] for name in names}, residual

    def _wanted(self, h: SolvedLoops, values: Values) -> list[sp.Expr]:
        m, terms = h.mechanism, h.terms
        start = pose_along(m, terms, self.known, (), values)
        (x, y, z), p = pose_along(m, terms, self.back, self.end.placement, values)
        columns = [*(_seen(terms, start, v) for v in (x, y, z))]
        columns.append(_seen(terms, start, subtracted(terms, p, start[1])))
        rows = [[column[i] for column in columns] for i in range(3)]
        last = [sp.S.Zero, sp.S.Zero, sp.S.Zero, sp.S.One]
        return [entry for row in (*rows, last) for entry in row]


def leg_chains(h: SolvedLoops) -> tuple[LegChain, ...] | None:
    """Returns the legs whose joints have no other closed form. None if there are no such legs.

    The tuple is empty if the main chain determines all joints in closed form.
    """
    open_ = set(h.backward.open)
    chain = {joint.name for joint in h.robot.moving}
    if open_ & chain:
        return None
    found = []
    for loop in loops(h.mechanism):
        names = {joint.name for joint in loop.joints}
        if not names & open_:
            continue
        leg = _leg(h, loop, open_)
        if leg is None:
            return None
        found.append(leg)
        open_ -= {joint.name for joint in leg.unknown}
    return None if open_ else tuple(found)


def _leg(h: SolvedLoops, loop: Loop, open_: Collection[str]) -> LegChain | None:
    loop_joint = loop.loop_joint
    if not isinstance(loop_joint, Closure) or loop_joint.kind not in FREEDOMS:
        return None
    sides = (
        (loop.to_a, loop.to_b, loop_joint.a, loop_joint.b),
        (loop.to_b, loop.to_a, loop_joint.b, loop_joint.a),
    )
    legs = [side for side in sides if any(joint.name in open_ for joint in side[0])]
    if len(legs) != 1:
        return None
    ((own, back, near, end),) = legs
    first = next(k for k, joint in enumerate(own) if joint.name in open_)
    known, leg = own[:first], own[first:]
    unknown = tuple(joint for joint in leg if joint.kind != "fixed")
    if any(joint.name not in open_ for joint in unknown):
        return None
    joints = [replace(joint, parent="") for joint in leg]
    freedom = FREEDOMS[loop_joint.kind]
    after = near.placement
    if freedom:
        joints.append(replace(freedom[0], before=after))
        after = ()
    robot = SerialRobot(
        h.mechanism.name, tuple(joints), tool=after, parameters=h.mechanism.parameters
    )
    structure = structure_of(robot, h.terms)
    if structure is None:
        return None
    return LegChain(loop_joint.name, known, unknown, back, end, robot, *structure)


def structure_of(robot: SerialRobot, terms: Terms) -> tuple[Lines, Attempt] | None:
    """Returns the axes and the structure of a leg, or None if no structure fits."""
    classification = classify(robot, terms, families=LEG_FAMILIES)
    found = classification.found
    if found is None:
        return with_still_axis(robot, classification, FAMILIES)
    fits = classification.method == "exact" and not found.given and not found.family.inputs
    return (classification.lines, found) if fits else None


def _seen(terms: Terms, frame: Pose, vector: Vector) -> Vector:
    x, y, z = (dot(terms, axis, vector) for axis in frame[0])
    return x, y, z


def _behind(terms: Terms, entries: Sequence[sp.Expr]) -> set[sp.Symbol]:
    found = [*entries, *(terms.definitions[symbol] for symbol in terms.needed(entries))]
    found += [part for s in terms.needed(entries) if s in terms.solved for part in terms.solved[s]]
    return {symbol for entry in found for symbol in entry.free_symbols}


def _least(terms: Terms, residual: sp.Expr, passive: Sequence[sp.Symbol]) -> sp.Expr:
    residuals = [
        substituted(terms, [residual], dict(zip(passive, map(sp.Integer, signs), strict=True)))[0]
        for signs in product((1, -1), repeat=len(passive))
    ]
    least = residuals[0]
    for other in residuals[1:]:
        least = terms.let(sp.Min(least, other, evaluate=False))
    return least
