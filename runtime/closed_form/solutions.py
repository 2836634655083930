"""All branches of an inverse at once, in fixed slots, and the filters that choose among them.

A slot keeps its branch from pose to pose, whether or not the arm reaches the pose on it, and
`labels` names the branches. So filters leave the slots in place and clear `valid`. Each filter
returns solutions, and filters can be chained:

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

from ..arrays import BoolArray, FloatArray, IntArray
from ..call.validation import real_array
from ..contract import Coordinate
from ..errors import InputValueError, OutOfReachError, ShapeError
from ..tolerances import AT_LIMIT, FAR, SAME_SOLUTION, SOLVED, TILTED
from . import _filters
from .slot_facts import TURN, facts_of, read_limits, read_weights, windings_of

MAX_WINDINGS, _FREEDOMS = 100_000, 6


class Fields(NamedTuple):
    """The fields of all solutions, and of the nearest one."""

    q: FloatArray
    residual: FloatArray
    margin: FloatArray
    valid: BoolArray


class LeastSquares(NamedTuple):
    """Coordinates that come nearest to poses.

    Attributes:
        q: (..., n) coordinates [rad or m].
        residual: (...,) error of the tool [m], as in Solutions.
    """

    q: FloatArray
    residual: FloatArray


class Solutions(Fields):
    """All branches of an inverse, in k fixed slots a pose.

    A tuple of four arrays, `q, residual, margin, valid = robot.ik(T)`, and iterating over it gives
    these arrays; the solutions of one pose are the rows of `valid_q()`.

    Attributes:
        q: (..., k, n) coordinates [rad or m]: a solution where `valid`, else the least-squares
            answer on that branch; NaN where an input is NaN.
        residual: (..., k) error of the tool by forward kinematics [m]: the larger of the distance
            from the pose and of the angle times `unit_length`. A nearly rigid pose counts as the
            rigid pose nearest to it. Infinite in another assembly mode, see `other_mode`.
        margin: (..., k) least margin of the steps of the branch: 0 at the border of reach, negative
            beyond it.
        valid: (..., k) whether the slot holds a solution that no filter has removed: its residual
            is at most `tolerance`, or of a pose that rounding has moved off a rigid one 10
            `unit_length` times its `se3.deviation`, or half a unit of the last decimal of its
            rotation if that is more.
        unit_length: The length [m] that counts as much as a radian, as of the robot.
        tolerance: Largest residual of a solution [m], 1e-9 `unit_length`.
        coordinates: The elements of q.
        wraps: (n,) whether a full turn of the coordinate leaves the pose unchanged: true for
            turning joints until `within_limits` lists their turns separately.
        labels: (k,) the branch in each slot, "shoulder_pan +, elbow -": the joints whose angle the
            branch chooses, and the choice; () once `sorted_by_distance` has reordered the slots of
            each pose.
        windings: Number of consecutive slots that `within_limits` lists for each branch.
    """

    __slots__ = ()

    tolerance: ClassVar[float] = SOLVED
    coordinates: ClassVar[tuple[Coordinate, ...]] = ()
    wraps: ClassVar[tuple[bool, ...]] = ()
    labels: ClassVar[tuple[str, ...]] = ()
    unit_length: ClassVar[float] = 1.0
    windings: ClassVar[int] = 1

    @classmethod
    def _judged(cls, q: Any, residual: Any, margin: Any) -> Self:
        """Solutions from slots, valid where the residual is at most `tolerance`."""
        return cls(q, residual, margin, residual <= cls.tolerance)

    @property
    def count(self) -> IntArray:  # type: ignore[override]
        """(...,) number of valid slots; replaces the method `count` of tuples."""
        counted: IntArray = self.valid.sum(-1)
        return counted

    @property
    def other_mode(self) -> BoolArray:
        """(..., k) whether the loops close at the pose with q, but `fk(q)` is not the pose.

        At the same actuated coordinates, the loops of a platform close in several assembly modes.
        `fk` follows the mode of the reference configuration: it ends in another pose, or before a
        singularity on its way. Such a slot is not valid. `fk_all(q)` has all modes of some
        platforms. False for robots whose loops have a closed form. Filters do not change it.
        """
        is_other: BoolArray = np.isposinf(self.residual) & np.isfinite(self.q).all(-1)
        return is_other

    def at(self, *index: int) -> Self:
        """The solutions of one pose of a batch.

        Args:
            index: Its index, an integer for each leading dimension.

        Raises:
            InputValueError: If there are more or fewer leading dimensions.
        """
        batch = self.valid.shape[:-1]
        if len(index) != len(batch):
            raise InputValueError(f"Solutions.at: expected an index into {batch}, got {index}")
        return type(self)(*(field[index] for field in self))

    def valid_q(self) -> FloatArray:
        """The valid solutions of one pose, without the other slots.

        Returns:
            (count, n) coordinates [rad or m], in the order of the slots.

        Raises:
            InputValueError: If there are several poses: they may differ in count.
        """
        if self.valid.ndim != 1:
            raise InputValueError(
                f"Solutions.valid_q: defined for one pose, got poses {self.valid.shape[:-1]}; "
                "solutions.q[solutions.valid] has the solutions of all poses, row by row"
            )
        return self.q[self.valid]

    def within_limits(
        self, limits: Literal["robot"] | ArrayLike | None = "robot", *, windings: bool = True
    ) -> Self:
        """Keeps the solutions within limits, with every turn within them.

        A joint whose limits are more than a turn apart has the same orientation at several values.
        Each value gets a slot of its own: a joint with limits `w` turns apart, rounded up,
        multiplies the slots by `w`, and the slots of a branch follow each other, the last joint
        varying fastest, from the lower turn to the upper. Turns are counted down from the upper
        limit, which is included; a value at both limits at once is listed at the upper one. Joints
        without limits keep their value, whatever its turn, and joints with one limit are moved
        within it by as few turns as possible. From then on each turn is a value of its own:
        distances from a seed are no longer wrapped, except for joints without limits.

        A joint that rounding has put outside a limit (1e-12 rad, or 1e-12 `unit_length`) is set to
        the limit.

        Args:
            limits: "robot", None for no limits, or (n, 2) lower and upper limits [rad or m], -inf
                and inf for none.
            windings: False keeps the k slots, each moved into the limits by as few turns as
                possible: all windings of a large batch need much memory for an arm with six joints
                of two turns each.

        Returns:
            Solutions with k times as many slots as there are windings, the others not valid.

        Raises:
            InputValueError: If a lower limit is above the upper one, or the limits are so wide that
                a solution has more than 100,000 windings.
            ShapeError: If the limits are not (n, 2).
        """
        listing = _own_listing(cast("Any", type(self)), windings)
        if not isinstance(limits, str) or limits != "robot":
            label = "Solutions.within_limits"
            listing = _listing(type(self), *read_limits(self.coordinates, label, limits), windings)
        kind = cast("type[Self]", listing.kind)
        return tuple.__new__(kind, _filtered(_filters.windings, self, listing.limits, AT_LIMIT))

    def sorted_by_distance(self, q_seed: ArrayLike, *, weights: ArrayLike | None = None) -> Self:
        """The slots in the order of the largest weighted move of a joint, invalid slots last.

        Moves of prismatic joints count in `unit_length`.

        Args:
            q_seed: (..., n) coordinates of the robot [rad or m]; joints that wrap may turn either
                way.
            weights: (n,) factors of the moves; a coordinate with the factor 0 does not count.

        Returns:
            Solutions with the slots of each pose in an order of its own.

        Raises:
            InputValueError: If a weight is negative, or all are 0.
            ShapeError: If `q_seed` does not fit the poses.
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
        """Keeps the first of slots with the same solution, as they occur at singularities.

        Args:
            tolerance: Radians, and parts of `unit_length`; slots are equal if no coordinate differs
                by more.

        Returns:
            Solutions with the repetitions not valid.
        """
        facts = facts_of(type(self))
        same = facts.same if tolerance == SAME_SOLUTION else tolerance * facts.units
        found = _filtered(
            _filters.distinct, (self.q, self.valid), facts.turn, same, facts.whole, self.windings
        )
        return self._remade(self.q, self.residual, self.margin, found)

    def on_branch(self, branch: str) -> Self:
        """Keeps the solutions on a branch.

        Args:
            branch: Parts of a label: "elbow +", or "shoulder -, elbow +".

        Returns:
            Solutions with the slots of other labels not valid.

        Raises:
            InputValueError: If no label has such a part, or sorting has removed the labels.
        """
        parts = {part.strip() for part in branch.split(",")}
        labels = [set(label.split(", ")) for label in self.labels]
        known = dict.fromkeys(part for label in self.labels for part in label.split(", "))
        if not parts <= known.keys():
            names = ", ".join(known) or "none, since slots are sorted or have no labels"
            raise InputValueError(
                f"Solutions.on_branch: there is no branch {branch!r}; there are: {names}"
            )
        kept = np.array([parts <= label for label in labels])
        return self._remade(*self[:-1], self.valid & kept)

    def within_tolerance(self, tolerance: float) -> Self:
        """Counts every slot that comes so near to the pose as a solution, whatever filters removed.

        For poses that are less exact than their digits: an arm of fewer than six joints reaches no
        measured pose.

        Args:
            tolerance: Largest residual of a valid slot [m], as `residual`.

        Returns:
            Solutions with the same slots.

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
        """The solution that moves the joints least, by the largest weighted move of a joint.

        Moves of prismatic joints count in `unit_length`.

        Of several slots the lowest is taken, and of the turns of its solution that `within_limits`
        lists, the one whose joints move least in sum.

        Args:
            q_seed: (..., n) coordinates of the robot [rad or m]; joints that wrap may turn either
                way.
            weights: (n,) factors of the moves; a coordinate with the factor 0 does not count.

        Returns:
            (..., n) coordinates [rad or m], a row of q; NaN for a pose of a batch without a valid
            slot.

        Raises:
            OutOfReachError: If a single pose has no valid slot.
            InputValueError: If a weight is negative, or all are 0.
            ShapeError: If `q_seed` does not fit the poses.
        """
        facts, units = facts_of(type(self)), self._weighted("nearest", weights)
        slots, start = (self.q, self.valid), self._seeds("nearest", q_seed)
        found: FloatArray = _filtered(_filters.nearest, slots, start, facts.turn, units)
        if found.ndim == 1 and math.isnan(found[0]):
            raise OutOfReachError(f"Solutions.nearest: {self._why_none()}")
        return found

    def least_squares(self) -> LeastSquares:
        """The coordinates that come nearest to poses out of reach, and their errors.

        Filters play no part: limits are ignored, and a pose whose solutions were all removed is not
        out of reach.

        Returns:
            `q (..., n)` and `residual (...,)`, the slot with the smallest residual; both are NaN
            where the pose has solutions.
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
        """The signed distance of each coordinate of each slot from a configuration.

        Args:
            q_seed: (..., n) coordinates of the robot [rad or m].

        Returns:
            (..., k, n) [rad or m], in [-pi, pi] for joints that wrap.

        Raises:
            ShapeError: If `q_seed` does not fit the poses.
        """
        return self._wrapped(self.q - self._read_seed("distances_from", q_seed)[..., None, :])

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the facts of its class and the tuple."""
        facts = (self.coordinates, self.wraps, self.labels, self.unit_length)
        return _restore, (facts + (self.windings,) * (self.windings > 1), tuple(self))

    def _weighted(self, method: str, weights: ArrayLike | None) -> FloatArray:
        """(n,) the moves that count as much as a radian; infinite for a weight of 0."""
        units = facts_of(type(self)).units
        if weights is None:
            return units
        with np.errstate(divide="ignore"):
            return np.asarray(units / read_weights(len(units), f"Solutions.{method}", weights))

    def _read_seed(self, method: str, q_seed: ArrayLike) -> FloatArray:
        """A seed (n,) or (..., n) of the right shape."""
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
        """A seed (n,), or a dense row for each pose."""
        if type(given) is np.ndarray and given.dtype == float and given.shape == self.q.shape[-1:]:
            return given if given.flags.c_contiguous else given.copy()
        start = self._read_seed(method, given)
        if start.ndim > 1:
            start = np.broadcast_to(start, (*self.q.shape[:-2], start.shape[-1]))
        return start if start.flags.c_contiguous else np.ascontiguousarray(start)

    def _remade(self, *fields: Any) -> Self:
        """Solutions of the same class; lighter than a call of the class."""
        return tuple.__new__(type(self), fields)

    def _wrapped(self, difference: FloatArray) -> FloatArray:
        """Differences by the shorter way round for coordinates that wrap; works in place."""
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
                "no valid solution: the loops close at the pose in another assembly mode than that "
                f"of fk, in {others} of {self.valid.size} slots; other_mode marks them"
            )
        least = self.least_squares().residual
        if np.isposinf(self.residual).any():
            return "no valid solution: no branch reaches the pose"
        if np.isnan(least):
            return "no valid solution: the pose is not finite, or is no pose"
        size = self.unit_length
        if least > FAR * size:
            return (
                f"no valid solution: the translation lies {least:,.4g} m from a robot of about "
                f"{size:g} m; is it in millimetres? T takes metres"
            )
        n = len(self.coordinates)
        if n < _FREEDOMS and least <= TILTED * size:
            return (
                f"no valid solution: {n} joints reach no pose that rounding has tilted, here by "
                f"{least:.4g} (m, rad); within_tolerance({2 * least:.0e}) counts what comes so near"
            )
        measured = "(m, rad)" if size == 1 else f"m, angles times {size:g} m"
        return (
            f"no valid solution: the pose is out of reach, by {least:.4g} {measured} at least; "
            "least_squares() has the coordinates that come so near"
        )


@cache
def solutions_of(
    coordinates: tuple[Coordinate, ...],
    wraps: tuple[bool, ...],
    labels: tuple[str, ...] = (),
    unit_length: float = 1.0,
    windings: int = 1,
) -> type[Solutions]:
    """The class of solutions in given coordinates, which filters need to know.

    Args:
        coordinates: The elements of q.
        wraps: Whether a full turn of each of them leaves the pose unchanged.
        labels: The branch in each slot, () where slots have none.
        unit_length: The robot's unit of length [m].
        windings: Number of consecutive slots that are turns of the same solution.
    """
    facts: dict[str, Any] = {"coordinates": coordinates, "wraps": wraps, "labels": labels}
    facts |= {"unit_length": unit_length, "windings": windings, "tolerance": SOLVED * unit_length}
    about = {"__slots__": (), "__module__": __name__, "__doc__": Solutions.__doc__}
    return type("Solutions", (Solutions,), {**about, **facts})


def _restore(facts: tuple[Any, ...], fields: tuple[Any, ...]) -> Solutions:
    return solutions_of(*facts)(*fields)


@dataclass(frozen=True)
class _Listing:
    """How slots are listed within limits.

    Attributes:
        kind: The class of the result.
        limits: Lower and upper limits, turns, rounding and numbers of windings, (n,) each.
    """

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
            f"Solutions.within_limits: these limits allow {count:.2g} "
            "windings of each solution; are they in degrees? windings=False takes one of each"
        )
    listed = solutions_of(
        kind.coordinates,
        tuple((wraps & np.isinf(low) & np.isinf(high)).tolist()),
        tuple(label for label in kind.labels for _ in range(count)),
        kind.unit_length,
        kind.windings * count,
    )
    dense = np.ascontiguousarray(low), np.ascontiguousarray(high)
    return _Listing(listed, (*dense, facts.turn, AT_LIMIT * facts.units, turns))


def _filtered(compiled: Callable[..., Any], fields: Iterable[Any], *rest: Any) -> Any:
    """The result of a compiled filter, which refuses fields that are not dense: they are copied."""
    try:
        return compiled(*fields, *rest)
    except TypeError:
        return compiled(*map(np.ascontiguousarray, fields), *rest)


@cache
def _unlabelled(kind: Any) -> type[Solutions]:
    return solutions_of(kind.coordinates, kind.wraps, (), kind.unit_length)
