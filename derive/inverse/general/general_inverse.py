"""Inverse kinematics ``ik`` of general arms, whose axes fit no known arm family.

The general solver is handwritten C code that reads numeric tables of the arm.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...chain.kinematics import arguments_of, common_unit
from ...model.robot import SerialRobot
from ...terms.role import Role
from ...terms.symbolic_function import Argument, NativeSolverFunction, Result, Tables
from ..structure.lines import TOOL_AXIS
from ..structure.words import listed
from ..tasks.slots import given_argument, pose_argument
from .elimination_choice import MAX_JOINTS, Choice, choice_at, choose, length, slides_of
from .line_quantities import Array
from .raghavan_roth import JOINTS, is_fit, numbers

FIVE, SIX = "general_tool", "general"
"""Names of the C solvers for arms with five and with six free joints."""
SLOTS = 16
SOLVED_TURN, GIVEN_TURN, GIVEN_SLIDE, SOLVED_SLIDE = 0, 1, 2, 3
"""Codes of the joint types in the C tables."""
OPERATIONS = 60_000
"""Approximate number of operations of the general solver. The general solver needs 12,000
operations for the equations, 20,000 for the determinants, 10,000 for the roots, and 18,000 for the
other joints with Newton's method."""
CALLS = ("fk_jacobian_mixed",)


@dataclass(frozen=True)
class GeneralArm(Tables):
    """Data fields of the C struct ``chasles_general_arm``, which come after its function pointers.

    Attributes:
        joints: Number of joints of the robot.
        kinds: Type code of each joint.
        directions: Direction of each joint, 1 or -1.
        length: The arm length (meter).
        placed: The first three rows of each constant transform: before the first joint, between
            adjacent joints, and after the last joint.
        order_count: Number of elimination orders.
        orders: The elimination orders as tuples (joint indices, sense of numbering 1 or -1, 0 or 1
            for the half angle of joint 4 or 5).
    """

    joints: int
    kinds: tuple[int, ...]
    directions: tuple[float, ...]
    length: float
    placed: tuple[tuple[float, ...], ...]
    order_count: int
    orders: tuple[tuple[tuple[int, ...], int, int], ...]

    @classmethod
    def of(cls, robot: SerialRobot, choice: Choice, constants: Sequence[Array]) -> "GeneralArm":
        """Return the data of an arm for the C solver."""
        placed = tuple(_row(E) for E in constants)
        unused = MAX_JOINTS + 1 - len(placed)
        directions = tuple(float(joint.direction) for joint in robot.moving)
        # The joint that is added to a five-joint arm rotates about its positive z axis.
        directions += (1.0,) * (len(placed) - 1 - len(directions))
        return cls(
            len(robot.moving),
            _kinds(robot, choice.given),
            directions + (0.0,) * unused,
            length(constants),
            placed + ((0.0,) * 12,) * unused,
            len(choice.orders),
            tuple((order.joints, order.sense, order.halved) for order in choice.orders),
        )


OWN = JOINTS - 1
"""Number of joints of a five-joint arm, without the sixth joint that the solver adds."""
TOOL_AXES = (((0.36, 0.48, 0.8), (0.4, -0.3, 0.0)), ((-0.8, 0.36, 0.48), (0.0, 0.4, 0.3)))
"""Candidates for the axis of the joint that is added to a five-joint arm. Each candidate axis has a
direction and a point in the tool frame.

The point coordinates of each candidate axis are divided by the arm length.
"""
APART = (np.pi,) * OWN + (0.0,)
"""Assumed difference (radian) of each joint value between two solutions.

The assumed difference between two solutions is zero for the sixth joint that the solver adds to a
five-joint arm.
"""


@dataclass(frozen=True)
class WithTool:
    """A five-joint arm with a sixth joint added.

    Attributes:
        constants: The constant transforms before, between and after the six joints.
        choice: The elimination orders.
    """

    constants: tuple[Array, ...]
    choice: Choice


@dataclass(frozen=True)
class GeneralInverse:
    """The inverse kinematics of a general arm by elimination of joint variables.

    Attributes:
        title: Description of the arm, and the source of the method.
        method: Description of the solution method.
        choice: The selected elimination orders, and the selected joints to fix.
        function: The function ``ik``, which finds the roots of a determinant.
        steps: Descriptions of the numbered solution steps.
        given: Names of the fixed joints.
    """

    title: str
    method: str
    choice: Choice
    function: NativeSolverFunction
    steps: tuple[str, ...]
    given: tuple[str, ...] = ()


