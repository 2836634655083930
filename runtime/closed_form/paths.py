"""Paths of poses, followed on one branch of the inverse."""

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
from ..se3 import projected
from ..tolerances import JUMP, SOLVED
from .hints import no_inverse
from .refinement import Refinement
from .solutions import Solutions, within

FloatArray = NDArray[np.float64]

Reason = Literal["", "no solution", "jump", "limit"]


@dataclass(frozen=True, slots=True)
class Path:
    """A path of poses, as far as it was followed on one branch.

    Attributes:
        q: (reached, n) coordinates [rad or m]; turning joints continue beyond a turn without a
            jump.
        complete: Whether the last pose was reached.
        ended_at: The index of the first pose that was not reached, the number of poses if all were.
        reason: "" if complete; "no solution": no branch reaches that pose; "jump": branches reach
            it, but the nearest is further than a joint may move; "limit": the branch continues
            beyond a limit.
        joint: The coordinate that would jump or pass its limit, "" for other reasons.
        would_be: The value that this coordinate would take, NaN for other reasons.
        smallest_margin: The smallest margin on the path, 0 at the border of reach (a stretched
            elbow, not a wrist in line); NaN if no pose was reached.
        smallest_margin_at: The index of that pose, -1 if no pose was reached.
        largest_step: (n,) the largest move of each coordinate between successive poses.
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
    """The coordinates of a pose on the branch, or the reason why it has none."""

    q: FloatArray
    margin: float
    reason: Reason = ""
    joint: int = 0


def _has_inverse(robot: InverseMethods) -> bool:
    return ("inverse", "pose", "") in robot._roles


class InverseMethods:
    """The methods of a robot with a closed-form inverse."""

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
    def ik_path(
        self, T: ArrayLike, seed: ArrayLike, *given: ArrayLike, jump: float | None = None
    ) -> Path:
        """Follows one branch along a path of poses, from the solution nearest to a seed.

        Each step takes the solution that moves the joints least from the pose before, turns
        included. So the path follows the branch itself rather than its slot: at a singularity
        branches meet and slots may be exchanged. Where a continuum of solutions reaches a pose (a
        wrist with two axes in line), Newton's iteration finds the solution nearby. A path ends
        where it would have to leave the robot's limits, even if another branch would continue.

        Args:
            T: (m, 4, 4) poses of the tool measured and expressed in the base frame, close to each
                other; the nearest rigid pose is taken where one is off by at most
                `se3.NEARLY_RIGID`.
            seed: (n,) coordinates [rad or m] near the start: the path begins at the nearest
                solution within the limits.
            given: The further inputs of `ik` (`redundancy`), each () or (m,).
            jump: Largest move of a joint between successive poses [rad or m]; None: 0.5 rad, and
                for slides 0.5 of the robot's unit of length.

        Returns:
            The coordinates as far as the path was followed, and the reason for its end.

        Raises:
            ShapeError: If T is not a list of poses, or the seed not n values.
            InputValueError: If jump is not positive, or a pose not nearly rigid, with the reason.
        """
        poses, start = np.asarray(T, np.float64), np.asarray(seed, np.float64)
        if poses.ndim != 3 or start.shape != (self.n,):  # noqa: PLR2004
            raise ShapeError(
                f"{self.name}.ik_path: expected T (m, 4, 4) and seed ({self.n},), got shapes "
                f"{poses.shape} and {start.shape}"
            )
        if jump is not None and not jump > 0:
            raise InputValueError(f"{self.name}.ik_path: jump must be positive, got {jump!r}")
        poses = projected(f"{self.name}.ik_path", poses)
        solutions = self._roles["inverse", "pose", ""](poses, *given)
        if solutions.q.shape[:-2] != poses.shape[:1]:
            raise ShapeError(f"{self.name}.ik_path: inputs beside the pose must be () or (m,)")
        most = JUMP * solutions.units() if jump is None else np.full(self.n, float(jump))
        steps: list[_Step] = []
        for index, pose in enumerate(poses):
            slots = solutions.at(index)
            step = (
                self._next(slots, pose, steps[-1].q, most) if steps else self._first(slots, start)
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
        best = _least(moves / slots.units(), allowed.valid)
        q, margin = seed + moves[best], float(allowed.margin[best])
        if allowed is inside:
            return _Step(q, margin)
        outside = ~within(q, self.lower, self.upper, slots.units())
        return _Step(q, margin, "limit", int(np.argmax(outside)))

    def _next(
        self, slots: Solutions, pose: FloatArray, here: FloatArray, jump: FloatArray
    ) -> _Step:
        if not slots.valid.any():
            return _Step(here, np.nan, "no solution")
        moves = slots.moves_from(here)
        best = _least(moves / slots.units(), slots.valid)
        move, margin = moves[best], float(slots.margin[best])
        if (np.abs(move) > jump).any():
            nearby = self._nearby(pose, here, slots.unit)
            if nearby is None or (np.abs(nearby - here) > jump).any():
                return _Step(here + move, margin, "jump", int(np.argmax(np.abs(move) / jump)))
            move = nearby - here
        q = here + move
        outside = ~within(q, self.lower, self.upper, slots.units())
        if outside.any():
            return _Step(q, margin, "limit", int(np.argmax(outside)))
        return _Step(q, margin)

    def _nearby(self, pose: FloatArray, here: FloatArray, unit: float) -> FloatArray | None:
        """The solution near the last one, where the pose alone determines solutions."""
        if ("pose and jacobian", "actuators", "") not in self._roles or self.redundancy:
            return None
        refinement = Refinement(self.fk_jacobian_mixed, (), unit, judged=unit)
        (q,), (residual,) = refinement.led(pose[None], here[None])
        return q if residual <= SOLVED * unit else None

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
