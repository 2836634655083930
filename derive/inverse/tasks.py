"""Tasks of arms that cannot have every pose: place, place and pitch, place and direction, plane."""

from collections.abc import Callable

import sympy as sp

from ..forward import Pose
from ..function import Argument
from ..robot import Robot
from ..scope import Scope
from ..vectors import IDENTITY, Vector, combination, subtracted
from .families import planar, turntable
from .families.three_joints import case_of
from .function import Solved, branches, larger, squares, tool_of, values_of
from .lines import Lines, home_of
from .target import Target, of_pose
from .turns import NO_TURN, Turn
from .work import Work

X, Y, Z, PITCH, PHI = sp.symbols("_x _y _z _pitch _phi", real=True)
U = sp.symbols("_u1 _u2 _u3", real=True)
PLACE: Vector = (X, Y, Z)
_ON_AXIS = 1e-9
"""Distance (metre) and sine up to which the tool lies on the axis of its joint."""


def turntable_tasks(robot: Robot, lines: Lines) -> dict[str, Solved]:
    """The tasks of a turntable with three parallel axes."""
    made = {"ik_position": position(robot, lines)}
    if _tool_is_free(robot, lines):
        made["ik_position_pitch"] = _position_pitch(robot, lines)
        made["ik_position_direction"] = _position_direction(robot, lines)
    return made


def planar_tasks(robot: Robot, lines: Lines) -> dict[str, Solved]:
    """The task of a planar arm whose plane is the base's, and in which the tool's x axis lies."""
    upright = abs(float(lines.axes[0].direction[2])) > 1 - _ON_AXIS
    turning = all(axis.turns for axis in lines.axes)
    heading = abs(float(lines.scope.value(home_of(robot, lines.scope)[2, 0]))) < _ON_AXIS
    return {"ik_planar": _planar(robot, lines)} if turning and upright and heading else {}


def _tool_is_free(robot: Robot, lines: Lines) -> bool:
    """Whether a fifth joint, if there is one, turns the tool about the tool's own axis."""
    if len(lines.axes) <= 4:  # noqa: PLR2004
        return True
    axis = lines.axes[4]
    matrix = home_of(robot, lines.scope)
    home = [[float(lines.scope.value(e)) for e in row] for row in matrix.tolist()]
    way = [home[i][3] - axis.origin[i] for i in range(3)]
    tool = [home[i][2] for i in range(3)]
    h = axis.direction
    off = [h[i - 2] * way[i - 1] - h[i - 1] * way[i - 2] for i in range(3)]
    tilted = [h[i - 2] * tool[i - 1] - h[i - 1] * tool[i - 2] for i in range(3)]
    return bool(max(map(abs, (*off, *tilted))) < _ON_AXIS)


def _home(robot: Robot, scope: Scope) -> tuple[Vector, Vector]:
    """Origin and third axis of the tool in the home pose."""
    home = home_of(robot, scope)
    return _column(scope, home, 3), _column(scope, home, 2)


def _column(scope: Scope, home: sp.Matrix, j: int) -> Vector:
    return scope.let(home[0, j]), scope.let(home[1, j]), scope.let(home[2, j])


def _solved(
    robot: Robot,
    work: Work,
    name: str,
    argument: Argument,
    residual: Callable[[Pose], sp.Expr],
    identity: str,
) -> Solved:
    values = values_of(work, robot, {})
    found = residual(tool_of(work.scope, robot, values))
    return branches(name, robot, work, (argument,), values, found, identity)


def _moved2(scope: Scope, pose: Pose) -> sp.Expr:
    return squares(scope, subtracted(scope, pose[1], PLACE))


def position(robot: Robot, lines: Lines) -> Solved:
    """Place alone, by the first three joints; the others stay at 0."""
    scope = lines.scope
    work = Work(scope)
    arm = Lines(scope, lines.axes[:3], lines.tolerance)
    case = case_of(arm)
    assert case is not None
    case.solve(work, arm, _home(robot, scope)[0], PLACE)
    for axis in lines.axes[3:]:
        work.turns[axis.joint] = NO_TURN
    return _solved(
        robot,
        work,
        "ik_position",
        Argument("p", PLACE, (3,), "m", "place of the tool in the base frame"),
        lambda pose: scope.let(sp.sqrt(_moved2(scope, pose))),
        "fk(q[k]) has its origin in p wherever residual[k] is rounding; free joints are 0",
    )


