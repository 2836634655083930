"""All branches of an inverse at once, in fixed slots, and the filters that choose among them.

A slot keeps its branch from pose to pose, whether or not the arm reaches the pose on it, and
`labels` names the branches. So filters leave the slots in place and clear `valid`. Each filter
returns solutions, and filters can be chained:

    robot.ik(T).within_limits().distinct().sorted_from(seed)
"""

from __future__ import annotations

import itertools
import math
from functools import cache
from typing import Any, ClassVar, NamedTuple, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contract import Coordinate
from ..errors import InputTypeError, InputValueError, OutOfReachError, ShapeError
from ..tolerances import AT_LIMIT, FAR, SAME_SOLUTION, SOLVED, TILTED

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

_TURN = 2 * math.pi
MOST_WINDINGS = 100_000
_FREEDOMS = 6


class LeastSquares(NamedTuple):
    """The coordinates that come nearest to poses out of reach.

    Attributes:
        q: (..., n) coordinates [rad or m]; NaN where the pose has solutions.
        residual: (...,) error of the tool [m], as in Solutions; NaN where the pose has solutions.
    """

    q: FloatArray
    residual: FloatArray


class _Fields(NamedTuple):
    q: FloatArray
    residual: FloatArray
    margin: FloatArray
    valid: BoolArray


