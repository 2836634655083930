"""The minors of an arm's Jacobian in factors: the arm is singular where all of them are 0.

A square Jacobian has one, its determinant. The twist of the tool by the joints is written in the
view in which the minor falls into the smallest blocks (:mod:`.views`), and is the product of the
determinants of these blocks.
"""

import math
from collections.abc import Sequence

import sympy as sp

from ...model.robot import Rotation, SerialRobot
from ..poe import product_of_exponentials
from .factors import Factored, factored
from .screw_polynomials import Polynomial, ScrewRing
from .views import Minor, minors

MOST_JOINTS = 7
"""Joints of which all minors are written out."""
LARGEST_BLOCK = 4
"""Most joints of a block whose determinant is written out."""
LARGEST_OF_SEVERAL = 3
"""The same where there are several minors."""

MOST_OBLIQUE = 4
"""Most constant turns that are no quarter turns: each doubles the terms of what it turns."""
LONGEST_ENTRY = 40
"""Most terms of an entry of a Jacobian."""
MOST_PRODUCTS = 10_000
"""Most products of entries' terms in the determinant of a block."""


def determinant(robot: SerialRobot, q: Sequence[sp.Symbol]) -> Factored | None:
    """The determinant of the Jacobian of the coordinates that a robot's tool can move in.

    Args:
        robot: A serial robot, whose joints each have a coordinate.
        q: Its coordinates.

    Returns:
        The determinant of the rows that are not 0 in the frame where it is written, up to sign;
        None where these are not as many as the joints, or as :func:`factored_minors`.
    """
    found = factored_minors(robot, q)
    return found[0] if found and len(found) == 1 else None


def factored_minors(robot: SerialRobot, q: Sequence[sp.Symbol]) -> tuple[Factored, ...] | None:
    """The largest minors of the Jacobian, those that are always 0 left out.

    Args:
        robot: A serial robot, whose joints each have a coordinate.
        q: Its coordinates.

    Returns:
        The minors in factors, up to their signs. The robot is singular where all are 0; () where
        all are 0 in every configuration. None where a joint follows another or advances as it
        turns, where the description has decimals that are not exact, or where a minor does not
        fall into small blocks.
    """
    joints = robot.moving
    if len(q) != len(joints) or any(j.mimic or j.kind == "helical" for j in joints):
        return None
    if len(joints) > MOST_JOINTS or _oblique(robot) > MOST_OBLIQUE:
        return None
    S, _ = product_of_exponentials(robot)
    S = S * sp.diag(*(joint.direction for joint in joints))
    if not _is_exact(S):
        return None
    values = {parameter.symbol: float(parameter.value) for parameter in robot.parameters}
    found = minors(robot, S, values)
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
    """The number of constant turns between the joints that are no quarter turns."""
    return sum(
        not (2 * motion.angle / sp.pi).is_Integer
        for placement in robot.placements[:-1]
        for motion in placement
        if isinstance(motion, Rotation)
    )


def _is_exact(S: sp.Matrix) -> bool:
    """Whether all entries are polynomials in parameters, fractions, roots, cosines and sines."""
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
    """A minor as the product of its blocks' determinants; the constant 0 where one is always 0."""
    constant, factors = sp.S.One, dict[sp.Expr, int]()
    for rows, numbers in minor.blocks:
        block = [[columns[k][row] for row in rows] for k in numbers]
        if math.prod(sum(map(len, column)) for column in block) > MOST_PRODUCTS:
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
