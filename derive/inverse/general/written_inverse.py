"""The inverse of a general arm: the function ``ik``, solved over the arm's placements."""

from collections.abc import Sequence

from ...chain.kinematics import arguments_of, common_unit
from ...model.robot import SerialRobot
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Result, Table, WrittenFunction
from ..chain_solution import given_argument
from ..tasks.slots import pose_argument
from .line_quantities import Array
from .raghavan_roth import JOINTS
from .split_choice import MOST_JOINTS, Choice, length, slides_of

FIVE, SIX = "general_tool", "general"
"""The solvers of arms of which five joints are solved for, and six."""
SLOTS = 16
SOLVED_TURN, GIVEN_TURN, GIVEN_SLIDE, SOLVED_SLIDE = 0, 1, 2, 3
"""The kinds of joints in the tables of the C."""
OPERATIONS = 60_000
"""Approximate count: 12,000 for the equations, 20,000 for the samples of the determinant, 10,000
for its roots, and 18,000 for the other joints and Newton's steps."""
CALLS = ("fk_jacobian_mixed",)


def inverse(robot: SerialRobot, choice: Choice, constants: Sequence[Array]) -> WrittenFunction:
    """The function ``ik``: every solution of a pose, in sixteen slots.

    Solutions come first, in the order of the suppressed joint; the other slots hold the nearest
    answer where there is no solution, and a configuration that is none elsewhere. The margin of a
    solution is |det J| over the product of the lengths of J's columns, with metres in parts of the
    arm's length: 0 where J is singular and two solutions meet, at most 1. The margin of another
    slot is its negative residual.

    Args:
        robot: The description.
        choice: The orders of the joints in the equations.
        constants: The placements of its joints, with the joint that turns the tool behind five.
    """
    n, given = len(robot.coordinates), choice.given
    unit = common_unit(joint.unit for joint in robot.coordinates)
    outputs = (
        Result("q", (), (SLOTS, n), unit, "joint coordinates, one solution a row"),
        Result("residual", (), (SLOTS,), "m or rad", "distance of fk(q[k]) from the target"),
        Result(
            "margin",
            (),
            (SLOTS,),
            "1",
            "distance from a singularity; in a slot without a solution the negative residual",
        ),
    )
    free = [joint for k, joint in enumerate(robot.moving) if k not in given]
    suppressed = free[choice.splits[0].joints[2]].name
    labels = tuple(f"number {k + 1} in the order of {suppressed}" for k in range(SLOTS))
    return WrittenFunction(
        "ik",
        f"Every solution of the inverse kinematics, in {SLOTS} slots, solutions first.",
        "fk(q[k]) = T wherever residual[k] is rounding",
        (pose_argument(robot), *_given(robot, given)),
        outputs,
        SIX if n - len(given) == JOINTS else FIVE,
        tables(robot, choice, constants),
        CALLS,
        SLOTS,
        OPERATIONS,
        role=Role("inverse", "pose", given=given, labels=labels),
    )


def _given(robot: SerialRobot, given: tuple[int, ...]) -> tuple[Argument, ...]:
    symbols = arguments_of([joint.unit for joint in robot.coordinates])["q"].symbols
    return tuple(given_argument(robot, k, symbols[k]) for k in given)


def tables(robot: SerialRobot, choice: Choice, constants: Sequence[Array]) -> tuple[Table, ...]:
    """The fields of ``chasles_general_arm`` behind the functions that it calls."""
    nothing = (0.0,) * 12
    placed = tuple(_row(E) for E in constants)
    unused = MOST_JOINTS + 1 - len(placed)
    directions = tuple(float(joint.direction) for joint in robot.moving)
    # The joint that turns the tool counts about its z axis.
    directions += (1.0,) * (len(placed) - 1 - len(directions))
    return (
        len(robot.moving),
        _kinds(robot, choice.given),
        directions + (0.0,) * unused,
        length(constants),
        placed + (nothing,) * unused,
        len(choice.splits),
        tuple((split.joints, split.sense, split.halved) for split in choice.splits),
    )


def _kinds(robot: SerialRobot, given: tuple[int, ...]) -> tuple[int, ...]:
    """What each joint is, with room for the most."""
    slides = slides_of(robot)
    turning, sliding = (SOLVED_TURN, GIVEN_TURN), (SOLVED_SLIDE, GIVEN_SLIDE)
    return tuple((sliding if k in slides else turning)[k in given] for k in range(MOST_JOINTS))


def _row(E: Array) -> tuple[float, ...]:
    """The first three rows of a placement."""
    return tuple(map(float, E[:3].flat))
