"""The inverse of revolute joints without a structure, and its words for ``--explain``."""

from dataclasses import dataclass

from ...model.robot import Robot
from ...terms.symbolic_function import Table, WrittenFunction
from ..structure.lines import TOOL_AXIS
from . import written_inverse
from .raghavan_roth import JOINTS, is_fit, numbers
from .split_choice import Choice, choice_at, choose
from .tool_joint import OWN, with_tool_joint


@dataclass(frozen=True)
class GeneralInverse:
    """The inverse of a general arm.

    Attributes:
        title: The kind of arm and the source of the method, in words.
        method: The method in words.
        choice: The orders of the joints in the equations, and the joint that is given.
        function: The function ``ik``, which finds the roots of a determinant.
        steps: The numbered steps in words.
        given: Names of the joints that are given.
    """

    title: str
    method: str
    choice: Choice
    function: WrittenFunction
    steps: tuple[str, ...]
    given: tuple[str, ...] = ()


def general_inverse(robot: Robot, give: tuple[int, ...] = ()) -> GeneralInverse | None:
    """The inverse of an arm of five to seven revolute joints, or None where it has none.

    Args:
        robot: The description.
        give: Index of the joint of seven to be given; () for the one that is best.
    """
    if not give and is_fit(robot, OWN):
        return _of_five(robot)
    sizes = (JOINTS + len(give),) if give else (JOINTS, JOINTS + 1)
    if len(give) > 1 or not any(is_fit(robot, joints) for joints in sizes):
        return None
    choice = choice_at(numbers(robot), give[0]) if give else choose(numbers(robot))
    if choice is None:
        return None
    count = "six" if choice.given is None else "seven"
    given = () if choice.given is None else (robot.moving[choice.given].name,)
    return GeneralInverse(
        f"an arm of {count} revolute joints without a structure (Raghavan and Roth)",
        "by the roots of a determinant",
        choice,
        written_inverse.inverse(robot, choice, numbers(robot)),
        _steps(robot, choice),
        given,
    )


def _of_five(robot: Robot) -> GeneralInverse | None:
    """The inverse of five joints, which are solved as six."""
    arm = with_tool_joint(numbers(robot))
    if arm is None:
        return None
    return GeneralInverse(
        "an arm of five revolute joints without a structure (Raghavan and Roth)",
        "by the roots of a determinant",
        arm.choice,
        written_inverse.inverse(robot, arm.choice, arm.constants),
        _steps(robot, arm.choice),
    )


def general_tables(
    robot: Robot, given: tuple[int, ...], apart: tuple[float, ...] = ()
) -> tuple[Table, ...]:
    """The tables by which an arm is solved as a general one, none where it cannot be.

    Args:
        robot: The description.
        given: Indices of the joints that are given: none of six joints, one of seven.
        apart: How far solutions are apart in each of the six joints (radian), if it is known.
    """
    if len(given) > 1 or not is_fit(robot, JOINTS + len(given)):
        return ()
    choice = choice_at(numbers(robot), given[0] if given else None, apart)
    return () if choice is None else written_inverse.tables(robot, choice, numbers(robot))


def _steps(robot: Robot, choice: Choice) -> tuple[str, ...]:
    free = [joint.name for k, joint in enumerate(robot.moving) if k != choice.given]
    free += [TOOL_AXIS] * (JOINTS - len(free))
    one, two, suppressed, v, w, last = (free[k] for k in choice.splits[0].joints)
    half, other = (w, v) if choice.splits[0].halved else (v, w)
    steps = (
        f"{last} does not move its own axis: fourteen quantities of this axis are linear in the "
        f"products of cosines and sines of {one} and {two}, and in those of {v} and {w}. Six "
        f"combinations of the equations do not contain {one} and {two}.",
        f"{suppressed}: with the half angle of {half} these are twelve equations. Their "
        "determinant, a trigonometric polynomial of degree 8, is known from 24 samples; it has up "
        "to 16 real roots.",
        f"{half}, {other}: from the vector that the twelve equations take to zero. {one}, {two}: "
        "from the equations that were combined.",
        f"{last}: from the orientation that the other joints leave. Newton steps on the pose "
        "refine the result.",
        *_others(free, choice),
    )
    if TOOL_AXIS in free:
        return (
            f"{TOOL_AXIS} is a sixth joint, which turns the tool about an axis of the tool. The "
            "five joints reach a pose where its angle is 0; other solutions are none of theirs.",
            *steps,
        )
    if choice.given is None:
        return steps
    name = robot.moving[choice.given].name
    first = (
        f"{name} is given: with the joints fixed beside it, six joints are left, whose solutions "
        "it separates best of all."
    )
    return (first, *steps)


def _others(free: list[str], choice: Choice) -> tuple[str, ...]:
    """The other splits, in words."""
    names = [free[split.joints[2]] for split in choice.splits[1:]]
    if not names:
        return ()
    return (
        "Where roots or solutions run together, the same is done with other orders of the joints, "
        f"for {' and '.join(names)} in the place of {free[choice.splits[0].joints[2]]}.",
    )
