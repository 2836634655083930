"""Tasks of arms that cannot have every pose: place, place and pitch, place and direction, plane."""

from collections.abc import Callable

import sympy as sp

from ..chain.forward import Pose
from ..model.robot import Robot
from ..terms.symbolic_function import Argument
from ..terms.terms import Terms
from ..terms.vectors import IDENTITY, Vector, combination, subtracted
from .families import planar, turntable
from .slots import Solved, branches, larger, squares, tool_of, values_of
from .steps.target import Target, of_pose
from .steps.three_joints import case_of
from .steps.work import Work
from .structure.lines import Lines, home_of
from .subproblems.turns import NO_TURN, Turn

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
    heading = abs(float(lines.terms.value(home_of(robot, lines.terms)[2, 0]))) < _ON_AXIS
    return {"ik_planar": _planar(robot, lines)} if turning and upright and heading else {}


def _tool_is_free(robot: Robot, lines: Lines) -> bool:
    """Whether a fifth joint, if there is one, turns the tool about the tool's own axis."""
    if len(lines.axes) <= 4:  # noqa: PLR2004
        return True
    axis = lines.axes[4]
    matrix = home_of(robot, lines.terms)
    home = [[float(lines.terms.value(e)) for e in row] for row in matrix.tolist()]
    way = [home[i][3] - axis.origin[i] for i in range(3)]
    tool = [home[i][2] for i in range(3)]
    h = axis.direction
    off = [h[i - 2] * way[i - 1] - h[i - 1] * way[i - 2] for i in range(3)]
    tilted = [h[i - 2] * tool[i - 1] - h[i - 1] * tool[i - 2] for i in range(3)]
    return bool(max(map(abs, (*off, *tilted))) < _ON_AXIS)


def _home(robot: Robot, terms: Terms) -> tuple[Vector, Vector]:
    """Origin and third axis of the tool in the home pose."""
    home = home_of(robot, terms)
    return _column(terms, home, 3), _column(terms, home, 2)


def _column(terms: Terms, home: sp.Matrix, j: int) -> Vector:
    return terms.let(home[0, j]), terms.let(home[1, j]), terms.let(home[2, j])


def _solved(
    robot: Robot,
    work: Work,
    name: str,
    argument: Argument,
    residual: Callable[[Pose], sp.Expr],
    identity: str,
) -> Solved:
    values = values_of(work, robot, {})
    found = residual(tool_of(work.terms, robot, values))
    return branches(name, robot, work, (argument,), values, found, identity)


def _moved2(terms: Terms, pose: Pose) -> sp.Expr:
    return squares(terms, subtracted(terms, pose[1], PLACE))


def position(robot: Robot, lines: Lines) -> Solved:
    """Place alone, by the first three joints; the others stay at 0."""
    terms = lines.terms
    work = Work(terms)
    arm = Lines(terms, lines.axes[:3], lines.tolerance)
    case = case_of(arm)
    assert case is not None
    case.solve(work, arm, _home(robot, terms)[0], PLACE)
    for axis in lines.axes[3:]:
        work.turns[axis.joint] = NO_TURN
    return _solved(
        robot,
        work,
        "ik_position",
        Argument("p", PLACE, (3,), "m", "place of the tool in the base frame"),
        lambda pose: terms.let(sp.sqrt(_moved2(terms, pose))),
        "fk(q[k]) has its origin in p wherever residual[k] is rounding; free joints are 0",
    )


def _position_pitch(robot: Robot, lines: Lines) -> Solved:
    """Place and elevation of the tool's axis."""
    terms = lines.terms
    work = Work(terms)
    tool, axis = _home(robot, terms)
    pitch = Turn(*terms.cos_sin(PITCH))
    turntable.solve_pitch(work, lines, tool, axis, PLACE, pitch)
    up = lines.axes[0].h

    def residual(pose: Pose) -> sp.Expr:
        z = pose[0][2]
        rise = terms.let(sum((a * b for a, b in zip(up, z, strict=True)), sp.Integer(0)))
        level = combination(terms, (sp.Integer(1), -rise), (z, up))
        length = terms.let(sp.sqrt(squares(terms, level)))
        # Beyond upright, the elevation is seen from behind.
        outward = terms.let(sp.Abs(pitch.c))
        return larger(
            terms, _moved2(terms, pose), squares(terms, (rise - pitch.s, length - outward))
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
    terms = lines.terms
    work = Work(terms)
    tool, axis = _home(robot, terms)
    turntable.solve_direction(work, lines, tool, axis, PLACE, U)
    return position_direction(robot, work)


def position_direction(robot: Robot, work: Work) -> Solved:
    """The task of place and direction, from the joints that were found for it."""
    terms = work.terms

    def residual(pose: Pose) -> sp.Expr:
        return larger(terms, _moved2(terms, pose), squares(terms, subtracted(terms, pose[0][2], U)))

    return _solved(
        robot,
        work,
        "ik_position_direction",
        Argument("x", (*PLACE, *U), (6,), "m, 1", "place of the tool, direction of its axis"),
        residual,
        "fk(q[k]) has its origin in x[:3] and the third axis x[3:] wherever residual[k] is "
        "rounding; a free joint is 0",
    )


def target_of_direction(robot: Robot, terms: Terms) -> Target:
    """Some pose with the tool in its place and its third axis in its direction.

    Source: Duff et al. 2017, Building an orthonormal basis, revisited: the two other axes without a
    case that loses digits.
    """
    x, y, z = U
    side = terms.let(sp.Piecewise((1, z >= 0), (-1, True), evaluate=False))
    a = terms.let(-1 / terms.let(side + z))
    b = terms.let(x * y * a)
    first = terms.let(1 + side * x**2 * a), terms.let(side * b), terms.let(-side * x)
    second = b, terms.let(side + y**2 * a), terms.let(-y)
    entries = [*zip(first, second, U, PLACE, strict=True)]
    pose = [entry for row in entries for entry in row]
    return of_pose(terms, pose, home_of(robot, terms))


def _planar(robot: Robot, lines: Lines) -> Solved:
    """Place in the base's x-y plane, and the angle of the tool's x axis in it."""
    terms = lines.terms
    work = Work(terms)
    home = home_of(robot, terms)
    c, s = terms.cos_sin(PHI)
    c0, s0 = terms.let(home[0, 0]), terms.let(home[1, 0])
    turn = Turn(terms.let(c * c0 + s * s0), terms.let(s * c0 - c * s0))
    _, _, z = IDENTITY
    axes = ((turn.c, turn.s, z[0]), (-turn.s, turn.c, z[0]), z)
    tool = _column(terms, home, 3)
    planar.solve(work, lines, Target(axes, tool, (X, Y, tool[2])))

    def residual(pose: Pose) -> sp.Expr:
        axes, origin = pose
        moved = squares(terms, (origin[0] - X, origin[1] - Y))
        return larger(terms, moved, squares(terms, (axes[0][0] - c, axes[0][1] - s)))

    return _solved(
        robot,
        work,
        "ik_planar",
        Argument("x", (X, Y, PHI), (3,), "m, rad", "place of the tool in the plane, its angle"),
        residual,
        "fk(q[k]) has its origin in x[:2] and its first axis at the angle x[2] wherever "
        "residual[k] is rounding",
    )
