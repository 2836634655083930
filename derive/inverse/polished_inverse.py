"""Inverse kinematics of arms whose axes nearly fit a known closed-form family.

Newton's method refines the inverse solutions of a nominal arm that fits the family exactly.

The function ``ik_nominal`` returns the inverse solutions of the nominal arm. The function ``ik``
starts Newton's method from the branches of ``ik_nominal`` (``chasles_polish.h``).
"""

from dataclasses import dataclass, replace

from ..model.tolerances import ASKED_MOVE, ASKED_SEPARATION, NEARLY_STRUCTURE
from ..terms.symbolic_function import NativeSolverFunction, SymbolicFunction, Tables
from .classify import Classification
from .general.general_inverse import GeneralArm, GeneralTables
from .structure.lines import Lines
from .tasks.task import Solved

SOLVER = "polish"
NOMINAL = "ik_nominal"
CALLS = (NOMINAL, "fk_jacobian_mixed")
OPERATIONS = 1500
"""Approximate number of operations of three or four Newton steps on one solution branch."""
FURTHER = 4
"""Number of solution slots in addition to the nominal solutions, for an arm without the general
solver.

Some calibrated arms had 10 solutions, although their nominal arms have only 8 solution branches.
"""
MAX = 16
"""Maximum number of solutions of a six-joint arm."""
FREEDOMS = 6
TURN = 6.283185307179586


def as_start(nominal: Solved) -> Solved:
    """Return the ``ik`` task of a nominal arm, renamed to ``ik_nominal``."""
    function = nominal.function
    residual, margin = function.outputs[1:]
    outputs = (
        function.outputs[0],
        replace(residual, meaning="distance of the nominal arm's tool from the target"),
        replace(
            margin,
            meaning="distance from the boundary of the nominal arm's workspace, negative outside",
        ),
    )
    start = replace(
        function,
        name=NOMINAL,
        summary="The inverse kinematics of the nominal arm, where the iteration of ik starts.",
        identity="q[k] solves the nominal (not the true) arm if residual[k] is a rounding error",
        outputs=outputs,
        role=replace(function.role, name="nominal inverse", labels=()),
    )
    return replace(nominal, function=start)


def polished_inverse(
    classification: Classification, nominal: SymbolicFunction, general: GeneralTables, move: float
) -> NativeSolverFunction:
    """Return ``ik`` for an arm whose axes are close to a known closed-form family.

    Args:
        classification: The family of the nominal arm, and the deviation of the actual arm's axes
            from this family.
        nominal: The inverse kinematics function ``ik`` of the nominal arm.
        general: Tables of the general solver. This solver normally runs only to find the solutions
            of uncertain branches. A well-conditioned general solver runs at every pose if the arm
            has fixed joints or differs much from its nominal arm. Fixed joints complicate the
            singularities of the arm.
        move: Median joint displacement (radian) from a nominal solution to the refined solution.
    """
    lines, found = classification.lines, classification.found
    deviation = 0.0 if found is None else found.deviation
    turns = tuple(1.0 / TURN if axis.turns else 0.0 for axis in lines.axes)
    further = FURTHER if len(turns) >= FREEDOMS else 0
    if general.arm:
        further = max(further, MAX - nominal.branches)
    is_unsure = bool(nominal.role.fixed) or move > ASKED_MOVE
    is_asked = is_unsure and general.separation > ASKED_SEPARATION
    meets = nearly_meet(lines)
    length = lines.length or 1.0
    tables = RefinedTables(turns, length, deviation, general.arm, meets, is_asked)
    return refined_inverse(nominal, tables, further)


def nearly_meet(lines: Lines) -> bool:
    """Whether three consecutive revolute axes nearly intersect in one point, as in a wrist."""
    triples = [tuple(range(k, k + 3)) for k in range(len(lines.axes) - 2)]
    turning = [triple for triple in triples if all(lines.axes[k].turns for k in triple)]
    return any(lines.meeting_deviation(triple) <= NEARLY_STRUCTURE for triple in turning)


@dataclass(frozen=True)
class RefinedTables(Tables):
    """Numeric data of a robot whose inverse kinematics refines solutions of a nominal robot.

    Attributes:
        turns: Number of full turns per unit of each coordinate, which is 0 for prismatic joints.
        length: Robot length (meter), by which distances are divided to compare them with angles.
        deviation: Deviation of the robot from its nominal robot, as an angle (radian) or a distance
            divided by the robot length.
        general: Tables for the general solver, or None if the general solver does not apply.
        meets: Whether three consecutive axes nearly intersect in one point.
        is_asked: Whether the general solver runs at every pose.
        is_searched: Whether to search for more solutions near uncertain branches.
    """

    turns: tuple[float, ...]
    length: float
    deviation: float
    general: GeneralArm | None = None
    meets: bool = False
    is_asked: bool = False
    is_searched: bool = True


def refined_inverse(
    nominal: SymbolicFunction, tables: RefinedTables, further: int = 0
) -> NativeSolverFunction:
    """Return the function ``ik``, which refines the solutions of a nominal robot.

    The first solution slots contain the refined solutions of the nominal robot. The extra solution
    slots contain solutions that only the actual robot has, near singularities. Unused solution
    slots contain NaN.

    Args:
        nominal: The inverse kinematics function ``ik`` of the nominal robot.
        tables: Numeric data of the actual robot.
        further: Number of extra solution slots.
    """
    q, residual, margin = nominal.outputs
    n = q.shape[-1]
    slots = nominal.branches + further
    labels = tuple(f"further {k + 1}" for k in range(further))
    return NativeSolverFunction(
        nominal.name,
        f"All inverse kinematics solutions, in {slots} solution slots.",
        nominal.identity,
        nominal.inputs,
        (
            replace(q, entries=(), shape=(slots, n)),
            replace(residual, entries=(), shape=(slots,)),
            replace(
                margin,
                entries=(),
                shape=(slots,),
                meaning="distance from the boundary of the nominal arm's reachable set",
            ),
        ),
        SOLVER,
        tables,
        CALLS,
        slots,
        OPERATIONS * nominal.branches,
        role=replace(nominal.role, labels=(*nominal.role.labels, *labels)),
    )
