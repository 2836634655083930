"""The inverse of an arm that nearly has a structure: its nominal arm's, led to the true arm.

The inverse of the nominal arm is the function ``ik_nominal``; ``ik`` starts from its branches and
ends on the true arm, by ``chasles_polish.h``.
"""

from dataclasses import replace

from ..model.tolerances import ASKED_MOVE, ASKED_SEPARATION, NEARLY_STRUCTURE
from ..terms.symbolic_function import SymbolicFunction, Table, WrittenFunction
from .classify import Classification
from .general.general_inverse import GeneralTables
from .structure.lines import Lines
from .tasks.task import Solved

SOLVER = "polish"
NOMINAL = "ik_nominal"
CALLS = (NOMINAL, "fk_jacobian_mixed")
OPERATIONS = 1500
"""Approximate count for a branch: three or four times pose and Jacobian, and as many steps."""
FURTHER = 4
"""Slots for further solutions, where no more are known: arms of 8 branches had 10 solutions."""
MOST = 16
"""Solutions that six joints may have."""
FREEDOMS = 6
TURN = 6.283185307179586


def as_start(nominal: Solved) -> Solved:
    """The task ``ik`` of a nominal arm under a name of its own."""
    function = nominal.function
    residual, margin = function.outputs[1:]
    outputs = (
        function.outputs[0],
        replace(residual, meaning="distance of the nominal arm's tool from the target"),
        replace(margin, meaning="distance from the nominal arm's boundary, negative beyond"),
    )
    start = replace(
        function,
        name=NOMINAL,
        summary="The inverse kinematics of the nominal arm, where the iteration of ik starts.",
        identity="q[k] solves the nominal arm wherever residual[k] is rounding, not the true arm",
        outputs=outputs,
        role=replace(function.role, name="nominal inverse", labels=()),
    )
    return replace(nominal, function=start)


def polished_inverse(
    classification: Classification, nominal: SymbolicFunction, general: GeneralTables, move: float
) -> WrittenFunction:
    """The function ``ik`` of an arm that nearly has a structure.

    Args:
        classification: The structure, and how far the axes are from it.
        nominal: The task ``ik`` of the nominal arm.
        general: The arm as a general one, which is asked where branches are unsure. If it is good,
            it is asked at every pose of two kinds of arms: where joints are given, whose values
            make an arm singular in more ways than folds, and where the two arms differ much.
        move: Median move (radian) of the joints from a nominal solution to its true one.
    """
    lines, found = classification.lines, classification.found
    deviation = 0.0 if found is None else found.deviation
    turns = tuple(1.0 / TURN if axis.turns else 0.0 for axis in lines.axes)
    further = FURTHER if len(turns) >= FREEDOMS else 0
    if general.tables:
        further = max(further, MOST - nominal.branches)
    is_unsure = bool(nominal.role.given) or move > ASKED_MOVE
    is_asked = is_unsure and general.separation > ASKED_SEPARATION
    meets = nearly_meet(lines)
    length = lines.length or 1.0
    return led_from(
        nominal, turns, length, deviation, general.tables, further, meets=meets, is_asked=is_asked
    )


def nearly_meet(lines: Lines) -> bool:
    """Whether three neighbouring axes nearly meet in one point, as those of a wrist do."""
    triples = [tuple(range(k, k + 3)) for k in range(len(lines.axes) - 2)]
    turning = [triple for triple in triples if all(lines.axes[k].turns for k in triple)]
    return any(lines.meeting_deviation(triple) <= NEARLY_STRUCTURE for triple in turning)


def led_from(
    nominal: SymbolicFunction,
    turns: tuple[float, ...],
    length: float,
    deviation: float,
    general: tuple[Table, ...] = (),
    further: int = 0,
    *,
    meets: bool = False,
    is_asked: bool = False,
) -> WrittenFunction:
    """The function ``ik`` of a robot that is led from a nominal one.

    Its slots are those of the nominal robot, and some behind them for solutions that the true one
    has near singularities beyond the nominal one's number; NaN where there is none.

    Args:
        nominal: The task ``ik`` of the nominal robot.
        turns: Turns in a unit of each coordinate, 0 where it does not turn.
        length: The robot's length (metre), which compares lengths with angles.
        deviation: Between both robots: radian, parts of the length.
        general: The tables by which the robot is solved as a general one, if there are any.
        further: Number of slots for further solutions.
        meets: Whether three neighbouring axes nearly meet in one point.
        is_asked: Whether the general solver is asked at every pose.
    """
    q, residual, margin = nominal.outputs
    n = q.shape[-1]
    slots = nominal.branches + further
    labels = tuple(f"further {k + 1}" for k in range(further))
    is_free = tuple(0.0 if k in nominal.role.given else 1.0 for k in range(n))
    return WrittenFunction(
        nominal.name,
        f"Every solution of the inverse kinematics, in {slots} slots.",
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
        (is_free, turns, length, deviation, float(meets), float(is_asked), general),
        CALLS,
        slots,
        OPERATIONS * nominal.branches,
        role=replace(nominal.role, labels=(*nominal.role.labels, *labels)),
    )
