"""The displacement that a chain of joints has to make.

A chain of screw motions displaces the body that it carries from the home pose by

    G = exp(S_1 theta_1) ... exp(S_n theta_n) = T_0_ee M_0_ee^-1.

Families ask a target for the image of a direction and for the image of a point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...terms.terms import Terms
from ...terms.vectors import IDENTITY, Basis, Vector, added, combination, subtracted
from ..subproblems.turns import CosSin, rotated


@dataclass(frozen=True)
class Target:
    """A displacement: its rotation, and one point before and after it.

    Attributes:
        axes: The columns of the rotation.
        home: A point before the displacement, in base axes (metre).
        position: The same point after it.
    """

    axes: Basis
    home: Vector
    position: Vector

    def turned(self, terms: Terms, direction: Vector) -> Vector:
        """A direction of the body that is carried, after the displacement."""
        return combination(terms, direction, self.axes)

    def point(self, terms: Terms, point: Vector) -> Vector:
        """A point of the body that is carried, after the displacement.

        Only the vector from ``home`` is turned, so that a wrist's centre near the tool keeps its
        digits far from the base.
        """
        return added(terms, self.position, self.turned(terms, subtracted(terms, point, self.home)))

    def reversed(self) -> "Target":
        """The inverse displacement, which the chain has to make when it is read from the tool."""
        x, y, z = zip(*self.axes, strict=True)
        return Target((x, y, z), self.position, self.home)

    def without_last(self, terms: Terms, k: Vector, p: Vector, turn: CosSin) -> "Target":
        """The target of the joints before the last: ``G exp(S_n theta_n)^-1``."""
        kept = tuple(rotated(terms, k, turn.back, e) for e in IDENTITY)
        axes = tuple(self.turned(terms, e) for e in kept)
        lever = rotated(terms, k, turn, subtracted(terms, self.home, p))
        return Target((axes[0], axes[1], axes[2]), added(terms, p, lever), self.position)

    def shifted(self, terms: Terms, by: Vector) -> "Target":
        """The target before a translation: ``G Trans(by)^-1``."""
        return Target(self.axes, added(terms, self.home, by), self.position)


def of_pose(terms: Terms, pose: Sequence[sp.Expr], home: sp.Matrix) -> Target:
    """The target of a chain that has to bring its tool to a pose.

    Args:
        terms: Names of all terms.
        pose: The sixteen entries of ``T_0_ee``, row by row.
        home: ``M_0_ee`` (4, 4), the tool's pose with every joint at zero.
    """
    columns: Basis = tuple(tuple(pose[4 * i + j] for i in range(3)) for j in range(3))  # type: ignore[assignment]
    rows = [[terms.let(home[i, j]) for j in range(3)] for i in range(3)]
    x, y, z = (combination(terms, row, columns) for row in rows)
    origin = tuple(terms.let(home[i, 3]) for i in range(3))
    position = (pose[3], pose[7], pose[11])
    return Target((x, y, z), (origin[0], origin[1], origin[2]), position)
