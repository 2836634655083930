"""Equations of Raghavan and Roth for general six-joint arms.

The six joints of the arm and the target pose form a closed loop. Let C_k be the constant placement
after joint k of this loop. The placement C_6 closes the loop from the tool back to the base, and
therefore contains the target pose. The product of the factors ``Rz(theta_k) C_k`` for k = 1 to 6 is
the identity matrix.

An elimination order numbers the six joints of the loop from 1 to 6. The numbering of the joints may
start at any joint and may run in either direction. The method of Raghavan and Roth eliminates the
variables of joints 1 and 2 together. Joint 3 is the suppressed joint, whose angle appears only in
the coefficients of the equations. Joint 6 does not move its own axis, so the equations for this
axis do not contain the angle of joint 6.

    The loop equation for the axis a of joint 6 is ``Rz_3 C_3 Rz_4 C_4 Rz_5 C_5 a = C_2^-1 Rz_2^-1
    C_1^-1 Rz_1^-1 C_6^-1 a``.

Both sides of the loop equation describe the same line, the axis of joint 6. Fourteen quantities
describe a line, as defined in ``line_quantities``. The fourteen quantities of the axis of joint 6
are linear in the cosine and sine of each joint angle. The fourteen equations have the form ``A y =
B(theta_3) x``. The vector y contains eight products of cosines and sines of joints 1 and 2. The
vector x contains the nine products of 1, cosine and sine of joint 4 with 1, cosine and sine of
joint 5.

The matrix A (14, 8) depends only on the pose, and B depends only on theta_3. Six linear
combinations of the fourteen equations do not contain the angles of joints 1 and 2. The generated C
code finds the angles theta_3 at which these six linear combinations have a common solution. The
numerical accuracy depends on which joint is suppressed (``elimination_choice``).

For a prismatic joint with displacement d, the translation Tz(d) replaces the rotation Rz(theta). In
the products of the vectors x and y, the factors 1, d and d^2 of a prismatic joint replace 1, cosine
and sine. Joints 1 and 2 of an elimination order may be prismatic. At least one of joints 4 and 5
must be revolute, because the equations use the half angle of this joint. Joints 3 and 6 of an
elimination order must be revolute.

Source:
    Raghavan and Roth, Inverse kinematics of the general 6R manipulator and related linkages,
    Journal of Mechanical Design 115 (1993).
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ...chain.poe import placement_matrix
from ...model.errors import DescriptionError
from ...model.robot import Joint, SerialRobot
from .line_quantities import COUNT, Array, motion, quantities, slide, turn

JOINTS = 6
Parts = Callable[[int], tuple[Array, Array, Array]]
"""Type of a function that takes the sign of a joint coordinate (1 or -1) and returns the three
coefficient matrices of the joint."""


@dataclass(frozen=True)
class EliminationOrder:
    """A numbering of the six joints in the loop.

    Attributes:
        joints: Indices of the joints with the numbers 1 to 6; the elimination suppresses the angle
            of joint 3.
        sense: 1 if the numbering runs from base to tool, -1 if it runs from tool to base.
        halved: 0 if the equations use the half angle of joint 4, 1 if the equations use the half
            angle of joint 5.
    """

    joints: tuple[int, ...]
    sense: int
    halved: int = 0

    @property
    def turning(self) -> frozenset[int]:
        """Indices of the three joints that must be revolute for this elimination order."""
        return frozenset(self.joints[k] for k in (2, 3 + self.halved, 5))


@dataclass(frozen=True)
class LineEquations:
    """Coefficients of the fourteen equations of Raghavan and Roth.

    Attributes:
        left: Pose-dependent coefficients (14, 9), with one constant column followed by eight
            columns for the products of joints 1 and 2.
        right: Coefficients (3, 14, 9) of 1, cos and sin of the suppressed angle.
    """

    left: Array
    right: Array


def elimination_orders(slides: Collection[int] = ()) -> list[EliminationOrder]:
    """Return every elimination order of a loop with six joints."""
    every = (
        EliminationOrder(tuple((first + sense * k) % JOINTS for k in range(JOINTS)), sense, halved)
        for sense in (1, -1)
        for first in range(JOINTS)
        for halved in (0, 1)
    )
    return [order for order in every if order.turning.isdisjoint(slides)]


def placements(robot: SerialRobot) -> list[Array]:
    """Return the exact placements (4, 4) before, between and after the joints.

    Raises:
        DescriptionError: A joint is coupled, or neither revolute nor prismatic.
    """
    if robot.couplings or not all(map(_is_free, robot.moving)):
        raise DescriptionError(
            f"{robot.name}: expected revolute or prismatic joints, each with its own coordinate"
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
    """Return the placements of an arm as float matrices, for the default parameter values."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return [
        np.array([[float(e.xreplace(values)) for e in row] for row in E]) for E in placements(robot)
    ]


