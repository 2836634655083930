"""Inverse of a robot whose loops are solved by iteration.

The function ``fk`` checks every solution.

The leg inverse finds coordinates at which the loops can be closed at the target pose. At these
coordinates, the loops may have several assembly modes. The function ``fk`` selects the reference
mode. Therefore, ``ik`` calls ``fk`` for every solution slot of ``ik_legs``. A slot contains a
solution if ``fk`` returns the target pose. Otherwise, the coordinates belong to another assembly
mode.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from ...loops.functions.maps import Maker
from ...loops.iterated.closure_equations import LoopClosure
from ...loops.iterated.iteration import STEPS, SYSTEM
from ...loops.modes.platforms import WrittenMaker
from ...terms.symbolic_function import NativeSolverFunction, SymbolicFunction, Tables
from .carried_wrist import PLATFORM, ROTATIONS, carried_wrist
from .carried_wrist import SOLVER as CARRIED

IK, LEGS, FK = "ik", "ik_legs", "fk"
SOLVER = "closure_modes"
IDENTITY = (
    "fk(q[k]) = T wherever residual[k] is rounding; the loops close with q[k] at T in another "
    "assembly mode than that of fk(q[k]) wherever residual[k] is infinite and q[k] is not NaN"
)


def with_legs(
    makers: Mapping[str, Maker], closure: LoopClosure
) -> tuple[dict[str, Maker], dict[str, WrittenMaker]]:
    """Adds the function ``ik``, which checks the results of the leg inverse ``ik_legs``.

    Args:
        makers: Functions that derive the robot functions, keyed by name. The function under the key
            ``ik``, if present, derives the leg inverse.
        closure: The closure equations of the loops.
    """
    if IK not in makers:
        return dict(makers), {}
    # Cached, because ``ik`` needs the number of solution slots before its C code is printed.
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
class ClosureSize(Tables):
    """The length of the mechanism (meter), which scales the length tolerances."""

    size: float


def _checked(closure: LoopClosure, legs: SymbolicFunction) -> NativeSolverFunction:
    q, residual, margin = (replace(result, entries=()) for result in legs.outputs)
    slots = legs.branches
    checked = NativeSolverFunction(
        IK,
        f"Every solution of the inverse kinematics, in {slots} slots.",
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
        ClosureSize(closure.size),
        (LEGS, FK),
        slots,
        SYSTEM * STEPS * slots,
        role=legs.role,
    )
    carried = carried_wrist(closure.hybrid) if PLATFORM in legs.inputs else None
    if carried is None:
        return checked
    count = ROTATIONS * slots
    return replace(
        checked,
        summary=f"Every solution of the inverse kinematics, in {count} slots.",
        inputs=legs.inputs[:1],
        outputs=tuple(replace(r, shape=(count, *r.shape[1:])) for r in checked.outputs),
        solver=CARRIED,
        tables=carried.tables(slots, q.shape[1], closure.size),
        branches=count,
        operations=ROTATIONS * checked.operations,
        role=replace(legs.role, labels=_by_rotation(legs.role.labels)),
    )


def _by_rotation(labels: Sequence[str]) -> tuple[str, ...]:
    """Returns the label of each solution slot of a wrist on a platform."""
    return tuple(
        ", ".join(filter(None, (f"platform rotation {k + 1}", label)))
        for k in range(ROTATIONS)
        for label in labels
    )