def _position_pitch(robot: Robot, lines: Lines) -> Solved:
    """Place and elevation of the tool's axis."""
    scope = lines.scope
    work = Work(scope)
    tool, axis = _home(robot, scope)
    pitch = Turn(*scope.cos_sin(PITCH))
    turntable.solve_pitch(work, lines, tool, axis, PLACE, pitch)
    up = lines.axes[0].h

    def residual(pose: Pose) -> sp.Expr:
        z = pose[0][2]
        rise = scope.let(sum((a * b for a, b in zip(up, z, strict=True)), sp.Integer(0)))
        level = combination(scope, (sp.Integer(1), -rise), (z, up))
        length = scope.let(sp.sqrt(squares(scope, level)))
        # Beyond upright, the elevation is seen from behind.
        outward = scope.let(sp.Abs(pitch.c))
        return larger(
            scope, _moved2(scope, pose), squares(scope, (rise - pitch.s, length - outward))
        )

    return _solved(
        robot,
        work,
        "ik_position_pitch",
        Argument("x", (*PLACE, PITCH), (4,), "m, rad", "place of the tool, elevation of its axis"),
        residual,
        "fk(q[k]) has its origin in x[:3] and its third axis the elevation x[3] wherever "
        "residual[k] is rounding; a free joint is 0",
    )


def _position_direction(robot: Robot, lines: Lines) -> Solved:
    """Place and direction of the tool's axis; a fifth joint stays at 0."""
    scope = lines.scope
    work = Work(scope)
    tool, axis = _home(robot, scope)
    turntable.solve_direction(work, lines, tool, axis, PLACE, U)
    return position_direction(robot, work)


def position_direction(robot: Robot, work: Work) -> Solved:
    """The task of place and direction, from the joints that were found for it."""
    scope = work.scope

    def residual(pose: Pose) -> sp.Expr:
        return larger(scope, _moved2(scope, pose), squares(scope, subtracted(scope, pose[0][2], U)))

    return _solved(
        robot,
        work,
        "ik_position_direction",
        Argument("x", (*PLACE, *U), (6,), "m, 1", "place of the tool, direction of its axis"),
        residual,
        "fk(q[k]) has its origin in x[:3] and the third axis x[3:] wherever residual[k] is "
        "rounding; a free joint is 0",
    )


def target_of_direction(robot: Robot, scope: Scope) -> Target:
    """Some pose with the tool in its place and its third axis in its direction.

    Source: Duff et al. 2017, Building an orthonormal basis, revisited: the two other axes without a
    case that loses digits.
    """
    x, y, z = U
    side = scope.let(sp.Piecewise((1, z >= 0), (-1, True), evaluate=False))
    a = scope.let(-1 / scope.let(side + z))
    b = scope.let(x * y * a)
    first = scope.let(1 + side * x**2 * a), scope.let(side * b), scope.let(-side * x)
    second = b, scope.let(side + y**2 * a), scope.let(-y)
    entries = [*zip(first, second, U, PLACE, strict=True)]
    pose = [entry for row in entries for entry in row]
    return of_pose(scope, pose, home_of(robot, scope))


def _planar(robot: Robot, lines: Lines) -> Solved:
    """Place in the base's x-y plane, and the angle of the tool's x axis in it."""
    scope = lines.scope
    work = Work(scope)
    home = home_of(robot, scope)
    c, s = scope.cos_sin(PHI)
    c0, s0 = scope.let(home[0, 0]), scope.let(home[1, 0])
    turn = Turn(scope.let(c * c0 + s * s0), scope.let(s * c0 - c * s0))
    _, _, z = IDENTITY
    axes = ((turn.c, turn.s, z[0]), (-turn.s, turn.c, z[0]), z)
    tool = _column(scope, home, 3)
    planar.solve(work, lines, Target(axes, tool, (X, Y, tool[2])))

    def residual(pose: Pose) -> sp.Expr:
        axes, origin = pose
        moved = squares(scope, (origin[0] - X, origin[1] - Y))
        return larger(scope, moved, squares(scope, (axes[0][0] - c, axes[0][1] - s)))

    return _solved(
        robot,
        work,
        "ik_planar",
        Argument("x", (X, Y, PHI), (3,), "m, rad", "place of the tool in the plane, its angle"),
        residual,
        "fk(q[k]) has its origin in x[:2] and its first axis at the angle x[2] wherever "
        "residual[k] is rounding",
    )