def general_inverse(robot: SerialRobot, give: tuple[int, ...] = ()) -> GeneralInverse | None:
    """Return the inverse kinematics by the general solver, or None if the solver does not apply.

    The solver requires an arm with at least five joints.

    Args:
        robot: The description.
        give: Indices of the joints to fix, which must leave five or six joints free. If ``give`` is
            empty, chasles selects the fixed joints.
    """
    if is_fit(robot, give, OWN):
        return _of_five(robot, give)
    if give and not _may_give(robot, give):
        return None
    choice = choice_at(numbers(robot), give, slides_of(robot)) if give else choose(robot)
    if choice is None:
        return None
    return GeneralInverse(
        f"an arm of {_joints(robot)} without a structure (Raghavan and Roth)",
        "by the roots of a determinant",
        choice,
        solver_function(robot, choice, numbers(robot)),
        _steps(robot, choice),
        tuple(robot.moving[k].name for k in choice.given),
    )


def _may_give(robot: SerialRobot, given: tuple[int, ...]) -> bool:
    return is_fit(robot, given) and len(robot.moving) <= MAX_JOINTS


def _joints(robot: SerialRobot) -> str:
    words = ("five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
    kind = "joints" if slides_of(robot) else "revolute joints"
    return f"{words[len(robot.moving) - OWN]} {kind}"


def _of_five(robot: SerialRobot, given: tuple[int, ...]) -> GeneralInverse | None:
    arm = with_tool_joint(numbers(robot), slides_of(robot), given)
    if arm is None:
        return None
    return GeneralInverse(
        f"an arm of {_joints(robot)} without a structure (Raghavan and Roth)",
        "by the roots of a determinant",
        arm.choice,
        solver_function(robot, arm.choice, arm.constants),
        _steps(robot, arm.choice),
        tuple(robot.moving[k].name for k in given),
    )


@dataclass(frozen=True)
class GeneralTables:
    """Tables for the C solver that finds all solutions of general arms.

    Attributes:
        arm: Numeric data of the arm, or None if the general solver does not apply.
        separation: How well the best elimination order separates the solutions, as defined in
            ``Choice.separation``.
    """

    arm: GeneralArm | None = None
    separation: float = 0.0


def general_tables(
    robot: SerialRobot, given: tuple[int, ...], apart: tuple[float, ...] = ()
) -> GeneralTables:
    """Return the tables of the general solver.

    The tables are empty if this solver does not apply.

    Args:
        robot: The description.
        given: Indices of the fixed joints, which must leave six joints free.
        apart: For each of the six joints, the typical difference (radian) between its values in two
            solutions of a pose, or () if unknown.
    """
    if not _may_give(robot, given):
        return GeneralTables()
    constants = numbers(robot)
    choice = choice_at(constants, given, slides_of(robot), apart)
    if choice is None:
        return GeneralTables()
    return GeneralTables(GeneralArm.of(robot, choice, constants), choice.separation)


def _steps(robot: SerialRobot, choice: Choice) -> tuple[str, ...]:
    slides = slides_of(robot)
    left = [k for k in range(len(robot.moving)) if k not in choice.given]
    free = [robot.moving[k].name for k in left] + [TOOL_AXIS] * (JOINTS - len(left))
    sliding = [robot.moving[k].name for k in left if k in slides]
    one, two, suppressed, v, w, last = (free[k] for k in choice.orders[0].joints)
    half, other = (w, v) if choice.orders[0].halved else (v, w)
    steps = (
        f"{last} does not move its own axis: fourteen quantities of this axis are linear in the "
        f"products of cosines and sines of {one} and {two}, and in the products for {v} and "
        f"{w}.{_squares(sliding)} Six combinations of the equations do not contain {one} and "
        f"{two}.",
        f"{suppressed}: with the half angle of {half}, these are twelve equations. Their "
        "determinant, a trigonometric polynomial of degree 8, is known from 24 samples; it has up "
        f"to 16 real roots{', and at most 8 of them are solutions' if len(sliding) > 1 else ''}.",
        f"{half}, {other}: from the null vector of the twelve equations. {one}, {two}: from the "
        "equations that contain them.",
        f"{last}: from the remaining rotation. Newton's method refines the result.",
        *_others(free, choice),
    )
    return (*_given(robot, choice.given, len(left)), *_tool_axis(free), *steps)


def _given(robot: SerialRobot, given: tuple[int, ...], left: int) -> tuple[str, ...]:
    if not given:
        return ()
    names = listed([robot.moving[k].name for k in given])
    verb, count = "is" if len(given) == 1 else "are", "six" if left == JOINTS else "five"
    return (f"{names} {verb} fixed, so {count} joints remain.",)


def _tool_axis(free: list[str]) -> tuple[str, ...]:
    if TOOL_AXIS not in free:
        return ()
    return (
        f"{TOOL_AXIS} is an added sixth joint that rotates the tool about an axis of the tool. "
        "Only solutions in which its angle is 0 are solutions of the five joints.",
    )


def _squares(sliding: list[str]) -> str:
    if not sliding:
        return ""
    is_one = len(sliding) == 1
    return (
        f" {listed(sliding)} {'is' if is_one else 'are'} prismatic: "
        f"{'its displacement and its' if is_one else 'a displacement and its'} square replace "
        "cosine and sine."
    )


def _others(free: list[str], choice: Choice) -> tuple[str, ...]:
    first, *others = (free[order.joints[2]] for order in choice.orders)
    names = [name for name in dict.fromkeys(others) if name != first]
    if not names:
        return ()
    return (
        f"If roots or solutions nearly coincide, the steps are repeated with {listed(names)} in "
        f"place of {first}.",
    )


def with_tool_joint(
    constants: Sequence[Array],
    slides: frozenset[int] = frozenset(),
    given: tuple[int, ...] = (),
) -> WithTool | None:
    """Add a sixth joint to a five-joint arm.

    Return None if no candidate axis of the sixth joint is suitable.

    The added sixth joint rotates the tool. Each solution of the five-joint arm is a solution of the
    six-joint arm with angle 6 at 0. Solutions of the six-joint arm with another angle 6 are
    discarded. The axis of the added sixth joint is skew to the other axes, so the six-joint arm
    fits no known arm family. The added axis does not pass through the tool origin.

    Args:
        constants: The constant transforms before, between and after the joints.
        slides: Indices of the prismatic joints.
        given: Indices of the fixed joints, which must leave five joints free.
    """
    found = []
    for direction, point in TOOL_AXES:
        axis = _placement(np.array(direction), length(constants) * np.array(point))
        arm = (*constants[:-1], constants[-1] @ axis, np.linalg.inv(axis))
        choice = choice_at(arm, given, slides, APART)
        if choice is None:
            continue
        # The added joint 6 cannot be the suppressed joint, because angle 6 is the same in all
        # solutions of a pose.
        kept = tuple(r for r in choice.ratings if r.order.joints[2] != OWN)
        if kept and (own := replace(choice, ratings=kept)).good > 0:
            found.append(WithTool(arm, own))
    return max(found, key=lambda arm: (arm.choice.good, arm.choice.ratings[0].key), default=None)


def _placement(z: Array, p: Array) -> Array:
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3] = np.column_stack([x, np.cross(z, x), z, p])
    return frame


