"""The displacement that the joints of a chain must produce.

The displacement of the last body from its home pose is ``G = exp(S_1 theta_1) ... exp(S_n theta_n)
= T_0_ee M_0_ee^-1``.

A ``Target`` applies the displacement G to directions and points.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...terms.terms import Terms
from ...terms.vectors import IDENTITY, Basis, Vector, added, combination, subtracted
from ..subproblems.turns import CosSin, rotated


@dataclass(frozen=True)
class Target:
    """The required displacement of the last body of the chain.

    The displacement is stored as a rotation, and as the positions of one body point before and
    after the displacement.

    Attributes:
        axes: The columns of the rotation matrix of the displacement.
        home: Position of the body point before the displacement, in base axes (meter).
        position: Position of the body point after the displacement, in base axes (meter).
    """

    axes: Basis
    home: Vector
    position: Vector

    def turned(self, terms: Terms, direction: Vector) -> Vector:
        """Rotate a direction of the last body by the rotation of the displacement."""
        return combination(terms, direction, self.axes)

    def point(self, terms: Terms, point: Vector) -> Vector:
        """Return the position of a point of the last body after the displacement.

        The rotation applies only to the vector from the body point ``home`` to ``point``.
        Therefore, the position of a wrist center near the tool is accurate even if the tool is far
        from the base.
        """
        return added(terms, self.position, self.turned(terms, subtracted(terms, point, self.home)))

    def reversed(self) -> "Target":
        """Return the inverse displacement.

        The inverse displacement is the target of a chain whose joints are numbered from the tool.
        """
        x, y, z = zip(*self.axes, strict=True)
        return Target((x, y, z), self.position, self.home)

    def without_last(self, terms: Terms, k: Vector, p: Vector, turn: CosSin) -> "Target":
        """Return ``G exp(S_n theta_n)^-1``, the displacement without the last joint's motion."""
        kept = tuple(rotated(terms, k, turn.back, e) for e in IDENTITY)
        axes = tuple(self.turned(terms, e) for e in kept)
        lever = rotated(terms, k, turn, subtracted(terms, self.home, p))
        return Target((axes[0], axes[1], axes[2]), added(terms, p, lever), self.position)

    def shifted(self, terms: Terms, by: Vector) -> "Target":
        """Return ``G Trans(by)^-1``, the displacement G without a final translation."""
        return Target(self.axes, added(terms, self.home, by), self.position)


def of_pose(terms: Terms, pose: Sequence[sp.Expr], home: sp.Matrix) -> Target:
    """Return the target of a chain for a tool pose.

    Args:
        terms: Table of named terms.
        pose: The sixteen entries of ``T_0_ee``, row by row.
        home: ``M_0_ee`` (4, 4), the tool pose with all joints at zero.
    """
    columns: Basis = tuple(tuple(pose[4 * i + j] for i in range(3)) for j in range(3))  # type: ignore[assignment]
    rows = [[terms.let(home[i, j]) for j in range(3)] for i in range(3)]
    x, y, z = (combination(terms, row, columns) for row in rows)
    origin = tuple(terms.let(home[i, 3]) for i in range(3))
    position = (pose[3], pose[7], pose[11])
    return Target((x, y, z), (origin[0], origin[1], origin[2]), position)
