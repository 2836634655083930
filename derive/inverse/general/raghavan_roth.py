"""General arms of six joints: the equations of Raghavan and Roth, and how to split them.

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
The C finds the angles theta_3 at which these have a solution. The choice of the suppressed joint
matters (:mod:`.split_choice`).

A joint that slides by d along its z axis has Tz(d) in the place of Rz(theta), and 1, d and d^2 in
that of 1, cosine and sine. It may be one of the pair, or that of joints 4 and 5 whose angle is not
halved; the other three turn.

Source:
    Raghavan and Roth, Inverse kinematics of the general 6R manipulator and related linkages,
    Journal of Mechanical Design 115 (1993).
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ...chain.poe import placement_matrix
from ...model.errors import RobotError
from ...model.robot import Joint, SerialRobot
from .line_quantities import COUNT, Array, motion, quantities, slide, turn

JOINTS = 6
Parts = Callable[[int], tuple[Array, Array, Array]]
"""The matrices of a turn or of a slide, by the sign of its coordinate."""


@dataclass(frozen=True)
class Split:
    """The loop, numbered from one of its joints.

    Attributes:
        joints: Indices of the joints in the order pair, suppressed, two more, the last.
        sense: 1 along the arm, -1 against it.
        halved: The joint whose half angle is an unknown: 0 the first of the two more, 1 the second.
    """

    joints: tuple[int, ...]
    sense: int
    halved: int = 0

    @property
    def turning(self) -> frozenset[int]:
        """The joints that have to turn: suppressed, of the half angle, and the last."""
        return frozenset(self.joints[k] for k in (2, 3 + self.halved, 5))


@dataclass(frozen=True)
class LineEquations:
    """The equations of a split.

    Attributes:
        left: (14, 9) in the pose: the column of 1, then the columns of y.
        right: (3, 14, 9), of 1, cos and sin of the suppressed angle.
    """

    left: Array
    right: Array


def splits(slides: Collection[int] = ()) -> list[Split]:
    """Every split of a loop of six joints, of which some may slide."""
    every = (
        Split(tuple((first + sense * k) % JOINTS for k in range(JOINTS)), sense, halved)
        for sense in (1, -1)
        for first in range(JOINTS)
        for halved in (0, 1)
    )
    return [split for split in every if split.turning.isdisjoint(slides)]


def placements(robot: SerialRobot) -> list[Array]:
    """The constant placements (4, 4) before, between and behind the joints, exact.

    Raises:
        RobotError: Some joint neither turns nor slides, or follows another one.
    """
    if not all(map(_is_free, robot.moving)):
        raise RobotError(
            f"{robot.name} is no chain of joints that turn or slide, each with its own coordinate"
        )
    found = [placement_matrix(robot.base)]
    for joint in robot.joints:
        found[-1] = found[-1] * placement_matrix(joint.before)
        if joint.kind != "fixed":
            found.append(sp.eye(4))
        found[-1] = found[-1] * placement_matrix(joint.after)
    found[-1] = found[-1] * placement_matrix(robot.tool)
    return [np.array(E.tolist(), object) for E in found]


def numbers(robot: SerialRobot) -> list[Array]:
    """The same placements as floats, at the default values of the parameters."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return [
        np.array([[float(e.xreplace(values)) for e in row] for row in E]) for E in placements(robot)
    ]


def equations(
    constants: Sequence[Array], split: Split, T: Array, slides: Collection[int] = ()
) -> LineEquations:
    """The fourteen equations of a split.

    Args:
        constants: The seven placements of the arm, expressions or floats.
        split: The order of the joints.
        T: The pose (4, 4), of the same kind.
        slides: Indices of the joints that slide, among the six.
    """
    inverses = _inverses(constants, split, T)
    parts = [slide if k in slides else turn for k in split.joints]
    return LineEquations(_left(inverses, parts), _right(inverses, parts))


def is_fit(robot: SerialRobot, given: Sequence[int] = (), joints: int = JOINTS) -> bool:
    """Whether so many joints are left beside given ones, and some split takes those that slide.

    Every joint has its own coordinate.

    Args:
        robot: The description.
        given: Indices of joints among those that move.
        joints: Number of the others.
    """
    others = [joint for k, joint in enumerate(robot.moving) if k not in given]
    slides = [k for k, joint in enumerate(others) if joint.kind == "prismatic"]
    return len(others) == joints and all(map(_is_free, robot.moving)) and bool(splits(slides))


