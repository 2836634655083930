"""Tasks that prescribe a part of the pose: position, position with pitch or with direction."""

from collections.abc import Callable
from dataclasses import replace

import sympy as sp

from chasles.contract import TaskComponent

from ...chain.forward import Pose
from ...model.robot import SerialRobot
from ...terms.symbolic_function import Argument
from ...terms.terms import Terms
from ...terms.vectors import Vector, combination, subtracted
from ..steps.target import Target, of_pose
from ..steps.three_joints import case_of
from ..steps.work import Work
from ..structure.lines import Lines, home_of, numbers
from ..structure.rank import moves_in_space
from ..subproblems.turns import NO_TURN, CosSin
from .slots import POSE_SYMBOLS, branches, larger, squares, tool_of, values_of
from .task import InputLetter, Solved, Task, TaskInput

X, Y, Z, PITCH = sp.symbols("_x _y _z _pitch", real=True)
DIRECTION = sp.symbols("_u1 _u2 _u3", real=True)
"""Target direction of the third tool axis, a vector of any length in base axes."""
POSITION: Vector = (X, Y, Z)
"""Target position of the tool origin in the base frame (meter)."""
POSITION_ENTRIES = (POSE_SYMBOLS[3], POSE_SYMBOLS[7], POSE_SYMBOLS[11])
"""Symbols of the position entries of a pose."""
_DIRECTION_LETTERS = tuple(
    InputLetter(("u", r"\upsilon", r"\mathrm{u}"), component) for component in range(3)
)
_PITCH_LETTER = InputLetter((r"\lambda", r"\nu", r"\Lambda"))


def tool_origin(robot: SerialRobot, terms: Terms) -> Vector:
    """Return the tool origin in the home pose (meter), in base axes."""
    return _column(terms, home_of(robot, terms), 3)


def tool_axis(robot: SerialRobot, terms: Terms) -> Vector:
    """Return the third tool axis in the home pose (unit vector), in base axes."""
    return _column(terms, home_of(robot, terms), 2)


def _column(terms: Terms, home: sp.Matrix, j: int) -> Vector:
    return terms.let(home[0, j]), terms.let(home[1, j]), terms.let(home[2, j])


def partial_pose(
    name: str,
    robot: SerialRobot,
    work: Work,
    task_input: TaskInput,
    residual: Callable[[Pose], sp.Expr],
    identity: str,
    components: tuple[TaskComponent, ...] = (),
) -> Solved:
    """Return the inverse-kinematics task for a part of the pose, such as the position.

    Args:
        name: Name of the generated function.
        robot: The description.
        work: The record of the solution.
        task_input: The parts of the pose that the task prescribes.
        residual: A function that returns the deviation of a tool pose from the target (meter or
            radian).
        identity: Identity that the generated function satisfies, in one line.
        components: Names by which the runtime identifies the prescribed parts of the pose, in the
            order of the input entries. Without ``components``, the runtime does not refine
            solutions near singularities.
    """
    values = values_of(work, robot, {})
    deviation = residual(tool_of(work.terms, robot, values))
    solved = branches(name, robot, work, (), values, deviation, identity, inputs=(task_input,))
    free = tuple(k for k, value in enumerate(values) if value == 0)
    role = replace(solved.function.role, components=components, free=free)
    return replace(solved, function=replace(solved.function, role=role))


def _squared_distance(terms: Terms, pose: Pose) -> sp.Expr:
    return squares(terms, subtracted(terms, pose[1], POSITION))


def _by_three_joints(robot: SerialRobot, lines: Lines) -> Solved:
    terms = lines.terms
    work = Work(terms)
    arm = Lines(terms, lines.axes[:3], lines.tolerance)
    case = case_of(arm)
    assert case is not None
    case.solve(work, arm, tool_origin(robot, terms), POSITION)
    for axis in lines.axes[3:]:
        work.turns[axis.joint] = NO_TURN
    return position(robot, work)


def _move_in_space(robot: SerialRobot, lines: Lines) -> bool:
    column = home_of(robot, lines.terms)[:3, 3]
    return moves_in_space(replace(lines, axes=lines.axes[:3]), numbers(lines.terms, column))


POSITION_TASK = Task("ik_position", _by_three_joints, _move_in_space, reads_base=True)