def equations(
    constants: Sequence[Array], order: EliminationOrder, T: Array, slides: Collection[int] = ()
) -> LineEquations:
    """Return the fourteen equations for one elimination order.

    Args:
        constants: The seven placements of the arm, as expressions or floats.
        order: The elimination order of the joints.
        T: Target pose (4, 4), as expressions or floats.
        slides: Indices of the prismatic joints among the six joints.
    """
    inverses = _inverses(constants, order, T)
    parts = [slide if k in slides else turn for k in order.joints]
    return LineEquations(_left(inverses, parts), _right(inverses, parts))


def is_fit(robot: SerialRobot, given: Sequence[int] = (), joints: int = JOINTS) -> bool:
    """Whether the free joints have the required number and at least one elimination order.

    Args:
        robot: The description.
        given: Indices of the joints with fixed values, counted among the moving joints.
        joints: Required number of free joints.
    """
    others = [joint for k, joint in enumerate(robot.moving) if k not in given]
    slides = [k for k, joint in enumerate(others) if joint.kind == "prismatic"]
    is_free = not robot.couplings and all(map(_is_free, robot.moving))
    return len(others) == joints and is_free and bool(elimination_orders(slides))


def _is_free(joint: Joint) -> bool:
    return joint.kind in ("revolute", "prismatic")


def doubled(six: Array) -> Array:
    """Expand six equations (..., 6, 9) to twelve (..., 12, 12) in the half angle of joint 4."""
    one, c, s = six[..., :3], six[..., 3:6] / 2, six[..., 6:] / 2
    by_cos, by_sin = [c, s, one + c, s], [-s, c, s, one - c]
    return np.concatenate([np.concatenate(row, -1) for row in (by_cos, by_sin)], -2)


def suppressed(found: LineEquations, halved: int) -> Array:
    """Return the terms (..., 3, 12, 12) of the matrix M, which is singular at each solution.

    The three terms of the matrix M are its coefficients of 1, cosine and sine of the suppressed
    angle.

    Args:
        found: Coefficients of the fourteen equations, with the shapes (..., 14, 9) and (..., 3, 14,
            9).
        halved: 0 to use the half angle of joint 4, 1 to use the half angle of joint 5.
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
    """Return the tool pose (4, 4) of an arm at given joint values.

    Args:
        constants: Fixed placements before joint 1, between consecutive joints, and after the last
            joint.
        values: Joint angles or joint displacements.
        slides: Indices of the prismatic joints.
    """
    T = constants[0]
    for k, (value, E) in enumerate(zip(values, constants[1:], strict=True)):
        T = T @ moved(value, k in slides) @ E
    return T


def moved(value: float, slides: bool) -> Array:
    """Return the motion (4, 4) of a revolute joint about z or a prismatic joint along z."""
    return _raised(value) if slides else turned(value)


def turned(angle: float) -> Array:
    """Return the matrix (4, 4) of a rotation about z by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def _raised(height: float) -> Array:
    T = np.eye(4)
    T[2, 3] = height
    return T


def _inverses(constants: Sequence[Array], order: EliminationOrder, T: Array) -> list[Array]:
    before, *between, behind = constants
    if order.sense > 0:
        closing = [*(_inverse(E) for E in between), _inverse(before) @ T @ _inverse(behind)]
        return [closing[k] for k in order.joints]
    closing = [*between, behind @ _inverse(T) @ before]
    return [closing[(k - 1) % JOINTS] for k in order.joints]


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
