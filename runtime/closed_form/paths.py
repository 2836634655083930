"""A path of poses followed on one branch of the inverse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..call._call import Function
from ..call.capabilities import needs
from ..contract.facts import Argument, Coordinate
from ..errors import InputValueError, ShapeError
from ..tolerances import JUMP, SOLVED
from .hints import no_inverse
from .polish import polish
from .solutions import Solutions, within

FloatArray = NDArray[np.float64]

Reason = Literal["", "no solution", "jump", "limit"]


@dataclass(frozen=True, slots=True)
class Path:
    """How far a path of poses was followed on one branch.

    Attributes:
        q: (reached, n) coordinates [rad or m]; joints that turn go on beyond a turn, with no jump.
        complete: Whether the last pose was reached.
        ended_at: The index of the first pose that was not reached, the number of poses if all were.
        reason: "" if complete; "no solution": no branch reaches that pose; "jump": some do, but the
            nearest is further than a joint may go; "limit": the branch goes on beyond a limit.
        joint: The coordinate that would jump or pass its limit, "" for another reason.
        would_be: The value that it would go to, NaN for another reason.
        smallest_margin: The smallest margin on the way, 0 at the border of reach (a stretched
            elbow, not a wrist in line); NaN if nothing was reached.
        smallest_margin_at: The index of that pose, -1 if nothing was reached.
        largest_step: (n,) the largest move of each coordinate from a pose to the next.
    """

    q: FloatArray
    complete: bool
    ended_at: int
    reason: Reason
    joint: str
    would_be: float
    smallest_margin: float
    smallest_margin_at: int
    largest_step: FloatArray

    def __str__(self) -> str:
        """In a sentence."""
        if self.complete:
            return f"all {len(self.q)} poses on one branch, margin {self.smallest_margin:.3g}"
        why = {
            "no solution": "no branch reaches it",
            "jump": f"{self.joint} would jump to {self.would_be:.4g}",
            "limit": f"{self.joint} would go to {self.would_be:.4g}, beyond its limit",
        }
        return f"ended at pose {self.ended_at}: {why[self.reason]}"


@dataclass(frozen=True, slots=True)
class _Step:
    """Where a pose is on the branch, or why it is not."""

    q: FloatArray
    margin: float
    reason: Reason = ""
    joint: int = 0


def _has_inverse(robot: InverseMethods) -> bool:
    return ("inverse", "pose", "") in robot._roles


class InverseMethods:
    """The part of a robot that an inverse brings along."""

    name: str
    n: int
    coordinates: tuple[Coordinate, ...]
    lower: FloatArray
    upper: FloatArray
    functions: Mapping[str, Function[Any]]
    redundancy: tuple[Argument, ...]
    _roles: Mapping[tuple[str, str, str], Function[Any]]
    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]]

    @needs(when=_has_inverse, hint=no_inverse)
    def ik_path(self, T: ArrayLike, seed: ArrayLike, *given: ArrayLike, jump: float = JUMP) -> Path:
        """Follows one branch along a path of poses, from the solution nearest to a seed.

        At each pose it goes to the solution that moves the joints least from the pose before, turn
        for turn. That follows the branch itself rather than its slot: at a singularity branches
        meet and slots may change places. Where a continuum of solutions reaches a pose (a wrist
        with two axes in line), the one nearby is found by Newton's iteration. A path ends where it
        would have to leave the robot's limits, although another branch might go on.

        Args:
            T: (m, 4, 4) poses of the tool in the base frame, close to each other.
            seed: (n,) where to begin [rad or m]: the path takes the nearest solution within the
                limits.
            given: What else `ik` takes (`redundancy`), each () or (m,).
            jump: How far a joint may go from a pose to the next [rad or m].

        Returns:
            The coordinates as far as they go, and why no further.

        Raises:
            ShapeError: If T is not a list of poses, or the seed not n values.
            InputValueError: If jump is not positive.
        """
        poses, start = np.asarray(T, np.float64), np.asarray(seed, np.float64)
        if poses.ndim != 3 or start.shape != (self.n,):  # noqa: PLR2004
            raise ShapeError(
                f"{self.name}.ik_path: expected T (m, 4, 4) and seed ({self.n},), got shapes "
                f"{poses.shape} and {start.shape}"
            )
        if not jump > 0:
            raise InputValueError(f"{self.name}.ik_path: jump must be positive, got {jump!r}")
        solutions = self._roles["inverse", "pose", ""](poses, *given)
        if solutions.q.shape[:-2] != poses.shape[:1]:
            raise ShapeError(f"{self.name}.ik_path: what else is given must be () or (m,)")
        steps: list[_Step] = []
        for index, pose in enumerate(poses):
            slots = solutions.at(index)
            step = (
                self._next(slots, pose, steps[-1].q, jump) if steps else self._first(slots, start)
            )
            if step.reason:
                return self._report(steps, step)
            steps.append(step)
        return self._report(steps, None)

    def _first(self, slots: Solutions, seed: FloatArray) -> _Step:
        if not slots.valid.any():
            return _Step(seed, np.nan, "no solution")
        inside = slots.within_limits(self.lower, self.upper)
        allowed = inside if inside.valid.any() else slots
        moves = allowed.moves_from(seed)
        best = _least(moves, allowed.valid)
        q, margin = seed + moves[best], float(allowed.margin[best])
        if allowed is inside:
            return _Step(q, margin)
        outside = ~within(q, self.lower, self.upper)
        return _Step(q, margin, "limit", int(np.argmax(outside)))

    def _next(self, slots: Solutions, pose: FloatArray, here: FloatArray, jump: float) -> _Step:
        if not slots.valid.any():
            return _Step(here, np.nan, "no solution")
        moves = slots.moves_from(here)
        best = _least(moves, slots.valid)
        move, margin = moves[best], float(slots.margin[best])
        if np.abs(move).max() > jump:
            nearby = self._nearby(pose, here)
            if nearby is None or np.abs(nearby - here).max() > jump:
                return _Step(here + move, margin, "jump", int(np.argmax(np.abs(move))))
            move = nearby - here
        q = here + move
        outside = ~within(q, self.lower, self.upper)
        if outside.any():
            return _Step(q, margin, "limit", int(np.argmax(outside)))
        return _Step(q, margin)

    def _nearby(self, pose: FloatArray, here: FloatArray) -> FloatArray | None:
        """A solution that the last one leads to, where the pose alone determines them."""
        if ("pose and jacobian", "actuators", "") not in self._roles or self.redundancy:
            return None
        q, residual = polish(self, pose, here)
        return q if residual <= SOLVED else None

    def _report(self, steps: list[_Step], end: _Step | None) -> Path:
        q = np.array([step.q for step in steps]).reshape(-1, self.n)
        margins = np.array([step.margin for step in steps])
        least = int(np.argmin(margins)) if steps else -1
        blamed = end is not None and end.reason != "no solution"
        return Path(
            q=q,
            complete=end is None,
            ended_at=len(steps),
            reason=end.reason if end else "",
            joint=self.coordinates[end.joint].name if end and blamed else "",
            would_be=float(end.q[end.joint]) if end and blamed else np.nan,
            smallest_margin=float(margins[least]) if steps else np.nan,
            smallest_margin_at=least,
            largest_step=np.abs(np.diff(q, axis=0)).max(0, initial=0.0),
        )


def _least(moves: FloatArray, valid: NDArray[np.bool_]) -> int:
    """The valid slot with the smallest largest move."""
    return int(np.argmin(np.where(valid, np.abs(moves).max(-1), np.inf)))
