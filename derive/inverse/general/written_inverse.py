"""Inverse of a general arm: the function ``ik`` with hand-written C and tables of the arm."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...chain.kinematics import arguments_of, common_unit
from ...model.robot import SerialRobot
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Result, Tables, WrittenFunction
from ..chain_solution import given_argument
from ..tasks.slots import pose_argument
from .line_quantities import Array
from .raghavan_roth import JOINTS
from .split_choice import MAX_JOINTS, Choice, length, slides_of

FIVE, SIX = "general_tool", "general"
"""Names of the solvers for five and for six free joints."""
SLOTS = 16
SOLVED_TURN, GIVEN_TURN, GIVEN_SLIDE, SOLVED_SLIDE = 0, 1, 2, 3
"""Codes of the joint types in the C tables."""
OPERATIONS = 60_000
"""Approximate operation count: 12,000 for the equations, 20,000 for determinant samples, 10,000 for
the roots, and 18,000 for the other joints and Newton's method."""
CALLS = ("fk_jacobian_mixed",)


def inverse(robot: SerialRobot, choice: Choice, constants: Sequence[Array]) -> WrittenFunction:
    """Returns the function ``ik``: every solution of a pose, in sixteen slots.

    Solutions come first, sorted by the suppressed joint. Without a solution, the slots contain the
    nearest result; unused slots otherwise contain an invalid configuration. The margin of a
    solution is |det J| divided by the product of the column norms of J, with lengths relative to
    the arm length. The margin is 0 if J is singular and two solutions coincide, and at most 1. The
    margin of an invalid slot is its negative residual.

    Args:
        robot: The description.
        choice: The joint orders in the equations.
        constants: The constant placements of the joints, including the added joint of a five-joint
            arm.
    """
    n, given = len(robot.coordinates), choice.given
    unit = common_unit(joint.unit for joint in robot.coordinates)
    outputs = (
        Result("q", (), (SLOTS, n), unit, "joint coordinates, one solution per row"),
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
        GeneralArm.of(robot, choice, constants),
        CALLS,
        SLOTS,
        OPERATIONS,
        role=Role("inverse", "pose", given=given, labels=labels),
    )


def _given(robot: SerialRobot, given: tuple[int, ...]) -> tuple[Argument, ...]:
    symbols = arguments_of([joint.unit for joint in robot.coordinates])["q"].symbols
    return tuple(given_argument(robot, k, symbols[k]) for k in given)


@dataclass(frozen=True)
class GeneralArm(Tables):
    """The fields of ``chasles_general_arm`` after its function pointers.

    Attributes:
        joints: Number of joints of the robot.
        kinds: Type code of each joint.
        directions: 1 or -1 for each joint.
        length: The arm length (metre).
        placed: The rows of the constant placements of the joints and the tool.
        split_count: Number of the splits.
        splits: Joint order, sense and halved joint of each split.
    """

    joints: int
    kinds: tuple[int, ...]
    directions: tuple[float, ...]
    length: float
    placed: tuple[tuple[float, ...], ...]
    split_count: int
    splits: tuple[tuple[tuple[int, ...], int, int], ...]

    @classmethod
    def of(cls, robot: SerialRobot, choice: Choice, constants: Sequence[Array]) -> "GeneralArm":
        """Returns the numbers of an arm, padded to the maximum joint count."""
        placed = tuple(_row(E) for E in constants)
        unused = MAX_JOINTS + 1 - len(placed)
        directions = tuple(float(joint.direction) for joint in robot.moving)
        # The added tool joint rotates about its positive z axis.
        directions += (1.0,) * (len(placed) - 1 - len(directions))
        return cls(
            len(robot.moving),
            _kinds(robot, choice.given),
            directions + (0.0,) * unused,
            length(constants),
            placed + ((0.0,) * 12,) * unused,
            len(choice.splits),
            tuple((split.joints, split.sense, split.halved) for split in choice.splits),
        )


def _kinds(robot: SerialRobot, given: tuple[int, ...]) -> tuple[int, ...]:
    """Returns the type code of each joint, padded to the maximum joint count."""
    slides = slides_of(robot)
    turning, sliding = (SOLVED_TURN, GIVEN_TURN), (SOLVED_SLIDE, GIVEN_SLIDE)
    return tuple((sliding if k in slides else turning)[k in given] for k in range(MAX_JOINTS))


def _row(E: Array) -> tuple[float, ...]:
    """Returns the first three rows of a placement."""
    return tuple(map(float, E[:3].flat))