def solver_function(
    robot: SerialRobot, choice: Choice, constants: Sequence[Array]
) -> NativeSolverFunction:
    """Return the function ``ik``, which finds every solution of a pose.

    The function ``ik`` has sixteen solution slots.

    Valid solutions fill the first solution slots and are sorted by the value of the suppressed
    joint. Unused solution slots contain an invalid configuration. If a pose has no solution, the
    slots contain the configurations with the smallest residuals. The margin of a solution is |det
    J| divided by the product of the column norms of the Jacobian J. Lengths in the Jacobian J are
    relative to the arm length. The margin of a solution is at most 1. If two solutions coincide,
    the Jacobian J is singular and the margin is 0. In a solution slot without a valid solution, the
    margin is the negative residual.

    Args:
        robot: The description.
        choice: The elimination orders of the joints.
        constants: Constant transforms before, between and after the joints, including the sixth
            joint that chasles adds to a five-joint arm.
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
            "distance from a singularity; the negative residual in a slot without a solution",
        ),
    )
    free = [joint for k, joint in enumerate(robot.moving) if k not in given]
    suppressed = free[choice.orders[0].joints[2]].name
    labels = tuple(f"solution {k + 1} (ordered by {suppressed})" for k in range(SLOTS))
    return NativeSolverFunction(
        "ik",
        f"All inverse kinematics solutions, in {SLOTS} solution slots, valid slots first.",
        "fk(q[k]) = T if residual[k] is a rounding error",
        (pose_argument(robot), *_given_arguments(robot, given)),
        outputs,
        SIX if n - len(given) == JOINTS else FIVE,
        GeneralArm.of(robot, choice, constants),
        CALLS,
        SLOTS,
        OPERATIONS,
        role=Role("inverse", "pose", fixed=given, labels=labels),
    )


def _given_arguments(robot: SerialRobot, given: tuple[int, ...]) -> tuple[Argument, ...]:
    symbols = arguments_of([joint.unit for joint in robot.coordinates])["q"].symbols
    return tuple(given_argument(robot, k, symbols[k]) for k in given)


def _kinds(robot: SerialRobot, given: tuple[int, ...]) -> tuple[int, ...]:
    slides = slides_of(robot)
    turning, sliding = (SOLVED_TURN, GIVEN_TURN), (SOLVED_SLIDE, GIVEN_SLIDE)
    return tuple((sliding if k in slides else turning)[k in given] for k in range(MAX_JOINTS))


def _row(E: Array) -> tuple[float, ...]:
    return tuple(map(float, E[:3].flat))
