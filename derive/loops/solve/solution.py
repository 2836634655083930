"""All joints of a mechanism as functions of the actuators or of the main chain."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice

import sympy as sp

from ...model.coupling import Coupling
from ...model.errors import DescriptionError
from ...model.mechanism import Mechanism
from ...model.robot import Joint
from ...terms.tangents import LoopRate
from ...terms.terms import Terms
from ..model.coupling_equations import is_length
from ..model.numeric_mechanism import NumericMechanism
from ..model.phasors import PhasorSum
from ..model.planes import Linkage, Loop, WeldEdge, linkages
from ..planar.assembly import Assembly, assemble, assemblies
from ..planar.loop_step import LoopStep
from ..planar.reference import AtReference, Branch, FreeSides, every_branch
from ..spatial.legs import LastStep, assemble_in_space
from ..spatial.struts import Known

OFF_THE_REFERENCE = (0.05, -0.08)
"""Offsets from the reference coordinates (radian, or relative to the size of the robot). Each
branch is also tested at these offsets from the reference."""


@dataclass(frozen=True)
class Solution:
    """A closed-form solution for the joints of a mechanism.

    Attributes:
        mechanism: The description.
        values: Values of joints, swing angles and cylinders, keyed by name. Joint and swing angles
            may exceed a full turn.
        loops: Functions that ``Tangent`` calls to compute the rates of the solved angles.
        steps: The solution steps, in the order in which they are evaluated.
        relations: Sums of rotated planar vectors that are zero if the loops close.
        open: Names of the joints, swing angles and cylinders whose values the solution does not
            determine.
        reference: The numerical values of terms at the reference configuration.
        coupled: Names of the joints whose values follow from couplings.
    """

    mechanism: Mechanism
    values: Mapping[str, sp.Expr]
    loops: dict[sp.Symbol, LoopRate]
    steps: tuple[LoopStep, ...]
    relations: tuple[PhasorSum, ...]
    open: tuple[str, ...]
    reference: AtReference
    coupled: tuple[str, ...] = ()

    @property
    def margins(self) -> tuple[tuple[str, sp.Expr], ...]:
        """Name and margin of each solution step that has a margin."""
        return tuple(
            (step.name(self.mechanism), step.margin)
            for step in self.steps
            if step.margin is not None
        )


@dataclass(frozen=True)
class Loops:
    """The loops of a mechanism, sorted into planar linkages and spatial loops.

    Attributes:
        mechanism: The description.
        planar: Linkages whose joints move in one plane.
        spatial: The loops that are not planar.
        last_step: The solution step to try on each spatial loop if no solution step of this package
            applies.
    """

    mechanism: Mechanism
    planar: tuple[Linkage, ...]
    spatial: tuple[Loop, ...]
    last_step: LastStep | None = None


def sorted_loops(mechanism: Mechanism) -> Loops:
    """Sort the loops of a mechanism into planar linkages and spatial loops."""
    planar, spatial = linkages(mechanism)
    return Loops(mechanism, tuple(planar), tuple(spatial))


def from_actuators(
    loops: Loops,
    terms: Terms,
    q: Sequence[sp.Symbol],
    *,
    closed: Mapping[str, float] | None = None,
) -> Solution:
    """Return the values of all joints as functions of the actuated coordinates.

    Args:
        loops: The mechanism and its loops.
        terms: Receives the terms.
        q: The actuated coordinates (radian or meter).
        closed: The known joint values at the reference configuration.

    Raises:
        DescriptionError: A loop does not close at the reference, or its branch is ambiguous there.
    """
    coordinates = loops.mechanism.coordinates
    known = {c.moves: c.ratio * s for c, s in zip(coordinates, q, strict=True)}
    at = {
        s: _value_of(loops.mechanism, c.name, c.moves, c.ratio)
        for c, s in zip(coordinates, q, strict=True)
    }
    return _solved(loops, _begun(loops, terms, known, at, closed or {}))


def from_chain(
    loops: Loops,
    terms: Terms,
    theta: Sequence[sp.Symbol],
    *,
    closed: Mapping[str, float],
    locked: Mapping[str, sp.Expr] | None = None,
) -> Solution:
    """Return all joint values and actuator values as functions of the main-chain joints.

    Args:
        loops: The mechanism and its loops.
        terms: Receives the terms.
        theta: The main-chain joints (radian or meter).
        closed: The joint values at the reference configuration, keyed by name.
        locked: The constant values of joints that the loops lock, keyed by name.

    Raises:
        DescriptionError: A loop does not close at the reference, or its branch is ambiguous there.
    """
    moving = loops.mechanism.main_chain.moving
    known = {joint.name: symbol for joint, symbol in zip(moving, theta, strict=True)}
    near = _given(loops.mechanism) | dict(closed)
    at = {symbol: near.get(name, 0.0) for name, symbol in known.items()}
    return _solved(loops, _begun(loops, terms, known | dict(locked or {}), at, closed))


def _begun(
    loops: Loops,
    terms: Terms,
    known: Mapping[str, sp.Expr],
    at: Mapping[sp.Symbol, float],
    closed: Mapping[str, float],
) -> Solution:
    """Return the initial solution, which contains no solution steps."""
    mechanism = loops.mechanism
    joints = [joint.name for joint in mechanism.joints if joint.kind != "fixed"]
    size = NumericMechanism(mechanism).size
    reference = AtReference(terms, at, _given(mechanism) | dict(closed), joints, size)
    return _with_open(Solution(mechanism, dict(known), {}, (), (), (), reference))


def _near(own: Solution, known: Mapping[str, sp.Expr]) -> list[AtReference]:
    """Return the reference configuration and configurations near it."""
    terms, members, size = own.reference.terms, own.mechanism.members, own.reference.size
    found = []
    for part in (0.0, *OFF_THE_REFERENCE):
        values = {}
        for name, value in known.items():
            (symbol,) = (s for s in value.free_symbols if not terms.is_constant(s))
            step = part * (size if is_length(members[name]) else 1.0)
            values[symbol] = own.reference.of(symbol) + step / float(terms.value(value / symbol))
        found.append(AtReference(terms, values, {}, size=size))
    return found


def _solved(loops: Loops, begun: Solution, branch: Branch | None = None) -> Solution:
    """Return the solution on a branch.

    If ``branch`` is None, the returned solution is on the branch of the reference.
    """
    solution = begun
    try:
        while True:
            before = solution
            for linkage in _left(loops, solution):
                terms, reference = begun.reference.terms, begun.reference
                part = assemble(terms, linkage, solution.values, reference, branch)
                solution = _with_part(solution, part)
            planar, solution = solution, _in_space(loops, solution, branch)
            if not _goes_on(loops, before, planar, solution):
                return solution
    except DescriptionError as error:
        raise type(error)(f"robot {loops.mechanism.name!r}: {error}") from error


def _goes_on(loops: Loops, before: Solution, planar: Solution, after: Solution) -> bool:
    """Whether another pass through the solution steps can solve more joints.

    Through a coupling, a joint that is solved in one loop may determine a joint of another loop.
    """
    if loops.mechanism.couplings:
        return bool(after.open) and after.open != before.open
    return after.open != planar.open and bool(_left(loops, after))


def _left(loops: Loops, solution: Solution) -> list[Linkage]:
    """Return the planar linkages with unknown joints."""
    return [
        linkage
        for linkage in loops.planar
        if any(e.name not in solution.values for e in linkage.edges if not isinstance(e, WeldEdge))
    ]


def every_solution(
    loops: Loops, own: Solution, given: Sequence[str], most: int
) -> tuple[list[Solution], bool]:
    """Return the solutions on all branches.

    Args:
        loops: The mechanism and its loops.
        own: The solution on the branch of the reference.
        given: Names of the joints and cylinders with initial values.
        most: Maximum number of solutions.

    Returns:
        The list of solutions, and whether this list contains all solutions.
    """
    known = {name: own.values[name] for name in given}
    # Dependent joints cannot move one by one, so they give no test configurations.
    is_free = len(given) <= len(own.mechanism.coordinates)
    elsewhere = _near(own, known) if is_free else ()
    found, is_all = [_restarted(own, known)], True
    while True:
        before = found
        found, is_whole = _on_planar_branches(loops, found, elsewhere, most)
        planar, spatial = found, list[Solution]()
        for solution in planar:
            in_space = partial(_in_space, loops, solution)
            spatial += islice(every_branch(in_space, own.reference.sides), most + 1)
        found, is_all = spatial[:most], is_all and is_whole and len(spatial) <= most
        if not found or not _goes_on(loops, before[0], planar[0], found[0]):
            return found, is_all


def _restarted(own: Solution, known: Mapping[str, sp.Expr]) -> Solution:
    return _with_open(
        replace(own, values=known, loops={}, steps=(), relations=(), coupled=(), open=())
    )


def with_free_sides(
    loops: Loops, own: Solution, given: Sequence[str], sign: Callable[[], sp.Expr]
) -> Solution:
    """Return a solution in which each branch sign is a symbol.

    If all these symbols are 1, the solution is on the branch of the reference configuration.

    Args:
        loops: The mechanism and its loops.
        own: The solution on the branch of the reference.
        given: Names of the joints and cylinders with initial values.
        sign: Function that returns a new symbol for a branch sign.
    """
    known = {name: own.values[name] for name in given}
    sides = FreeSides(own.reference.sides, own.reference, sign)
    return _solved(loops, _restarted(own, known), sides)


def _on_planar_branches(
    loops: Loops, found: list[Solution], elsewhere: Sequence[AtReference], most: int
) -> tuple[list[Solution], bool]:
    """Return solutions of the planar linkages, and whether all solutions were found."""
    is_all = True
    for linkage in _left(loops, found[0]):
        # Linkages without a common joint are independent. Each independent linkage is solved once,
        # and not once for each branch of the other linkages.
        parts: dict[tuple[sp.Expr | None, ...], list[Assembly]] = {}
        after = []
        for solution in found:
            shared = tuple(solution.values.get(edge.name) for edge in linkage.edges)
            if shared not in parts:
                known, reference = solution.values, solution.reference
                found_here = assemblies(reference.terms, linkage, known, reference, elsewhere)
                parts[shared] = [*found_here]
            after += [_with_part(solution, part) for part in parts[shared]]
        found, is_all = after[:most], is_all and len(after) <= most
    return found, is_all


def _with_part(solution: Solution, part: Assembly) -> Solution:
    """Add the joint values of a planar linkage to a solution."""
    return _with_open(
        replace(
            solution,
            values={**part.values, **solution.values},
            loops=solution.loops | dict(part.loops),
            steps=(*solution.steps, *part.steps),
            relations=(*solution.relations, *part.relations),
        )
    )


def _in_space(loops: Loops, solution: Solution, branch: Branch | None) -> Solution:
    """Extend a solution by the joint values that the spatial loops determine."""
    known = Known(dict(solution.values), dict(solution.loops), list(solution.steps))
    terms, reference = solution.reference.terms, solution.reference
    assemble_in_space(
        *(terms, loops.mechanism, loops.spatial, known, reference, branch, loops.last_step)
    )
    return _with_open(
        replace(solution, values=known.values, loops=known.loops, steps=tuple(known.steps))
    )


def _with_open(solution: Solution) -> Solution:
    """Add the joint values that follow from couplings, and the names of the undetermined joints."""
    solution = with_coupled(solution)
    wanted = [*solution.mechanism.members, *solution.mechanism.swings]
    return replace(solution, open=tuple(name for name in wanted if name not in solution.values))


def with_coupled(solution: Solution) -> Solution:
    """Solve each coupling that has a single unknown joint, and add the joint value."""
    values, loops, coupled = dict(solution.values), dict(solution.loops), [*solution.coupled]
    own = replace(solution, loops=loops)
    left = [*solution.mechanism.couplings]
    while True:
        unknown = {c: [name for name in factors_of(c) if name not in values] for c in left}
        ready = next((c for c in left if len(unknown[c]) == 1), None)
        if ready is None:
            return replace(own, values=values, coupled=tuple(coupled))
        left.remove(ready)
        (name,) = unknown[ready]
        factors = factors_of(ready)
        known = (factor * reported(own, values, n) for n, factor in factors.items() if n != name)
        values[name] = sp.expand((ready.offset - sp.Add(*known)) / factors[name])
        coupled.append(name)


def factors_of(coupling: Coupling) -> dict[str, sp.Expr]:
    """Return the factor of each joint in the equation of a coupling."""
    return {coupling.joint: sp.S.One} | {name: -ratio for name, ratio in coupling.ratios}


def reported(solution: Solution, values: Mapping[str, sp.Expr], name: str) -> sp.Expr:
    """Return the value of a joint in a coupling, wrapped in the same way as in `configuration`."""
    member = solution.mechanism.members[name]
    if name in solution.coupled or is_length(member) or not isinstance(member, Joint):
        return values[name]
    return joint_angle(solution.reference.terms, solution, values[name], member)


def joint_angle(terms: Terms, solution: Solution, value: sp.Expr, joint: Joint | None) -> sp.Expr:
    """Wrap a solved angle into an interval of one full turn about the middle of the joint limits.

    For a joint without limits, the angle interval is -pi to pi. If the magnitude of the reference
    value exceeds pi, the interval is centered at the multiple of pi nearest to the reference value.
    With this center, joint angles near the reference do not jump. For a coupled joint, the interval
    contains the joint limits. The angle interval of a coupled joint without limits is centered at
    the multiple of 90 degrees nearest to the reference value.

    Args:
        terms: Receives the terms.
        solution: The solution that contains the angle ``value``. The rate of the wrapped angle is
            added to the rates of the solution.
        value: The angle to wrap, as a sum of solved angles and coordinates.
        joint: The joint with the angle ``value``, or None for a swing angle.
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


