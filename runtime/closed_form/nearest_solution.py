"""The solution of an inverse nearest to a seed: the result, and the options of the choice."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..tolerances import SOLVED
from .solutions import Fields


class NearestSolution(Fields):
    """One solution for each pose: `q, residual, margin, valid = robot.ik_nearest(T, q_seed)`.

    Attributes:
        q: (..., n) coordinates [rad or m]; NaN where there is no solution.
        residual: (...,) error of the tool [m], as in `Solutions`; where there is no solution, the
            error of the branch closest to the pose.
        margin: (...,) margin of the same branch: 0 at the border of reach, negative beyond.
        valid: (...,) whether there is a solution within the limits.
        tolerance: Largest residual of a solution [m].
    """

    __slots__ = ()

    tolerance: ClassVar[float] = SOLVED
    _limited: ClassVar[Any] = False
    """Whether limits removed solutions of a rounded pose, whose residual is above the tolerance."""

    @property
    def reason(self) -> Any:
        """Why there is no solution: "", "out of reach", "limits" or "not a pose".

        A str for a single pose, else an array of them (...,). "not a pose": NaN in an input.
        """
        reached = (self.residual <= self.tolerance) | self._limited
        found = np.select(
            [self.valid, np.isnan(self.residual), reached],
            ["", "not a pose", "limits"],
            "out of reach",
        )
        return found[()] if found.ndim else str(found)

    def __repr__(self) -> str:
        """The solution of a pose, or the number of solutions of a batch."""
        if np.ndim(self.valid):
            count = int(np.count_nonzero(self.valid))
            return f"<nearest solutions of {np.size(self.valid)} poses: {count} valid>"
        if not self.valid:
            return f"<no nearest solution: {self.reason}, residual {self.residual:.3g}>"
        q = ", ".join(f"{value:.6g}" for value in self.q)
        return f"<nearest solution q = ({q}), margin {self.margin:.3g}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the facts of its class and the tuple."""
        return _restore, (self.tolerance, self._limited, tuple(self))


@cache
def nearest_type(tolerance: float) -> type[NearestSolution]:
    """The class of results with a largest residual of a solution [m]."""
    return _made(tolerance, False)


def limited_type(tolerance: float, limited: BoolArray) -> type[NearestSolution]:
    """The class of results in which limits removed solutions (...,) of rounded poses."""
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
    """The meaning of a move of each coordinate, for the choice among solutions.

    Attributes:
        lower: (n,) lower limits [rad or m], -inf for none.
        upper: (n,) upper limits [rad or m], inf for none.
        scale: (n,) factors of the moves in the distance.
        turn: (n,) 2 pi where a full turn leaves the pose unchanged, else 0.
    """

    lower: FloatArray
    upper: FloatArray
    scale: FloatArray
    turn: FloatArray

    @property
    def arrays(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """The four arrays, for the compiled selection."""
        return self.lower, self.upper, self.scale, self.turn

    def distance(self, q: FloatArray, q_seed: FloatArray) -> FloatArray:
        """The largest weighted move (...,) from a seed (..., n) to q (..., n)."""
        return np.asarray((np.abs(q - q_seed) * self.scale).max(-1))

    def with_fixed(self, fixed: tuple[int, ...], *, free: bool = False) -> Moves:
        """The moves where some coordinates keep their values; `free` ones still have a distance."""
        scale, turn = self.scale.copy(), self.turn.copy()
        turn[list(fixed)] = 0.0
        if not free:
            scale[list(fixed)] = 0.0
        return Moves(self.lower, self.upper, scale, turn)
