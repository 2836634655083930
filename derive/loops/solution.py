"""All joints of a mechanism from the actuators, or from the joints of the main chain."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from ..model.errors import RobotError
from ..model.mechanism import Mechanism
from ..model.robot import Joint
from ..terms.tangents import LoopRate
from ..terms.terms import Terms
from .planar.assembly import assemble
from .planar.loop_step import LoopStep
from .planar.phasors import PhasorSum
from .planar.planes import Linkage, Loop, linkages
from .planar.reference import AtReference
from .spatial.legs import assemble_in_space
from .spatial.struts import Known


@dataclass(frozen=True)
class Solution:
    """The joints of a mechanism that follow in closed form.

    Attributes:
        mechanism: The description.
        values: Values of joints, swings and cylinders by name; angles may exceed a turn.
        loops: Rates of the solved angles, for :class:`~chasles.derive.terms.tangents.Tangent`.
        steps: The steps of the solution, in order.
        relations: Sums of turning vectors that are zero where the loops are closed.
        open: Names of joints that stay undetermined.
        reference: The reference configuration, for numbers.
    """

    mechanism: Mechanism
    values: Mapping[str, sp.Expr]
    loops: dict[sp.Symbol, LoopRate]
    steps: tuple[LoopStep, ...]
    relations: tuple[PhasorSum, ...]
    open: tuple[str, ...]
    reference: AtReference

    @property
    def margins(self) -> tuple[tuple[str, sp.Expr], ...]:
        """The margin of each step that can fail to close, with the name of its loop."""
        return tuple(
            (step.name(self.mechanism), step.margin)
            for step in self.steps
            if step.margin is not None
        )


@dataclass(frozen=True)
class Loops:
    """The loops of a mechanism, sorted once for every solution.

    Attributes:
        mechanism: The description.
        planar: Linkages whose joints move in one plane.
        spatial: The loops that are not planar.
    """

    mechanism: Mechanism
    planar: tuple[Linkage, ...]
    spatial: tuple[Loop, ...]


def sorted_loops(mechanism: Mechanism, terms: Terms) -> Loops:
    """The loops of a mechanism by kind."""
    planar, spatial = linkages(mechanism, terms)
    return Loops(mechanism, tuple(planar), tuple(spatial))


def from_actuators(
    loops: Loops, terms: Terms, q: Sequence[sp.Symbol], signs: Iterator[int] | None = None
) -> Solution:
    """All joints from the actuated coordinates.

    Args:
        loops: The mechanism and its loops.
        terms: Names of all terms.
        q: The actuated coordinates (radian or metre).
        signs: Signs of the branches, step by step, instead of those at the reference.

    Raises:
        RobotError: A loop does not close at the reference, or its branch there is not clear.
    """
    coordinates = loops.mechanism.coordinates
    known = {c.moves: c.ratio * s for c, s in zip(coordinates, q, strict=True)}
    at = {
        s: _value_of(loops.mechanism, c.name, c.moves, c.ratio)
        for c, s in zip(coordinates, q, strict=True)
    }
    return _solved(loops, terms, known, at, {}, signs)


def from_chain(
    loops: Loops,
    terms: Terms,
    theta: Sequence[sp.Symbol],
    signs: Iterator[int] | None = None,
    *,
    closed: Mapping[str, float],
) -> Solution:
    """All joints, actuators included, from the main chain's.

    Args:
        loops: The mechanism and its loops.
        terms: Names of all terms.
        theta: The main chain's joints (radian or metre).
        signs: Signs of the branches, step by step, instead of those at the reference.
        closed: Joint values at the reference configuration, as far as they are known.

    Raises:
        RobotError: A loop does not close at the reference, or its branch there is not clear.
    """
    moving = loops.mechanism.main_chain.moving
    known = {joint.name: symbol for joint, symbol in zip(moving, theta, strict=True)}
    near = _given(loops.mechanism) | dict(closed)
    at = {symbol: near.get(name, 0.0) for name, symbol in known.items()}
    return _solved(loops, terms, known, at, closed, signs)


def _solved(
    loops: Loops,
    terms: Terms,
    known: Mapping[str, sp.Expr],
    at: Mapping[sp.Symbol, float],
    closed: Mapping[str, float],
    signs: Iterator[int] | None,
) -> Solution:
    mechanism = loops.mechanism
    joints = [joint.name for joint in mechanism.joints if joint.kind != "fixed"]
    reference = AtReference(terms, at, _given(mechanism) | dict(closed), joints)
    values = dict(known)
    rates: dict[sp.Symbol, LoopRate] = {}
    steps: list[LoopStep] = []
    relations: list[PhasorSum] = []
    spatial = Known(values, rates, steps)
    try:
        for linkage in loops.planar:
            part = assemble(terms, linkage, values, reference, signs)
            values |= part.values
            rates |= part.loops
            steps.extend(part.steps)
            relations.extend(part.relations)
        assemble_in_space(terms, mechanism, loops.spatial, spatial, reference, signs)
    except RobotError as error:
        raise RobotError(f"robot {mechanism.name!r}: {error}") from error
    wanted = [*mechanism.members, *mechanism.swings]
    still_open = tuple(name for name in wanted if name not in values)
    return Solution(mechanism, values, rates, tuple(steps), tuple(relations), still_open, reference)


def joint_angle(terms: Terms, solution: Solution, value: sp.Expr, joint: Joint | None) -> sp.Expr:
    """A solved angle between -pi and pi, or within a turn about the middle of its joint's limits.

    Without limits, and with a reference beyond pi, it is within a turn about the nearest multiple
    of pi, so that angles near the reference are not a turn away from it.

    Args:
        terms: Names of all terms.
        solution: The solution that gives the value; receives the rate of the new name.
        value: A sum of solved angles and coordinates.
        joint: The joint of that angle, None for a swing.
    """
    if not terms.is_solved(value):
        return terms.let(value)
    middle = _middle(solution.mechanism, joint)
    sum_of_angles = sp.expand(value - middle)
    if sum_of_angles in terms.solved:
        return terms.let(sum_of_angles + middle)
    angle = terms.solved_angle(*terms.cos_sin(sum_of_angles))
    solution.loops.setdefault(angle, lambda tangent: tangent.of(sum_of_angles))
    return terms.let(angle + middle)


def _middle(mechanism: Mechanism, joint: Joint | None) -> sp.Expr:
    if joint is None:
        return sp.Integer(0)
    low, high = joint.limits
    if low is None or high is None:
        half_turns = float(mechanism.reference_of(joint.name)) / math.pi
        return sp.pi * round(half_turns) if abs(half_turns) > 1 else sp.Integer(0)
    if low >= -sp.pi and high <= sp.pi:
        return sp.Integer(0)
    return (low + high) / 2


def _given(mechanism: Mechanism) -> dict[str, float]:
    return {name: float(value) for name, value in mechanism.reference}


def _value_of(mechanism: Mechanism, name: str, moves: str, ratio: sp.Expr) -> float:
    """Reference value of a coordinate, given for itself or for the joint that it moves."""
    given = dict(mechanism.reference)
    if name not in given and moves in given:
        return float(given[moves] / ratio)
    return float(given.get(name, 0))
