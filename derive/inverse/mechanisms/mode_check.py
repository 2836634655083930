"""Inverse kinematics of robots whose loops are solved by iteration.

The function ``fk`` checks every inverse kinematics solution.

The function ``ik_legs`` finds actuated coordinates at which the loops can be closed at the target
pose. At the same actuated coordinates, the loops may have several assembly modes, of which ``fk``
selects the reference mode. Therefore, the function ``ik`` calls ``fk`` for every solution slot of
``ik_legs``. A solution slot contains a solution if ``fk`` returns the target pose. If ``fk``
returns a different pose, the target pose belongs to an assembly mode other than the reference mode.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from ...loops.functions.maps import Maker
from ...loops.iterated.closure_equations import LoopClosure
from ...loops.iterated.iteration import STEPS, SYSTEM
from ...loops.modes.platforms import WrittenMaker
from ...loops.solve.solved_loops import SolvedLoops
from ...terms.symbolic_function import NativeSolverFunction, SymbolicFunction, Tables
from .carried_arm import ARM, CarriedArm, carried_arm
from .carried_wrist import PLATFORM, CarriedWrist, carried_wrist

IK, LEGS, FK = "ik", "ik_legs", "fk"
SOLVER = "closure_modes"
REFERENCE_DIGITS = 9
"""Number of decimal places of the rounded reference angles. Rounding makes the reference angles the
same on all machines."""
IDENTITY = (
    "fk(q[k]) = T if residual[k] is a rounding error; if residual[k] is infinite and q[k] is not "
    "NaN, the loops close with q[k] at T, but in another assembly mode than at fk(q[k])"
)


def with_legs(
    makers: Mapping[str, Maker], closure: LoopClosure
) -> tuple[dict[str, Maker], dict[str, WrittenMaker]]:
    """Add the function ``ik``, which checks the solutions of the function ``ik_legs``.

    Args:
        makers: Functions that derive the robot functions, keyed by name. The function with the key
            ``ik``, if present, derives ``ik_legs``.
        closure: The closure equations of the loops.
    """
    if IK not in makers:
        return dict(makers), {}
    # The derived function ``ik_legs`` is cached, because ``ik`` needs the number of its solution
    # slots before the C code is printed.
    solved = cache(makers[IK])
    named = {
        LEGS if name == IK else name: (lambda h: _on_legs(solved(h))) if name == IK else maker
        for name, maker in makers.items()
    }
    return named, {IK: lambda h: _checked(closure, solved(h))}


def _on_legs(function: SymbolicFunction) -> SymbolicFunction:
    q, residual, margin = function.outputs
    meaning = "closure errors of the loops, and distance of the main chain's tool from the target"
    return replace(
        function,
        name=LEGS,
        summary="Coordinates with which the loops close at a pose, in any assembly mode.",
        outputs=(q, replace(residual, meaning=meaning), margin),
        role=replace(function.role, name="nominal inverse", labels=()),
    )


@dataclass(frozen=True)
class ModeTables(Tables):
    """Tables for the test whether an inverse kinematics solution is in the reference mode.

    Attributes:
        size: The length of the mechanism (meter), which scales the length tolerances.
        angles: (n,) reference angles (radian) of the actuated coordinates. A reference angle is NaN
            if the coordinate is not revolute or moves its joint with a ratio other than 1.
    """

    size: float
    angles: tuple[float, ...] = ()


def _checked(closure: LoopClosure, legs: SymbolicFunction) -> NativeSolverFunction:
    q, residual, margin = (replace(result, entries=()) for result in legs.outputs)
    slots = legs.branches
    checked = NativeSolverFunction(
        IK,
        f"All inverse kinematics solutions, in {slots} solution slots.",
        IDENTITY,
        legs.inputs,
        (
            q,
            replace(
                residual,
                meaning="distance of fk(q[k]) from the target; infinite in another assembly mode",
            ),
            margin,
        ),
        SOLVER,
        ModeTables(closure.size, _reference_angles(closure.hybrid)),
        (LEGS, FK),
        slots,
        SYSTEM * STEPS * slots,
        role=legs.role,
    )
    carried = carried_chain(closure.hybrid, legs)
    if carried is None:
        return checked
    count = carried.solutions * slots
    h = closure.hybrid
    return replace(
        checked,
        summary=f"All inverse kinematics solutions, in {count} solution slots.",
        inputs=(legs.inputs[0], *carried.arguments()),
        outputs=tuple(replace(r, shape=(count, *r.shape[1:])) for r in checked.outputs),
        solver=carried.solver,
        tables=carried.tables(slots, q.shape[1], closure.size),
        branches=count,
        operations=carried.solutions * checked.operations,
        role=replace(
            legs.role,
            labels=_by_solution(carried, legs.role.labels),
            fixed=tuple(sorted(coordinates_of(h, carried.given))),
        ),
    )


def _reference_angles(h: SolvedLoops) -> tuple[float, ...]:
    return tuple(
        round(h.at_reference[c.moves], REFERENCE_DIGITS)
        if c.kind == "revolute" and c.ratio == 1
        else math.nan
        for c in h.mechanism.coordinates
    )


def carried_chain(h: SolvedLoops, legs: SymbolicFunction) -> CarriedWrist | CarriedArm | None:
    """Return the main chain, or None if no joints are before or on the platform."""
    names = {argument.name for argument in legs.inputs}
    if PLATFORM in legs.inputs:
        return carried_wrist(h)
    return carried_arm(h) if ARM in names else None


def coordinates_of(h: SolvedLoops, joints: Sequence[int]) -> list[int]:
    """Return the indices of the actuated coordinates that move the given main-chain joints."""
    moves = [c.moves for c in h.mechanism.coordinates]
    return [moves.index(h.robot.moving[k].name) for k in joints]


def _by_solution(carried: CarriedWrist | CarriedArm, labels: Sequence[str]) -> tuple[str, ...]:
    """Return the label of each solution slot."""
    return tuple(
        ", ".join(filter(None, (f"{carried.label} {k + 1}", label)))
        for k in range(carried.solutions)
        for label in labels
    )