def _is_free(joint: Joint) -> bool:
    """Whether a joint that turns or slides has its own coordinate."""
    return joint.kind in ("revolute", "prismatic") and joint.mimic is None


def doubled(six: Array) -> Array:
    """Six equations (..., 6, 9) as twelve (..., 12, 12) by the half angle f of the fourth joint.

    Each equation times cos f and times sin f; columns (cos 3f, sin 3f, cos f, sin f) x (1, c5, s5).
    """
    one, c, s = six[..., :3], six[..., 3:6] / 2, six[..., 6:] / 2
    by_cos, by_sin = [c, s, one + c, s], [-s, c, s, one - c]
    return np.concatenate([np.concatenate(row, -1) for row in (by_cos, by_sin)], -2)


def suppressed(found: LineEquations, halved: int) -> Array:
    """M (..., 3, 12, 12) of 1, cos and sin of the suppressed angle: M(theta) u = 0 at a solution.

    Args:
        found: The equations (..., 14, 9) and (..., 3, 14, 9), in numbers.
        halved: Which of the two angles on the right is halved.
    """
    orthogonal, _ = np.linalg.qr(found.left[..., 1:], mode="complete")
    right = found.right.copy()
    right[..., 0, :, 0] -= found.left[..., 0]
    six = orthogonal[..., None, :, 8:].mT @ right
    six = six.reshape(*six.shape[:-1], 3, 3)
    six = six.mT if halved else six
    return doubled(six.reshape(*six.shape[:-2], 9))


def forward(
    constants: Sequence[Array], values: Sequence[float], slides: Collection[int] = ()
) -> Array:
    """The pose (4, 4) at angles about the joints' z axes, and displacements along those of slides.

    Args:
        constants: The placements before, between and behind the joints.
        values: The value of each joint.
        slides: Indices of those that slide.
    """
    T = constants[0]
    for k, (value, E) in enumerate(zip(values, constants[1:], strict=True)):
        T = T @ moved(value, k in slides) @ E
    return T


def moved(value: float, slides: bool) -> Array:
    """The motion (4, 4) of a joint about its z axis, or along it where it slides."""
    return _raised(value) if slides else turned(value)


def turned(angle: float) -> Array:
    """The turn (4, 4) by an angle about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def _raised(height: float) -> Array:
    T = np.eye(4)
    T[2, 3] = height
    return T


def _inverses(constants: Sequence[Array], split: Split, T: Array) -> list[Array]:
    """The inverses of the loop's placements C_1 ... C_6, in the split's sense."""
    before, *between, behind = constants
    if split.sense > 0:
        closing = [*(_inverse(E) for E in between), _inverse(before) @ T @ _inverse(behind)]
        return [closing[k] for k in split.joints]
    closing = [*between, behind @ _inverse(T) @ before]
    return [closing[(k - 1) % JOINTS] for k in split.joints]


def _inverse(T: Array) -> Array:
    R, d = T[:3, :3], T[:3, 3]
    found = T.copy()
    found[:3, :3], found[:3, 3] = R.T, -R.T @ d
    return found


def _left(inverses: Sequence[Array], parts: Sequence[Parts]) -> Array:
    A1, A2 = (motion(T) for T in inverses[:2])
    first, second = (of(-1) for of in parts[:2])
    axis = quantities(inverses[5][:3, 3], inverses[5][:3, 2])
    columns = [A2 @ (Z2 @ line) for line in (A1 @ (Z1 @ axis) for Z1 in first) for Z2 in second]
    return np.stack(columns, 1)[:COUNT]


def _right(inverses: Sequence[Array], parts: Sequence[Parts]) -> Array:
    C3, C4, C5 = (_inverse(T) for T in inverses[2:5])
    A3, A4 = motion(C3), motion(C4)
    third, fourth, fifth = (of(1) for of in parts[2:5])
    axis = quantities(C5[:3, 3], C5[:3, 2])
    columns = [A3 @ (Z4 @ line) for Z4 in fourth for line in (A4 @ (Z5 @ axis) for Z5 in fifth)]
    x = np.stack(columns, 1)
    return np.array([(Z @ x)[:COUNT] for Z in third])