class Solutions(_Fields):
    """All branches of an inverse, in k fixed slots a pose.

    A tuple of four arrays, `q, residual, margin, valid = robot.ik(T)`, and iterating over it gives
    these arrays; the solutions of one pose are the rows of `array()`.

    Attributes:
        q: (..., k, n) coordinates [rad or m]: a solution where `valid`, else the least-squares
            answer on that branch; NaN where an input is NaN.
        residual: (..., k) error of the tool by forward kinematics [m]: the larger of the distance
            from the pose and of the angle times `unit`. A pose that is nearly rigid counts as the
            rigid pose nearest to it. Infinite in another assembly mode, see `other_mode`.
        margin: (..., k) least margin of the steps of the branch: 0 at the border of reach, negative
            beyond it.
        valid: (..., k) whether the slot holds a solution that no filter has removed: its residual
            is at most 1e-9 `unit`, or of a pose that rounding has moved off a rigid one 10 `unit`
            times its `se3.deviation`, or half a unit of the last decimal of its rotation if that is
            more.
        unit: The robot's unit of length [m]: the power of 1000 nearest to the size of its
            workspace, 1 m for robots of 0.03 m to 30 m.
        coordinates: The elements of q.
        wraps: (n,) whether a full turn of the coordinate leaves the pose unchanged: true for
            turning joints until `within_limits` lists their turns separately.
        labels: (k,) the branch in each slot, "shoulder_pan +, elbow -": the joints whose angle the
            branch chooses, and the choice; () once `sorted_from` has reordered the slots of each
            pose.
    """

    __slots__ = ()

    TOLERANCE: ClassVar[float] = SOLVED
    coordinates: ClassVar[tuple[Coordinate, ...]] = ()
    wraps: ClassVar[tuple[bool, ...]] = ()
    labels: ClassVar[tuple[str, ...]] = ()
    unit: ClassVar[float] = 1.0

    @classmethod
    def judged(cls, q: Any, residual: Any, margin: Any) -> Self:
        """Solutions from slots, valid where the residual is at most `TOLERANCE`."""
        return cls(q, residual, margin, residual <= cls.TOLERANCE)

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

    def array(self) -> FloatArray:
        """The valid solutions of one pose, without the other slots.

        Returns:
            (count, n) coordinates [rad or m], in the order of the slots.

        Raises:
            InputValueError: If there are several poses: they may differ in count.
        """
        if self.valid.ndim != 1:
            raise InputValueError(
                f"Solutions.array: defined for one pose, got poses {self.valid.shape[:-1]}; "
                "solutions.q[solutions.valid] has the solutions of all poses, row by row"
            )
        return self.q[self.valid]

    def within_limits(
        self,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        *,
        windings: bool = True,
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

        A joint that rounding has put outside a limit (1e-12 rad, or 1e-12 `unit`) is set to the
        limit.

        Args:
            lower: (n,) lower limits [rad or m], -inf for none; the robot's own if None.
            upper: (n,) upper limits [rad or m], inf for none; the robot's own if None.
            windings: False keeps the k slots, each moved into the limits by as few turns as
                possible: all windings of a large batch need much memory for an arm with six joints
                of two turns each.

        Returns:
            Solutions with k times as many slots as there are windings, the others not valid.

        Raises:
            InputValueError: If a lower limit is above the upper one, or the limits are so wide that
                a solution has more than 100,000 windings.
            ShapeError: If there are not n of them.
        """
        low, high = self._limits(lower, upper)
        wraps = np.array(self.wraps)
        turns = _windings(low, high, wraps) if windings else np.ones(len(low), dtype=np.intp)
        count = math.prod(turns.tolist())
        if count > MOST_WINDINGS:
            raise InputValueError(
                f"Solutions.within_limits: these limits allow {count:.2g} "
                "windings of each solution; are they in degrees? windings=False takes one of each"
            )
        offsets = np.array(list(itertools.product(*map(range, turns))), dtype=np.intp)
        slots, n = self.q.shape[-2:]
        order = np.repeat(np.arange(slots), len(offsets))
        first = _lowest_turn(self.q, low, high, turns, wraps)
        moved = self.q[..., None, :] + _TURN * (first[..., None, :] + offsets)
        q = moved.reshape(*self.q.shape[:-2], slots * len(offsets), n)
        inside = within(q, low, high, self.units())
        unlimited = np.isinf(low) & np.isinf(high)
        kind = solutions_of(
            self.coordinates,
            tuple((wraps & unlimited).tolist()),
            tuple(self.labels[k] for k in order) if self.labels else (),
            self.unit,
        )
        clipped = np.where(inside, np.clip(q, low, high), q)
        residual, margin = self.residual[..., order], self.margin[..., order]
        valid = self.valid[..., order] & np.asarray(inside.all(-1))
        return cast(Self, kind(clipped, residual, margin, valid))

    def sorted_from(self, seed: ArrayLike) -> Self:
        """The slots in the order of the largest move of a joint, those that are not valid last.

        Moves of slides count in `unit`.

        Args:
            seed: (..., n) coordinates of the robot [rad or m]; joints that wrap may turn either
                way.

        Returns:
            Solutions with the slots of each pose in an order of its own.

        Raises:
            ShapeError: If the seed does not fit the poses.
        """
        order = np.argsort(self._largest_move("sorted_from", seed), axis=-1, kind="stable")
        fields = (np.take_along_axis(field, order, -1) for field in self[1:])
        q = np.take_along_axis(self.q, order[..., None], -2)
        unlabelled = solutions_of(self.coordinates, self.wraps, unit=self.unit)
        return cast(Self, unlabelled._make((q, *fields)))

    def distinct(self, tolerance: float = SAME_SOLUTION) -> Self:
        """Keeps the first of slots with the same solution, as they occur at singularities.

        Args:
            tolerance: Radians, and parts of `unit`; slots that differ by no more in any coordinate
                are equal.

        Returns:
            Solutions with the repetitions not valid.
        """
        valid = self.valid.copy()
        for slot in range(1, valid.shape[-1]):
            apart = self._wrapped(self.q[..., :slot, :] - self.q[..., slot, None, :])
            same = (np.abs(apart) <= tolerance * self.units()).all(-1)
            valid[..., slot] &= ~(same & valid[..., :slot]).any(-1)
        return type(self)(*self[:-1], valid)

    def within(self, tolerance: float) -> Self:
        """Counts every slot that comes so near to the pose as a solution, whatever filters removed.

        For poses that are less exact than their digits: an arm of fewer than six joints reaches
        none that was measured.

        Args:
            tolerance: Largest residual of a valid slot [m], as `residual`.

        Returns:
            Solutions with the same slots.

        Raises:
            InputValueError: If the tolerance is not positive.
        """
        if not tolerance > 0:
            raise InputValueError(
                f"Solutions.within: tolerance must be positive, got {tolerance!r}"
            )
        near = (self.residual <= tolerance) & np.isfinite(self.residual)
        return type(self)(*self[:-1], near)

    def nearest(self, seed: ArrayLike) -> FloatArray:
        """The solution with the smallest largest move of a joint; slides count in `unit`.

        Args:
            seed: (..., n) coordinates of the robot [rad or m]; joints that wrap may turn either
                way.

        Returns:
            (..., n) coordinates [rad or m], a row of q; NaN for a pose of a batch without a valid
            slot.

        Raises:
            OutOfReachError: If a single pose has no valid slot.
            ShapeError: If the seed does not fit the poses.
        """
        move = self._largest_move("nearest", seed)
        best = np.argmin(move, -1)
        q = np.take_along_axis(self.q, best[..., None, None], -2)[..., 0, :]
        if self.valid.ndim == 1 and not self.valid.any():
            raise OutOfReachError(f"Solutions.nearest: {self._why_none()}")
        return np.where(self.valid.any(-1, keepdims=True), q, np.nan)

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
        missed = np.asarray((least > self.TOLERANCE) & np.isfinite(least))
        q = np.take_along_axis(self.q, best[..., None], -2)[..., 0, :]
        return LeastSquares(
            np.where(missed[..., None], q, np.nan), np.where(missed, least, np.nan)[()]
        )

    def moves_from(self, seed: ArrayLike) -> FloatArray:
        """The distance of each coordinate of each slot from a seed.

        Args:
            seed: (..., n) coordinates of the robot [rad or m].

        Returns:
            (..., k, n) [rad or m], in [-pi, pi] for joints that wrap.

        Raises:
            ShapeError: If the seed does not fit the poses.
        """
        return self._moves("moves_from", seed)

    def units(self) -> FloatArray:
        """(n,) what counts as much as a radian in each coordinate: `unit` in slides [m], else 1."""
        return np.array([self.unit if c.unit == "m" else 1.0 for c in self.coordinates])

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the facts of its class and the tuple."""
        facts = (self.coordinates, self.wraps, self.labels, self.unit)
        return _restore, (*facts, tuple(self))

    def _limits(
        self, lower: ArrayLike | None, upper: ArrayLike | None
    ) -> tuple[FloatArray, FloatArray]:
        own = [
            (-np.inf if c.lower is None else c.lower, np.inf if c.upper is None else c.upper)
            for c in self.coordinates
        ]
        pair = [
            np.array([limit[i] for limit in own]) if given is None else self._read(name, given)
            for i, (name, given) in enumerate((("lower", lower), ("upper", upper)))
        ]
        for name, limit in zip(("lower", "upper"), pair, strict=True):
            if limit.shape != (len(own),):
                raise ShapeError(
                    f"Solutions.within_limits: {name} must have shape ({len(own)},), got shape "
                    f"{limit.shape}"
                )
        low, high = pair
        for c, a, b in zip(self.coordinates, low, high, strict=True):
            # Negated, so that NaN is refused.
            if not a <= b:
                raise InputValueError(
                    f"Solutions.within_limits: {c.name} has limits {a:g} to {b:g} {c.unit}"
                )
        return low, high

    def _read(self, name: str, value: ArrayLike) -> FloatArray:
        try:
            array = np.asarray(value)
        except (TypeError, ValueError) as error:
            raise InputTypeError(
                f"Solutions: {name} cannot be read as an array: {error}"
            ) from error
        if array.dtype.kind not in "iuf":
            raise InputTypeError(
                f"Solutions: {name} must hold real numbers, got dtype {array.dtype}"
            )
        return array.astype(np.float64)

    def _moves(self, method: str, seed: ArrayLike) -> FloatArray:
        start, n = self._read("seed", seed), self.q.shape[-1]
        batch = self.q.shape[:-2]
        fits = start.shape[-1:] == (n,) and start.ndim - 1 <= len(batch)
        for own, given in zip(reversed(batch), reversed(start.shape[:-1]), strict=False):
            fits = fits and given in (1, own)
        if not fits:
            raise ShapeError(
                f"Solutions.{method}: seed must have shape ({n},) or {(*batch, n)}, got "
                f"{start.shape}"
            )
        return self._wrapped(self.q - start[..., None, :])

    def _wrapped(self, difference: FloatArray) -> FloatArray:
        """Differences by the shorter way round for coordinates that wrap; works in place."""
        turns = difference * np.where(self.wraps, 1 / _TURN, 0.0)
        np.round(turns, out=turns)
        turns *= _TURN
        difference -= turns
        return difference

    def _largest_move(self, method: str, seed: ArrayLike) -> FloatArray:
        """(..., k), infinite where a slot is not valid."""
        move = np.abs(self._moves(method, seed) / self.units()).max(-1)
        return np.where(self.valid, move, np.inf)

    def _why_none(self) -> str:
        exact = int((self.residual <= self.TOLERANCE).sum())
        if exact:
            return f"no valid solution: filters removed all {exact}"
        others = int(self.other_mode.sum())
        if others:
            return (
                "no valid solution: the loops close at the pose in another assembly mode than that "
                f"of fk, in {others} of {self.valid.size} slots; other_mode marks them"
            )
        least = self.least_squares().residual
        if np.isnan(least):
            return "no valid solution: the pose is not finite, or is no pose"
        size = self.unit
        if least > FAR * size:
            return (
                f"no valid solution: the translation lies {least:,.4g} m from a robot of about "
                f"{size:g} m; is it in millimetres? T takes metres"
            )
        n = len(self.coordinates)
        if n < _FREEDOMS and least <= TILTED * size:
            nearer = _rounded_up(float(least))
            return (
                f"no valid solution: {n} joints reach no pose that rounding has tilted, here by "
                f"{least:.4g} (m, rad); within({nearer}) counts what comes so near"
            )
        measured = "(m, rad)" if size == 1 else f"m, angles times {size:g} m"
        return (
            f"no valid solution: the pose is out of reach, by {least:.4g} {measured} at least; "
            "least_squares() has the coordinates that come so near"
        )


def _rounded_up(value: float) -> str:
    """A number of one digit about twice as large as a positive one."""
    return f"{2 * value:.0e}"


def solutions_of(
    coordinates: tuple[Coordinate, ...],
    wraps: tuple[bool, ...],
    labels: tuple[str, ...] = (),
    unit: float = 1.0,
) -> type[Solutions]:
    """The class of solutions in given coordinates, which filters need to know.

    Args:
        coordinates: The elements of q.
        wraps: Whether a full turn of each of them leaves the pose unchanged.
        labels: The branch in each slot, () where slots have none.
        unit: The robot's unit of length [m].
    """
    return _made(coordinates, wraps, labels, unit)


@cache
def _made(
    coordinates: tuple[Coordinate, ...],
    wraps: tuple[bool, ...],
    labels: tuple[str, ...],
    unit: float,
) -> type[Solutions]:
    facts = {"coordinates": coordinates, "wraps": wraps, "labels": labels, "unit": unit}
    about = {"__slots__": (), "__module__": __name__, "__doc__": Solutions.__doc__}
    return type("Solutions", (Solutions,), {**about, **facts, "TOLERANCE": SOLVED * unit})


def within(q: FloatArray, lower: FloatArray, upper: FloatArray, units: FloatArray) -> BoolArray:
    """Whether coordinates are within limits, up to rounding.

    Args:
        q: (..., n) coordinates.
        lower: (n,) lower limits.
        upper: (n,) upper limits.
        units: (n,) the robot's unit of length for slides, 1 for coordinates that turn.
    """
    rounding = AT_LIMIT * units
    return np.asarray((q >= lower - rounding) & (q <= upper + rounding))


def _restore(
    coordinates: tuple[Coordinate, ...],
    wraps: tuple[bool, ...],
    labels: tuple[str, ...],
    unit: float,
    fields: tuple[Any, ...],
) -> Solutions:
    return solutions_of(coordinates, wraps, labels, unit)(*fields)


def _windings(low: FloatArray, high: FloatArray, wraps: BoolArray) -> IntArray:
    """(n,) number of turns listed for a coordinate: those in (low, high], rounded up."""
    turns = np.ceil((high - low) / _TURN - AT_LIMIT)
    return np.where(wraps & np.isfinite(turns), np.maximum(turns, 1), 1).astype(np.intp)


def _lowest_turn(
    q: FloatArray, low: FloatArray, high: FloatArray, windings: IntArray, wraps: BoolArray
) -> FloatArray:
    """(..., k, n) number of turns from q to the first winding that is listed."""
    last = np.floor((high - q + AT_LIMIT) / _TURN)
    least = np.ceil((low - q - AT_LIMIT) / _TURN)
    first = np.where(windings > 1, last - windings + 1, np.clip(0.0, least, last))
    return np.where(wraps, first, 0.0)
