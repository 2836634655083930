"""Factored minors of the Jacobian of an arm. The arm is singular if all minors are 0.

The only maximal minor of a square Jacobian is its determinant. A minor is the product of the
determinants of its diagonal blocks. The module ``views`` selects the frame and the reference point
for which the diagonal blocks of the minors are smallest.
"""

import math
from collections.abc import Sequence

import sympy as sp

from ...model.robot import Rotation, SerialRobot
from ..poe import product_of_exponentials
from .factors import Factored, factored
from .screw_polynomials import Polynomial, ScrewRing
from .views import Minor, minors

MAX_JOINTS = 7
"""If an arm has more joints than this number, the minors of its Jacobian are not expanded."""
LARGEST_BLOCK = 4
"""Maximum size of a block whose determinant is expanded, for a square Jacobian."""
LARGEST_OF_SEVERAL = 3
"""Maximum size of a block whose determinant is expanded, for a Jacobian that is not square."""

MAX_OBLIQUE = 4
"""Maximum number of constant rotations by angles that are not multiples of 90 degrees."""
LONGEST_ENTRY = 40
"""If a Jacobian entry has more terms than this number, the minors are not expanded."""
MAX_PRODUCTS = 10_000
"""Maximum number of products of terms in the determinant of a block."""


def determinant(robot: SerialRobot, q: Sequence[sp.Symbol]) -> Factored | None:
    """Return the determinant of the nonzero rows of a robot's Jacobian.

    Args:
        robot: A serial robot without couplings.
        q: The coordinates.

    Returns:
        The determinant of the nonzero Jacobian rows, up to sign. If the numbers of nonzero rows and
        joints differ, or ``factored_minors`` returns None, the function returns None.
    """
    found = factored_minors(robot, q)
    return found[0] if found and len(found) == 1 else None


def factored_minors(robot: SerialRobot, q: Sequence[sp.Symbol]) -> tuple[Factored, ...] | None:
    """Return the maximal minors of the Jacobian.

    Minors that are always 0 are omitted.

    Args:
        robot: A serial robot without couplings.
        q: The coordinates.

    Returns:
        The factored minors, up to sign. The robot is singular where all minors are 0. The tuple of
        minors is empty if the robot is singular in every configuration. ``factored_minors`` returns
        None for coupled or helical joints, and for lengths that contain pi or inexact decimal
        numbers. ``factored_minors`` also returns None if a symbolic determinant would contain too
        many joints.
    """
    joints = robot.moving
    if len(q) != len(joints) or robot.couplings or any(j.kind == "helical" for j in joints):
        return None
    if len(joints) > MAX_JOINTS or _oblique(robot) > MAX_OBLIQUE:
        return None
    S, _ = product_of_exponentials(robot)
    S = S * sp.diag(*(joint.direction for joint in joints))
    if not _is_exact(S):
        return None
    values = {parameter.symbol: float(parameter.value) for parameter in robot.parameters}
    found = minors(robot, S, values)
    # The coordinates of reference points may contain lengths that do not occur in the screws.
    if not all(_is_exact(minor.view.point) for minor in found):
        return None
    most = LARGEST_BLOCK if len(found) == 1 else LARGEST_OF_SEVERAL
    if max((minor.size for minor in found), default=0) > most:
        return None
    ring = ScrewRing(S, q, [minor.view.point for minor in found])
    columns = {}
    for minor in found:
        seen = ring.matrix(minor.view, LONGEST_ENTRY)
        if seen is None:
            return None
        columns[minor.view.key] = seen
    written = [_product(ring, minor, columns[minor.view.key]) for minor in found]
    if any(part is None for part in written):
        return None
    return tuple(part for part in written if part and part.constant != 0)


def _oblique(robot: SerialRobot) -> int:
    return sum(
        not (2 * motion.angle / sp.pi).is_Integer
        for placement in robot.placements[:-1]
        for motion in placement
        if isinstance(motion, Rotation)
    )


def _is_exact(S: sp.Matrix) -> bool:
    functions = S.atoms(sp.cos, sp.sin) | {p for p in S.atoms(sp.Pow) if p.base.is_Integer}
    if any(entry.has(sp.Float) for entry in S):
        return False
    hidden = S.xreplace({function: sp.Dummy() for function in functions})
    return all(
        entry.is_polynomial(*entry.free_symbols)
        and not entry.has(sp.Function)
        and all(part.is_Rational or part.is_Symbol for part in entry.atoms())
        and not any(power.base.is_number for power in entry.atoms(sp.Pow))
        for entry in hidden
    )


def _product(ring: ScrewRing, minor: Minor, columns: list[list[Polynomial]]) -> Factored | None:
    """Return a minor as the product of the determinants of its blocks."""
    constant, factors = sp.S.One, dict[sp.Expr, int]()
    for rows, numbers in minor.blocks:
        block = [[columns[k][row] for row in rows] for k in numbers]
        if math.prod(sum(map(len, column)) for column in block) > MAX_PRODUCTS:
            return None
        found = ring.block(block, range(len(rows)))
        if found == 0:
            return Factored(sp.S.Zero, ())
        parts = factored(ring, found)
        if parts is None:
            return None
        constant *= parts.constant
        for factor, power in parts.factors:
            factors[factor] = factors.get(factor, 0) + power
    return Factored(constant, tuple(factors.items()))
