"""The result of `ik_nearest`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..tolerances import SOLVED
from .solutions import Fields


class NearestSolution(Fields):
    """One solution per pose, as in `q, residual, margin, valid = robot.ik_nearest(T, q_seed)`.

    Attributes:
        q: (..., n) coordinates [rad or m]. NaN without a solution.
        residual: (...,) tool error [m], as in `Solutions`. Without a solution, the smallest
            residual of all branches.
        margin: (...,) margin of the branch, as in `Solutions`.
        valid: (...,) whether a solution exists within the limits.
        tolerance: Maximum residual of a solution [m].
    """

    __slots__ = ()

    tolerance: ClassVar[float] = SOLVED
    _limited: ClassVar[Any] = False
    """Whether joint limits exclude all solutions for a pose with rounded entries."""

    @property
    def reason(self) -> Any:
        """The reason for a missing solution: "", "out of reach", "limits" or "not a pose".

        The reason is a str for a single pose, and an array (...,) for a batch. A pose with NaN is
        "not a pose".
        """
        reached = (self.residual <= self.tolerance) | self._limited
        found = np.select(
            [self.valid, np.isnan(self.residual), reached],
            ["", "not a pose", "limits"],
            "out of reach",
        )
        return found[()] if found.ndim else str(found)

    def __repr__(self) -> str:
        if np.ndim(self.valid):
            count = int(np.count_nonzero(self.valid))
            return f"<nearest solutions of {np.size(self.valid)} poses: {count} valid>"
        if not self.valid:
            return f"<no nearest solution: {self.reason}, residual {self.residual:.3g}>"
        q = ", ".join(f"{value:.6g}" for value in self.q)
        return f"<nearest solution q = ({q}), margin {self.margin:.3g}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, (self.tolerance, self._limited, tuple(self))


@cache
def nearest_type(tolerance: float) -> type[NearestSolution]:
    """Return the subclass of `NearestSolution` whose tolerance is `tolerance` [m]."""
    return _made(tolerance, False)


def limited_type(tolerance: float, limited: BoolArray) -> type[NearestSolution]:
    """Return the result class for rounded poses."""
    return _made(tolerance, limited[()])


def _made(tolerance: float, limited: Any) -> type[NearestSolution]:
    about = {"__slots__": (), "__module__": __name__, "__doc__": NearestSolution.__doc__}
    facts = {"tolerance": tolerance, "_limited": limited}
    return type("NearestSolution", (NearestSolution,), {**about, **facts})


def _restore(tolerance: float, limited: Any, fields: tuple[Any, ...]) -> NearestSolution:
    kind = nearest_type(tolerance) if limited is False else _made(tolerance, limited)
    return kind(*fields)


@dataclass(frozen=True)
class Moves:
    """The distance and the limits for selecting a solution.

    Attributes:
        lower: (n,) lower limits of the coordinates [rad or m], -inf for none. For a robot with m
            coupled joints, the shape is (n + m,), and the lower limits of the joints come last.
        upper: Upper limits, inf for none.
        scale: (n,) weights of the displacements.
        turn: (n,) the period 2 pi of coordinates that wrap, otherwise 0.
    """

    lower: FloatArray
    upper: FloatArray
    scale: FloatArray
    turn: FloatArray

    @property
    def arrays(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """The arrays for the C code: lower limits, upper limits, weights and periods."""
        return self.lower, self.upper, self.scale, self.turn

    def distance(self, q: FloatArray, q_seed: FloatArray) -> FloatArray:
        """Return the largest weighted displacement (...,) from a seed (..., n) to q (..., n)."""
        return np.asarray((np.abs(q - q_seed) * self.scale).max(-1))

    def with_fixed(self, fixed: tuple[int, ...], *, free: bool = False) -> Moves:
        """Return a copy for fixed coordinates.

        The weights of the fixed coordinates become 0 unless `free` is True.
        """
        scale, turn = self.scale.copy(), self.turn.copy()
        turn[list(fixed)] = 0.0
        if not free:
            scale[list(fixed)] = 0.0
        return Moves(self.lower, self.upper, scale, turn)
