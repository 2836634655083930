"""General arms of six revolute joints: the equations of Raghavan and Roth, and how to split them.

The loop through arm and tool closes: with C_k the constant placement after joint k, and the pose
within the placement that leads from the tool back to the base,

    Rz(theta_1) C_1 Rz(theta_2) C_2 ... Rz(theta_6) C_6 = I.

Numbered from any joint and walked in either direction, the joints are a pair (1, 2), the suppressed
one (3), two more (4, 5) and one (6) that does not move its own axis and so drops out of the axis'
equations:

    Rz_3 C_3 Rz_4 C_4 Rz_5 C_5 (axis of joint 6)  =  C_2^-1 Rz_2^-1 C_1^-1 Rz_1^-1 C_6^-1 (the same)

Both sides, as fourteen quantities of a line (:mod:`.line_quantities`), are linear in the cosines
and sines of each of their joints:

    A y = B(theta_3) x,   y the eight products of joints 1 and 2, x the nine of joints 4 and 5,

with A (14, 8) of the pose and B of theta_3 alone. Six combinations do not contain y.
``chasles_general.h`` turns them into a problem of sixteen eigenvalues.

The choice of the suppressed joint matters: where neighbouring axes of the arm meet or are parallel,
most splits give a determinant that vanishes for every theta_3. So the split is chosen by trial on
many poses, among those with the pose on the left side: det M(theta_3) must be a trigonometric
polynomial of degree 8, and the second smallest singular value at a solution must be far from zero.

Source:
    Raghavan and Roth, Inverse kinematics of the general 6R manipulator and related linkages,
    Journal of Mechanical Design 115 (1993). Manocha and Canny, Efficient inverse kinematics for
    general 6R manipulators, IEEE Trans. Robotics and Automation 10 (1994), for the eigenvalues.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ...chain.kinematics import BOTTOM_ROW
from ...chain.poe import placement_matrix
from ...model.errors import RobotError
from ...model.robot import Robot
from ...model.tolerances import DETERMINANT_TAIL, SINGLE_SOLUTION
from ...terms.role import Role
from ...terms.symbolic_function import Result, SymbolicFunction
from ...terms.terms import Terms
from ..tasks.slots import POSE_SYMBOLS, pose_argument
from .line_quantities import COUNT, Array, motion, quantities, turn

JOINTS = 6
SAMPLES = 32
"""Angles at which the determinant of a split is sampled."""
DEGREE = 8
"""Degree of the determinant in the suppressed angle: sixteen solutions."""
RANK = 8
"""Rank of the coefficients of exp(i theta) of the suppressed angle, a (12, 12) matrix."""
POSES = 16
"""Poses on which a split is tried."""

Naming = Callable[[Array], Array]


@dataclass(frozen=True)
class Split:
    """The loop, numbered from one of its joints.

    Attributes:
        joints: Indices of the joints in the order pair, suppressed, two more, the last.
        sense: 1 along the arm, -1 against it.
    """

    joints: tuple[int, ...]
    sense: int

    @property
    def of_pose(self) -> int:
        """Index in the loop, 0 to 5, of the placement that contains the pose."""
        return self.joints.index(JOINTS - 1 if self.sense > 0 else 0)


@dataclass(frozen=True)
class LineEquations:
    """The equations of a split.

    Attributes:
        left: (14, 9) in the pose: the column of 1, then the columns of y.
        right: (3, 14, 9), of 1, cos and sin of the suppressed angle, constant.
    """

    left: Array
    right: Array


def splits() -> list[Split]:
    """Every split whose pose is on the left side, so that the right is constant."""
    found = [
        Split(tuple((first + sense * k) % JOINTS for k in range(JOINTS)), sense)
        for sense in (1, -1)
        for first in range(JOINTS)
    ]
    return [split for split in found if split.of_pose in (5, 0, 1)]


def placements(robot: Robot) -> list[Array]:
    """The constant placements (4, 4) before, between and behind the six joints, exact.

    Raises:
        RobotError: The robot is no chain of six revolute joints, each with its own coordinate.
    """
    if not is_fit(robot):
        raise RobotError(f"{robot.name} is no chain of six revolute joints with six coordinates")
    found = [placement_matrix(robot.base)]
    for joint in robot.joints:
        found[-1] = found[-1] * placement_matrix(joint.before)
        if joint.kind != "fixed":
            found.append(sp.eye(4))
        found[-1] = found[-1] * placement_matrix(joint.after)
    found[-1] = found[-1] * placement_matrix(robot.tool)
    return [np.array(E.tolist(), object) for E in found]


def numbers(robot: Robot) -> list[Array]:
    """The same placements as floats, at the default values of the parameters."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return [
        np.array([[float(e.xreplace(values)) for e in row] for row in E]) for E in placements(robot)
    ]


