"""Inverse kinematics solutions, stored in fixed slots, and the filters for them.

For all poses, a solution slot belongs to the same branch of the inverse kinematics function. A pose
may be out of reach on a branch. `labels` describes the branches. Filters change `valid` and do not
move solution slots. Each filter returns Solutions, so filters can be applied in sequence:

    robot.ik(T).within_limits().distinct().sorted_by_distance(q_seed)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Literal, NamedTuple, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray, IntArray, real_array
from ..contract import Coordinate
from ..errors import InputValueError, OutOfReachError, ShapeError
from ..joint_limits import TURN, JointLimits
from ..tolerances import AT_LIMIT, FAR, SAME_SOLUTION, SOLVED, TILTED
from . import _filters
from .slot_facts import facts_of, moved_inside, read_limits, read_weights, windings_of

MAX_WINDINGS, _FREEDOMS = 100_000, 6


class Fields(NamedTuple):
    """The common fields of Solutions and NearestSolution."""

    q: FloatArray
    residual: FloatArray
    margin: FloatArray
    valid: BoolArray


class LeastSquares(NamedTuple):
    """Coordinates with the smallest tool error for each pose.

    Attributes:
        q: (..., n) coordinates [rad or m].
        residual: (...,) tool error [m], as in Solutions.
    """

    q: FloatArray
    residual: FloatArray


class Solutions(Fields):
    """Solutions on all branches of an IK function, in k fixed solution slots per pose.

    A tuple of four arrays, `q, residual, margin, valid = robot.ik(T)`. The solutions of one pose
    are the rows of `valid_q()`.

    Attributes:
        q: (..., k, n) coordinates [rad or m]. Slots that are not `valid` hold the least-squares
            result of the branch, or NaN if an input is NaN.
        residual: (..., k) tool error [m] relative to the (projected) pose, from forward kinematics.
            The error is the larger of the position error and `2 sin(angle/2)` times `unit_length`,
            where `angle` is the rotation error. The residual is infinite in another assembly mode
            (see `other_mode`).
        margin: (..., k) smallest margin of the solution steps: 0 at the workspace boundary,
            negative outside. For a general arm, `margin` is the distance from a singularity, or the
            negative residual in an unsolved slot.
        valid: (..., k) whether the slot holds a solution that no filter has removed. The residual
            of a solution is at most `tolerance`. For a rounded pose, the maximum residual is 10
            `unit_length` times the rounding error of the pose. The rounding error is
            `se3.deviation` or half a unit of the last decimal, whichever is larger.
        unit_length: The length [m] that is equivalent to 1 rad for the robot.
        tolerance: Maximum residual of a solution [m], 1e-9 `unit_length`.
        coordinates: The elements of q.
        wraps: (n,) whether a rotation of the coordinate by 2 pi gives the same solution. `wraps` is
            True for revolute joints. `within_limits` lists angles that differ by full turns as
            separate solutions.
        labels: (k,) the branch in each solution slot, for example "shoulder_pan +, elbow -". A
            label contains the joints and signs that select the branch. `labels` is empty after
            `sorted_by_distance`, which reorders the slots.
        windings: Number of solution slots for each branch after `within_limits`.
        joint_limits: The limits of coupled and passive joints, or None.
    """

    __slots__ = ()

    tolerance: ClassVar[float] = SOLVED
    coordinates: ClassVar[tuple[Coordinate, ...]] = ()
    wraps: ClassVar[tuple[bool, ...]] = ()
    labels: ClassVar[tuple[str, ...]] = ()
    unit_length: ClassVar[float] = 1.0
    windings: ClassVar[int] = 1
    joint_limits: ClassVar[JointLimits | None] = None

    @classmethod
    def _judged(cls, q: Any, residual: Any, margin: Any) -> Self:
        return cls(q, residual, margin, residual <= cls.tolerance)

    @property
    def count(self) -> IntArray:  # type: ignore[override]
        """(...,) number of valid solution slots."""
        counted: IntArray = self.valid.sum(-1)
        return counted

    @property
    def other_mode(self) -> BoolArray:
        """(..., k) whether a solution is in a different assembly mode than the result of `fk`.

        With the same actuated coordinates, a platform can have several assembly modes. `fk` follows
        the mode of the reference configuration. For a solution in another assembly mode, `fk(q)` is
        not the target pose. A solution slot in another assembly mode is not valid. For some
        platforms, `fk_all(q)` returns all modes. The result is False for robots whose loops have a
        closed form. Filters do not change `other_mode`.
        """
        is_other: BoolArray = np.isposinf(self.residual) & np.isfinite(self.q).all(-1)
        return is_other

    def at(self, *index: int) -> Self:
        """Return the solutions of one pose of a batch, with one index per leading dimension.

        Raises:
            InputValueError: If the number of indices is wrong.
        """
        batch = self.valid.shape[:-1]
        if len(index) != len(batch):
            raise InputValueError(
                "Solutions.at: expected one index for each leading dimension, got "
                f"{index} for shape {batch}"
            )
        return type(self)(*(field[index] for field in self))

    def valid_q(self) -> FloatArray:
        """Return the valid solutions (count, n) [rad or m] of one pose, in slot order.

        Raises:
            InputValueError: If there are several poses.
        """
        if self.valid.ndim != 1:
            raise InputValueError(
                "Solutions.valid_q: expected the solutions of one pose, got shape "
                f"{self.valid.shape[:-1]}; "
                "solutions.q[solutions.valid] has the solutions of all poses, row by row"
            )
        return self.q[self.valid]

    def within_limits(
        self, limits: Literal["robot"] | ArrayLike | None = "robot", *, windings: bool = True
    ) -> Self:
        """Return the solutions within the limits; full turns of joints give separate solutions.

        If the limits span several full turns of a joint, each solution is listed in several
        solution slots. The slots of one branch are consecutive; the number of turns of the last
        joint varies fastest. If the limits differ by a whole number of turns, a solution may be at
        both limits. In this case, the solution at the lower limit is not listed. Joints without
        limits keep their value. A joint with only one limit is moved by as few full turns as
        possible to satisfy the limit. Since each winding is a separate solution, distances from a
        seed ignore full turns only for joints without limits. In a coupled robot, a full turn of a
        joint may move several coordinates. For coupled joints, only one combination of full turns
        within the limits is listed.

        A joint that exceeds a limit by up to 1e-12 rad or 1e-12 `unit_length` is set to the limit.

        Args:
            limits: "robot", None for no limits, or (n, 2) lower and upper limits [rad or m], -inf
                and inf for none. The limits of coupled and passive joints also apply, unless
                `limits` is None.
            windings: If False, each of the k solutions has one slot instead of one slot for each
                winding. The joints then move by the fewest full turns that satisfy the limits. For
                a large batch, listing all windings can need much memory.

        Returns:
            New Solutions, with a separate solution slot for each winding.

        Raises:
            InputValueError: If a lower limit is above the upper limit, or a solution has more than
                100,000 windings.
            ShapeError: If the limits are not (n, 2).
        """
        listing = _own_listing(cast("Any", type(self)), windings)
        if not isinstance(limits, str) or limits != "robot":
            label = "Solutions.within_limits"
            listing = _listing(type(self), *read_limits(self.coordinates, label, limits), windings)
        kind = cast("type[Self]", listing.kind)
        q, valid, joints = self.q, self.valid, self.joint_limits
        if limits is not None and joints is not None:
            q, valid = moved_inside(joints, q, valid, q, listing.limits[:2], type(self))
        q, valid = _filtered(_filters.windings, (q, valid), listing.limits)
        if limits is not None and joints is not None:
            valid &= joints.inside(q).all(-1)
        times = kind.windings // self.windings
        fields = (field if times == 1 else field.repeat(times, -1) for field in self[1:3])
        return tuple.__new__(kind, (q, *fields, valid))

    def sorted_by_distance(self, q_seed: ArrayLike, *, weights: ArrayLike | None = None) -> Self:
        """Sort the solution slots of each pose by distance from a seed; invalid slots are last.

        The distance is the largest weighted joint displacement, in the shorter direction for joints
        that wrap; prismatic joints are scaled by `unit_length`.

        Args:
            q_seed: (..., n) coordinates of the robot [rad or m].
            weights: (n,) weights of the displacements; weight 0 excludes a coordinate.

        Raises:
            InputValueError: If a weight is negative, or all weights are 0.
            ShapeError: If the shape of `q_seed` does not match the shape of the poses.
        """
        facts, units = facts_of(type(self)), self._weighted("sorted_by_distance", weights)
        start = self._seeds("sorted_by_distance", q_seed)
        order = _filtered(_filters.order, (self.q, self.valid), start, facts.turn, units)
        if order.ndim == 1:
            return cast(
                Self, _unlabelled(cast("Any", type(self)))(*(f.take(order, 0) for f in self))
            )
        fields = (np.take_along_axis(field, order, -1) for field in self[1:])
        q = np.take_along_axis(self.q, order[..., None], -2)
        return cast(Self, _unlabelled(cast("Any", type(self)))._make((q, *fields)))

    def distinct(self, tolerance: float = SAME_SOLUTION) -> Self:
        """Keep the first of several equal solutions, which occur at singularities.

        Args:
            tolerance: Maximum difference [rad or `unit_length`] at which solutions are equal.
        """
        facts = facts_of(type(self))
        same = facts.same if tolerance == SAME_SOLUTION else tolerance * facts.units
        found = _filtered(
            _filters.distinct, (self.q, self.valid), facts.turn, same, facts.full, self.windings
        )
        return self._remade(self.q, self.residual, self.margin, found)

    def on_branch(self, branch: str) -> Self:
        """Keep solutions on branches with all given label parts, such as "shoulder -, elbow +".

        Raises:
            InputValueError: If no label contains this text, or sorting has removed the labels.
        """
        parts = {part.strip() for part in branch.split(",")}
        labels = [set(label.split(", ")) for label in self.labels]
        known = dict.fromkeys(part for label in self.labels for part in label.split(", "))
        if not parts <= known.keys():
            names = ", ".join(known) or "none, because solution slots are sorted or have no labels"
            raise InputValueError(
                f"Solutions.on_branch: unknown branch {branch!r}; branches: {names}"
            )
        kept = np.array([parts <= label for label in labels])
        return self._remade(*self[:-1], self.valid & kept)

    def within_tolerance(self, tolerance: float) -> Self:
        """Mark all solution slots with a residual of at most the tolerance [m] as valid.

        Earlier filters have no effect on the result. An arm with fewer than six joints cannot reach
        measured poses exactly and therefore needs a tolerance.

        Raises:
            InputValueError: If the tolerance is not positive.
        """
        if not tolerance > 0:
            raise InputValueError(
                f"Solutions.within_tolerance: tolerance must be positive, got {tolerance!r}"
            )
        near = (self.residual <= tolerance) & np.isfinite(self.residual)
        return type(self)(*self[:-1], near)

    def nearest(self, q_seed: ArrayLike, *, weights: ArrayLike | None = None) -> FloatArray:
        """Return the valid solution with the smallest weighted distance from a seed.

        If solutions have equal distances, the solution with the lowest slot index is selected. If
        solutions differ only by full turns, the solution with the smallest sum of displacements is
        selected.

        Args:
            q_seed: (..., n) coordinates of the robot [rad or m].
            weights: (n,) weights of the displacements; weight 0 excludes a coordinate.

        Returns:
            (..., n) coordinates [rad or m]. In a batch, poses without a valid solution have NaN.

        Raises:
            OutOfReachError: If a single pose has no valid solution slot.
            InputValueError: If a weight is negative, or all weights are 0.
            ShapeError: If the shape of `q_seed` does not match the shape of the poses.
        """
        facts, units = facts_of(type(self)), self._weighted("nearest", weights)
        slots, start = (self.q, self.valid), self._seeds("nearest", q_seed)
        found: FloatArray = _filtered(_filters.nearest, slots, start, facts.turn, units)
        if found.ndim == 1 and math.isnan(found[0]):
            raise OutOfReachError(f"Solutions.nearest: {self._why_none()}")
        return found

    def least_squares(self) -> LeastSquares:
        """Return the solution slots with the smallest residual for poses out of reach.

        Filters and limits are ignored. `q (..., n)` and `residual (...,)` are NaN for poses with
        solutions, even if filters have removed all of them.
        """
        residual = np.where(np.isnan(self.residual), np.inf, self.residual)
        best = np.argmin(residual, -1)[..., None]
        least = np.take_along_axis(residual, best, -1)[..., 0]
        missed = np.asarray((least > self.tolerance) & np.isfinite(least))
        q = np.take_along_axis(self.q, best[..., None], -2)[..., 0, :]
        return LeastSquares(
            np.where(missed[..., None], q, np.nan), np.where(missed, least, np.nan)[()]
        )

    def distances_from(self, q_seed: ArrayLike) -> FloatArray:
        """Return the displacements (..., k, n) [rad or m] of all slots from q_seed (..., n).

        If a full turn of a coordinate gives the same solution, the displacement of the coordinate
        is in [-pi, pi].

        Raises:
            ShapeError: If the shape of `q_seed` does not match the shape of the poses.
        """
        return self._wrapped(self.q - self._read_seed("distances_from", q_seed)[..., None, :])

    def __reduce__(self) -> tuple[Any, ...]:
        facts = (self.coordinates, self.wraps, self.labels, self.unit_length)
        return _restore, ((*facts, self.windings, self.joint_limits), tuple(self))

    def _weighted(self, method: str, weights: ArrayLike | None) -> FloatArray:
        units = facts_of(type(self)).units
        if weights is None:
            return units
        with np.errstate(divide="ignore"):
            return np.asarray(units / read_weights(len(units), f"Solutions.{method}", weights))

    def _read_seed(self, method: str, q_seed: ArrayLike) -> FloatArray:
        start, n = real_array("Solutions", "q_seed", q_seed), self.q.shape[-1]
        if start.shape == (n,):
            return start
        batch = self.q.shape[:-2]
        fits = start.shape[-1:] == (n,) and start.ndim - 1 <= len(batch)
        for own, given in zip(reversed(batch), reversed(start.shape[:-1]), strict=False):
            fits = fits and given in (1, own)
        if not fits:
            raise ShapeError(
                f"Solutions.{method}: q_seed must have shape ({n},) or {(*batch, n)}, got "
                f"{start.shape}"
            )
        return start

    def _seeds(self, method: str, given: ArrayLike) -> FloatArray:
        if type(given) is np.ndarray and given.dtype == float and given.shape == self.q.shape[-1:]:
            return given if given.flags.c_contiguous else given.copy()
        start = self._read_seed(method, given)
        if start.ndim > 1:
            start = np.broadcast_to(start, (*self.q.shape[:-2], start.shape[-1]))
        return start if start.flags.c_contiguous else np.ascontiguousarray(start)

    def _remade(self, *fields: Any) -> Self:
        return tuple.__new__(type(self), fields)

    def _wrapped(self, difference: FloatArray) -> FloatArray:
        turns = difference * np.where(self.wraps, 1 / TURN, 0.0)
        np.round(turns, out=turns)
        turns *= TURN
        difference -= turns
        return difference

    def _why_none(self) -> str:
        exact = int((self.residual <= self.tolerance).sum())
        if exact:
            return f"no valid solution: filters removed all {exact}"
        others = int(self.other_mode.sum())
        if others:
            return (
                "no valid solution: fk does not follow the assembly mode of "
                f"{others} of {self.valid.size} slots; other_mode marks these slots"
            )
        least = self.least_squares().residual
        if np.isposinf(self.residual).any():
            return "no valid solution: no branch reaches the pose"
        if np.isnan(least):
            return "no valid solution: the input is not a finite rigid pose"
        size = self.unit_length
        if least > FAR * size:
            return (
                f"no valid solution: the translation lies {least:,.4g} m from a robot of about "
                f"{size:g} m; is it in millimeters? T takes meters"
            )
        n = len(self.coordinates)
        if n < _FREEDOMS and least <= TILTED * size:
            return (
                f"no valid solution: an arm with {n} joints cannot reach a rounded pose, residual "
                f"{least:.4g} (m, rad); within_tolerance({2 * least:.0e}) accepts it"
            )
        measured = "(m, rad)" if size == 1 else f"m, angles times {size:g} m"
        return (
            f"no valid solution: the pose is out of reach, by {least:.4g} {measured} at least; "
            "least_squares() returns the nearest coordinates"
        )


def solutions_of(
    coordinates: tuple[Coordinate, ...],
    wraps: tuple[bool, ...],
    labels: tuple[str, ...] = (),
    unit_length: float = 1.0,
    windings: int = 1,
    joint_limits: JointLimits | None = None,
) -> type[Solutions]:
    """Return the subclass of Solutions with these class attributes."""
    return _subclass(coordinates, wraps, labels, unit_length, windings, joint_limits)


@cache
def _subclass(*facts: Any) -> type[Solutions]:
    names = ("coordinates", "wraps", "labels", "unit_length", "windings", "joint_limits")
    about: dict[str, Any] = dict(zip(names, facts, strict=True))
    about |= {"__slots__": (), "__module__": __name__, "__doc__": Solutions.__doc__}
    return type("Solutions", (Solutions,), about | {"tolerance": SOLVED * about["unit_length"]})


def _restore(facts: tuple[Any, ...], fields: tuple[Any, ...]) -> Solutions:
    return solutions_of(*facts)(*fields)


@dataclass(frozen=True)
class _Listing:
    kind: type[Solutions]
    limits: tuple[FloatArray, FloatArray, FloatArray, FloatArray, IntArray]


@cache
def _own_listing(kind: Any, windings: bool) -> _Listing:
    facts = facts_of(kind)
    return _listing(kind, facts.lower, facts.upper, windings)


def _listing(kind: type[Solutions], low: FloatArray, high: FloatArray, windings: bool) -> _Listing:
    facts, wraps = facts_of(kind), np.array(kind.wraps, dtype=np.bool_)
    turns = windings_of(low, high, wraps) if windings else np.ones(len(low), dtype=np.intp)
    count = math.prod(turns.tolist())
    if count > MAX_WINDINGS:
        raise InputValueError(
            f"Solutions.within_limits: too many windings of each solution are within the limits "
            f"({count:.2g}); limits must be in radians, not degrees; windings=False keeps one "
            "winding of each solution"
        )
    listed = solutions_of(
        kind.coordinates,
        tuple((wraps & np.isinf(low) & np.isinf(high)).tolist()),
        tuple(label for label in kind.labels for _ in range(count)),
        kind.unit_length,
        kind.windings * count,
        kind.joint_limits,
    )
    dense = np.ascontiguousarray(low), np.ascontiguousarray(high)
    return _Listing(listed, (*dense, facts.turn, AT_LIMIT * facts.units, turns))


def _filtered(compiled: Callable[..., Any], fields: Iterable[Any], *rest: Any) -> Any:
    try:
        return compiled(*fields, *rest)
    except TypeError:
        return compiled(*map(np.ascontiguousarray, fields), *rest)


@cache
def _unlabelled(kind: Any) -> type[Solutions]:
    return solutions_of(kind.coordinates, kind.wraps, (), kind.unit_length, 1, kind.joint_limits)