def near_reference(
    mechanism: Mechanism, terms: Terms, joints: Sequence[Joint], values: Sequence[sp.Expr]
) -> list[sp.Expr]:
    """Move solved angles of coupled joints by full turns into the interval of each joint.

    The interval of each joint is one full turn wide, and contains the joint limits or the reference
    value.

    Args:
        mechanism: The description.
        terms: Receives the terms.
        joints: The joints.
        values: The value of each joint (radian or meter).
    """
    found = list(values)
    for k, (joint, value) in enumerate(zip(joints, values, strict=True)):
        middle = _middle(mechanism, joint)
        if joint.name in mechanism.coupled and middle != 0 and terms.is_solved(value):
            angle = terms.solved_angle(*terms.cos_sin(sp.expand(value - middle)))
            found[k] = terms.let(angle + middle)
    return found


def _middle(mechanism: Mechanism, joint: Joint | None) -> sp.Expr:
    if joint is None:
        return sp.Integer(0)
    low, high = joint.limits
    at = float(mechanism.reference_of(joint.name))
    if joint.name in mechanism.coupled:
        # In a coupling, the value of the driven joint depends on the full turns of the other
        # joints.
        if low is None or high is None or high - low > 2 * sp.pi or not low <= at <= high:
            return _quarter_turns(at)
        middle = _quarter_turns(float(low + high) / 2)
        is_inside = middle - sp.pi <= low and high <= middle + sp.pi
        return middle if is_inside else (low + high) / 2
    if low is None or high is None:
        half_turns = at / math.pi
        return sp.pi * round(half_turns) if abs(half_turns) > 1 else sp.Integer(0)
    if low >= -sp.pi and high <= sp.pi:
        return sp.Integer(0)
    return (low + high) / 2


def _quarter_turns(angle: float) -> sp.Expr:
    """Round an angle to a multiple of 90 degrees."""
    return sp.pi / 2 * round(2 * angle / math.pi)


def _given(mechanism: Mechanism) -> dict[str, float]:
    return {name: float(value) for name, value in mechanism.reference}


def _value_of(mechanism: Mechanism, name: str, moves: str, ratio: sp.Expr) -> float:
    """Return the reference value of a coordinate.

    The robot file states the value of the coordinate, or the value of the joint that the coordinate
    moves. If the robot file states neither value, the reference value of the coordinate is 0.
    """
    given = dict(mechanism.reference)
    if name not in given and moves in given:
        values = {parameter.symbol: parameter.value for parameter in mechanism.parameters}
        return float(given[moves] / ratio.xreplace(values))
    return float(given.get(name, 0))
