"""Describes the singular configurations of an arm in symbols and words."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle

import sympy as sp

from ...chain.singular.conditions import Condition, conditions
from ...chain.singular.determinant import factored_minors
from ...chain.singular.factors import Factored
from ...chain.singular.nearest import general_rank, nearest_singular
from ...chain.singular.singular_configurations import words
from ...model.robot import Parameter, SerialRobot
from .notation import Notation

MAX_ADDENDS = 12
"""Maximum number of terms in a printed factor of a Jacobian determinant."""
CONFIGURATIONS = 4
"""Number of singular configurations that are printed if the factors of the Jacobian determinant are
too long to print."""
GENERIC = sp.Rational(271, 379)
"""Generic value (radian or meter) of the first fixed coordinate. The printed sentence about the
joint axes is tested at this value."""
ANGLES = (20, -50, 70, 30, 40, -60, 10, 25)
"""Joint angles (degree) at which the search for a singular configuration starts, used cyclically.
"""


@dataclass(frozen=True)
class PrintedCondition:
    """Factors that are zero together in some singular configurations of an arm.

    Attributes:
        factors: The factors that are zero together, written with short symbols.
        words: Description of how the joint axes lie if all factors are zero, or an empty text.
    """

    factors: tuple[sp.Expr, ...]
    words: str


@dataclass(frozen=True)
class PrintedSingularities:
    """The singular configurations of an arm.

    Attributes:
        determinant: Constant and factors (with exponents) of the Jacobian determinant, or None if
            the Jacobian is not square or the factors are long.
        conditions: The conditions under which the arm is singular.
        configurations: Singular configurations (radian, meter), or () if the singularity conditions
            are short enough to be printed.
        fixed: Coordinates of the joints that are fixed in the determinant, or () if no joint is
            fixed.
        rank: Largest rank of the Jacobian if every configuration is singular, otherwise None.
        is_regular: Whether the Jacobian has full rank in every configuration.
    """

    determinant: tuple[sp.Expr, tuple[tuple[sp.Expr, int], ...]] | None
    conditions: tuple[PrintedCondition, ...]
    configurations: tuple[tuple[float, ...], ...] = ()
    fixed: tuple[sp.Symbol, ...] = ()
    rank: int | None = None
    is_regular: bool = False


def printed_singularities(
    robot: SerialRobot, notation: Notation, given: Sequence[int] = ()
) -> PrintedSingularities:
    """Return the singular configurations of a robot.

    Args:
        robot: A serial robot.
        notation: The short symbols of the robot.
        given: Indices of the coordinates that are fixed in the inverse kinematics. If the
            singularity conditions of the complete arm are long, the LaTeX article also prints the
            conditions for the free joints alone.
    """
    minors = factored_minors(robot, notation.q)
    if minors == ():
        return PrintedSingularities(None, (), rank=general_rank(robot))
    if minors is not None and not all(minor.factors for minor in minors):
        # If a minor of the Jacobian has no factors, the minor is a nonzero constant, and no
        # configuration is singular.
        return PrintedSingularities(None, (), is_regular=True)
    if minors is not None and all(map(_is_short, minors)):
        if len(minors) == 1:
            return _of_determinant(robot, notation.q, notation, minors[0])
        values = {parameter.symbol: parameter.value for parameter in robot.parameters}
        found = conditions(minors, notation.q, values)
        if found:
            return PrintedSingularities(None, _printed(robot, notation.q, notation, found))
    start = [
        math.radians(angle) if joint.unit == "rad" else 0.0
        for joint, angle in zip(robot.moving, cycle(ANGLES), strict=False)
    ]
    configurations = nearest_singular(robot, start, CONFIGURATIONS)
    numbers = tuple(tuple(map(float, q)) for q in configurations)
    return replace(_singularities_with_fixed_joints(robot, notation, given), configurations=numbers)


def _singularities_with_fixed_joints(
    robot: SerialRobot, notation: Notation, given: Sequence[int]
) -> PrintedSingularities:
    if not given:
        return PrintedSingularities(None, ())
    values = {robot.moving[k].name: notation.q[k] for k in given}
    joints = [
        joint.fixed_at(joint.direction * values[joint.name]) if joint.name in values else joint
        for joint in robot.joints
    ]
    # The values of the fixed joints remain symbols, because the determinant may depend on them. The
    # printed geometric condition is tested with the fixed joints at generic values.
    some = [Parameter(str(q), k * GENERIC) for k, q in enumerate(values.values(), 1)]
    q = [symbol for k, symbol in enumerate(notation.q) if k not in given]
    rest = replace(robot, joints=tuple(joints), parameters=(*robot.parameters, *some))
    minors = factored_minors(rest, q)
    if minors is None or len(minors) != 1 or not _is_short(minors[0]):
        return PrintedSingularities(None, ())
    found = _of_determinant(rest, q, notation, minors[0])
    numbers = [k for k in range(1, len(notation.q) + 1) if k - 1 not in given]
    return replace(
        found,
        conditions=tuple(_counted(condition, numbers) for condition in found.conditions),
        fixed=tuple(notation.q[k] for k in given),
    )


def _counted(condition: PrintedCondition, numbers: Sequence[int]) -> PrintedCondition:
    counted = re.sub(r"\d+", lambda found: str(numbers[int(found[0]) - 1]), condition.words)
    return replace(condition, words=counted)


def _is_short(minor: Factored) -> bool:
    return all(len(sp.Add.make_args(factor)) <= MAX_ADDENDS for factor, _ in minor.factors)


def _of_determinant(
    robot: SerialRobot, q: Sequence[sp.Symbol], notation: Notation, found: Factored
) -> PrintedSingularities:
    constant = -found.constant if found.constant.could_extract_minus_sign() else found.constant
    factors = tuple((_short(factor, notation), power) for factor, power in found.factors)
    each = _printed(robot, q, notation, tuple((factor,) for factor, _ in found.factors))
    return PrintedSingularities((_short(constant, notation), factors), each)


def _printed(
    robot: SerialRobot, q: Sequence[sp.Symbol], notation: Notation, found: tuple[Condition, ...]
) -> tuple[PrintedCondition, ...]:
    return tuple(
        PrintedCondition(
            tuple(_short(factor, notation) for factor in condition),
            words(robot, q, condition),
        )
        for condition in found
    )


def _short(factor: sp.Expr, notation: Notation) -> sp.Expr:
    functions = sorted(factor.atoms(sp.cos, sp.sin), key=str)
    return factor.xreplace({function: notation.trigonometric(function) for function in functions})