def equations(
    constants: Sequence[Array], split: Split, T: Array, named: Naming = np.asarray
) -> LineEquations:
    """The fourteen equations of a split.

    Args:
        constants: The placements of the arm, expressions or floats.
        split: The order of the joints.
        T: The pose (4, 4), of the same kind.
        named: Gives the entries of an array their names.
    """
    inverses = _inverses(constants, split, T, named)
    return LineEquations(_left(inverses, named), _right(inverses, named))


def split_of(robot: Robot) -> Split | None:
    """The split whose solutions are best separated, over many poses.

    None where the robot is no chain of six revolute joints, or where no split has a determinant of
    degree 8, a kernel of dimension 4 (:mod:`.eigenvalue_tables`) and single solutions: such an arm
    has a structure that a simpler decomposition solves.
    """
    if not is_fit(robot):
        return None
    constants = numbers(robot)
    ratings = {
        split: min(_rating(constants, split, q) for q in _poses())
        for split in splits()
        if _has_kernel(equations(constants, split, np.eye(4)).right)
    }
    best = max(ratings, key=lambda split: ratings[split], default=None)
    return None if best is None or ratings[best] < SINGLE_SOLUTION else best


def is_fit(robot: Robot) -> bool:
    """Whether a robot is a chain of six revolute joints, each with its own coordinate."""
    moving = robot.moving
    return len(moving) == JOINTS and all(j.kind == "revolute" and not j.mimic for j in moving)


def signs(robot: Robot, split: Split) -> tuple[int, ...]:
    """For each joint of a split, its angle in the loop at a coordinate of 1."""
    return tuple(split.sense * robot.moving[k].direction for k in split.joints)


def matrices(robot: Robot, split: Split, terms: Terms) -> SymbolicFunction:
    """The left side of the equations as a function of the pose, ``ik_matrices(T)``."""
    T = np.array(POSE_SYMBOLS, object).reshape(4, 4)
    T[3] = BOTTOM_ROW
    named = np.vectorize(lambda entry: terms.let(sp.S.One * entry), [object])
    found = equations(placements(robot), split, T, named)
    first, second, suppressed, *others, last = (robot.coordinates[k].name for k in split.joints)
    result = Result(
        "left",
        tuple(found.left.flat),
        (COUNT, 9),
        "1, m, m^2, m^3",
        f"left side: the columns of 1 and of the products of {first} and {second}",
    )
    return SymbolicFunction(
        "ik_matrices",
        f"Left side of Raghavan and Roth's equations, which are free of {last}.",
        f"left (1, y) = B({suppressed}) x, y of {first}, {second} and x of {', '.join(others)}",
        (pose_argument(robot),),
        (result,),
        terms,
        role=Role("inverse equations", "pose"),
    )


def doubled(six: Array) -> Array:
    """Six equations (6, 9) as twelve (12, 12) by the half angle f of the fourth joint.

    Each equation times cos f and times sin f; columns (cos 3f, sin 3f, cos f, sin f) x (1, c5, s5).
    """
    one, c, s = six[:, :3], six[:, 3:6] / 2, six[:, 6:] / 2
    return np.vstack([np.hstack([c, s, one + c, s]), np.hstack([-s, c, s, one - c])])