def position(robot: SerialRobot, work: Work) -> Solved:
    """Return the task for a tool position."""
    terms = work.terms
    meaning = "position of the tool in the base frame"
    return partial_pose(
        "ik_position",
        robot,
        work,
        TaskInput(Argument("p", POSITION, (3,), "m", meaning), POSITION_ENTRIES),
        lambda pose: terms.let(sp.sqrt(_squared_distance(terms, pose))),
        "fk(q[k]) has its origin at p if residual[k] is a rounding error; free joints are 0",
        ("position",),
    )


def position_pitch(robot: SerialRobot, work: Work, up: Vector, pitch: CosSin) -> Solved:
    """Return the task for a tool position and the elevation of the tool axis.

    Args:
        robot: The description.
        work: The record of the solution.
        up: The vertical direction (unit vector) in base axes. The elevation of a horizontal
            direction is 0.
        pitch: The elevation angle.
    """
    terms = work.terms

    def residual(pose: Pose) -> sp.Expr:
        z = pose[0][2]
        rise = terms.let(sum((a * b for a, b in zip(up, z, strict=True)), sp.Integer(0)))
        level = combination(terms, (sp.Integer(1), -rise), (z, up))
        length = terms.let(sp.sqrt(squares(terms, level)))
        # For a pitch beyond 90 degrees, the tool axis leans backward, and the elevation of the tool
        # axis is 180 degrees minus the pitch.
        outward = terms.let(sp.Abs(pitch.c))
        return larger(
            terms,
            _squared_distance(terms, pose),
            squares(terms, (rise - pitch.s, length - outward)),
        )

    meaning = "position of the tool and elevation of its axis"
    return partial_pose(
        "ik_position_pitch",
        robot,
        work,
        TaskInput(
            Argument("x", (*POSITION, PITCH), (4,), "m, rad", meaning),
            (*POSITION_ENTRIES, _PITCH_LETTER),
        ),
        residual,
        "fk(q[k]) has its origin at x[:3] and its third axis has the elevation x[3] if residual[k] "
        "is a rounding error; a free joint is 0",
        ("position", "pitch"),
    )


def position_direction(robot: SerialRobot, work: Work) -> Solved:
    """Return the task for a tool position and the direction of the tool axis."""
    terms = work.terms
    wanted = unit_direction(terms)

    def residual(pose: Pose) -> sp.Expr:
        return larger(
            terms,
            _squared_distance(terms, pose),
            squares(terms, subtracted(terms, pose[0][2], wanted)),
        )

    meaning = "position of the tool and direction of its axis as a vector of any length"
    return partial_pose(
        "ik_position_direction",
        robot,
        work,
        TaskInput(
            Argument("x", (*POSITION, *DIRECTION), (6,), "m, 1", meaning),
            (*POSITION_ENTRIES, *_DIRECTION_LETTERS),
        ),
        residual,
        "fk(q[k]) has its origin at x[:3] and the third axis x[3:] / |x[3:]| if residual[k] is a "
        "rounding error; a free joint is 0",
        ("position", "direction"),
    )


def unit_direction(terms: Terms) -> Vector:
    """Return the target direction as a unit vector in base axes.

    For a target vector of length zero, the unit vector is NaN.
    """
    scale = terms.let(1 / terms.let(sp.sqrt(squares(terms, DIRECTION))))
    x, y, z = (terms.let(scale * component) for component in DIRECTION)
    return x, y, z


def name_direction(work: Work) -> Vector:
    """Name the unit vector of the target direction in the LaTeX article, and return the vector."""
    meaning = "the direction as a unit vector"
    return work.name_vector(("e", r"\epsilon", "E"), meaning, unit_direction(work.terms))


def target_of_direction(robot: SerialRobot, work: Work) -> Target:
    """Return a pose at the target position whose third axis has the target direction.

    Source: Duff et al. 2017, Building an orthonormal basis, revisited.
    """
    terms = work.terms
    direction = name_direction(work)
    x, y, z = direction
    side = terms.let(sp.Piecewise((1, z >= 0), (-1, True), evaluate=False))
    a = terms.let(-1 / terms.let(side + z))
    b = terms.let(x * y * a)
    first = terms.let(1 + side * x**2 * a), terms.let(side * b), terms.let(-side * x)
    second = b, terms.let(side + y**2 * a), terms.let(-y)
    entries = [*zip(first, second, direction, POSITION, strict=True)]
    pose = [entry for row in entries for entry in row]
    return of_pose(terms, pose, home_of(robot, terms))