def suppressed(found: LineEquations) -> Array:
    """M (3, 12, 12) of 1, cos and sin of the suppressed angle: M(theta) u = 0 at a solution."""
    orthogonal, _ = np.linalg.qr(found.left[:, 1:], mode="complete")
    right = found.right.copy()
    right[0, :, 0] -= found.left[:, 0]
    return np.array([doubled(orthogonal[:, 8:].T @ part) for part in right])


def _has_kernel(right: Array) -> bool:
    """Whether exp(i theta) has rank 8, with independent real and imaginary parts of its kernel."""
    _, sizes, rows = np.linalg.svd(doubled(right[1]) - 1j * doubled(right[2]))
    kernel = rows[RANK:].conj()
    separation = np.linalg.svd(np.vstack([kernel.real, kernel.imag]), compute_uv=False)
    found = sizes > DETERMINANT_TAIL * sizes[0]
    return bool(found[:RANK].all() and not found[RANK:].any() and separation[-1] > DETERMINANT_TAIL)


def _rating(constants: Sequence[Array], split: Split, q: Sequence[float]) -> float:
    """Second smallest singular value at a solution over the greatest; 0 for a bad split."""
    M = suppressed(equations(constants, split, _forward(constants, q)))
    turns = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    sampled = np.tensordot(np.array([np.ones(SAMPLES), np.cos(turns), np.sin(turns)]).T, M, 1)
    degrees = np.abs(np.fft.rfft(np.linalg.det(sampled)))
    if degrees[DEGREE + 1 :].max() > DETERMINANT_TAIL * degrees.max():
        return 0.0
    angle = split.sense * q[split.joints[2]]
    at = np.tensordot(np.array([1.0, np.cos(angle), np.sin(angle)]), M, 1)
    sizes = np.linalg.svd(at, compute_uv=False)
    return float(sizes[-2] / sizes[0])


def _poses() -> list[list[float]]:
    """Evenly distributed configurations without a pattern: multiples of square roots modulo 1."""
    primes = (2, 3, 5, 7, 11, 13)
    return [[2 * np.pi * (k * p**0.5 % 1) for p in primes] for k in range(1, POSES + 1)]


def _forward(constants: Sequence[Array], angles: Sequence[float]) -> Array:
    T = constants[0]
    for angle, E in zip(angles, constants[1:], strict=True):
        c, s = np.cos(angle), np.sin(angle)
        T = T @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) @ E
    return T


def _inverses(constants: Sequence[Array], split: Split, T: Array, named: Naming) -> list[Array]:
    """The inverses of the loop's placements C_1 ... C_6, in the split's sense."""
    before, *between, behind = constants
    if split.sense > 0:
        pose = named(named(_inverse(before) @ T) @ _inverse(behind))
        closing = [*(_inverse(E) for E in between), pose]
        return [closing[k] for k in split.joints]
    closing = [*between, named(named(behind @ _inverse(T)) @ before)]
    return [closing[(k - 1) % JOINTS] for k in split.joints]


def _inverse(T: Array) -> Array:
    R, d = T[:3, :3], T[:3, 3]
    found = T.copy()
    found[:3, :3], found[:3, 3] = R.T, -R.T @ d
    return found


def _left(inverses: Sequence[Array], named: Naming) -> Array:
    A1, A2 = (named(motion(T)) for T in inverses[:2])
    axis = named(quantities(inverses[5][:3, 3], inverses[5][:3, 2]))
    columns = [
        named(A2 @ (Z2 @ moved))
        for moved in (named(A1 @ (Z1 @ axis)) for Z1 in turn(-1))
        for Z2 in turn(-1)
    ]
    return np.stack(columns, 1)[:COUNT]


def _right(inverses: Sequence[Array], named: Naming) -> Array:
    C3, C4, C5 = (_inverse(T) for T in inverses[2:5])
    A3, A4 = named(motion(C3)), named(motion(C4))
    axis = named(quantities(C5[:3, 3], C5[:3, 2]))
    columns = [
        named(A3 @ (Z4 @ moved))
        for Z4 in turn(1)
        for moved in (named(A4 @ (Z5 @ axis)) for Z5 in turn(1))
    ]
    x = np.stack(columns, 1)
    return np.array([(Z @ x)[:COUNT] for Z in turn(1)])
