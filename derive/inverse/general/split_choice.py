"""The splits of a general arm that separate its solutions best, and the joints that are given.

Where neighbouring axes of the arm meet or are parallel, many splits give a determinant of M that
vanishes for every angle of the suppressed joint, or that does not tell some solutions apart. So all
splits are tried at many configurations. A split is good at a configuration where det M is a
trigonometric polynomial of degree 8 in the suppressed angle, and where the second smallest singular
value of M at the solution, and the smallest of A, are far from zero; the greater, the better.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ...model.robot import SerialRobot
from ...model.tolerances import (
    DETERMINANT_TAIL,
    POOR_SEPARATION,
    SEPARATE,
    SINGLE_SOLUTION,
)
from .line_quantities import Array
from .raghavan_roth import (
    JOINTS,
    LineEquations,
    Split,
    equations,
    forward,
    is_fit,
    moved,
    numbers,
    splits,
    suppressed,
)

SAMPLES = 32
"""Angles at which the determinant of a split is sampled."""
DEGREE = 8
"""Degree of the determinant in the suppressed angle: sixteen solutions."""
CONFIGURATIONS = 12
"""Configurations at which a split of six joints is tried."""
GIVEN_CONFIGURATIONS, AT_RIGHT_ANGLES = 8, 2
"""The same where joints are given, and how many more with these at each right angle."""
KEPT, MOST_KEPT = 3, 4
"""Splits that are kept: where one fails at a pose, the next is tried. A fourth is kept only if it
is good where the others are not."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
MOST_JOINTS = len(PRIMES)
"""Most joints of an arm, those that are given among them; the tables of the C have room for as
many."""


@dataclass(frozen=True)
class Rating:
    """How well a split does.

    Attributes:
        split: The split.
        separations: At each configuration the second smallest singular value of M over the
            greatest; NaN where det M does not have degree 8.
        pairs: At each configuration the smallest singular value of A, from which the pair of joints
            follows, over the greatest.
    """

    split: Split
    separations: tuple[float, ...]
    pairs: tuple[float, ...]

    @property
    def least(self) -> tuple[float, ...]:
        """At each configuration the lesser of both, NaN for NaN."""
        return tuple(map(float, np.minimum(self.separations, self.pairs)))

    @property
    def good_at(self) -> frozenset[int]:
        """Indices of the configurations at which it is good."""
        return frozenset(k for k, s in enumerate(self.least) if s > SINGLE_SOLUTION)

    @property
    def good(self) -> float:
        """Part of the configurations at which it is good."""
        return len(self.good_at) / len(self.separations)

    @property
    def is_fit(self) -> bool:
        """Whether det M has degree 8 at some configuration."""
        return not all(np.isnan(self.separations))

    @property
    def key(self) -> tuple[float, float]:
        """The greater, the better: part of good configurations, and separation at these."""
        there = [self.least[k] for k in self.good_at]
        return self.good, float(np.median(there)) if there else 0.0


@dataclass(frozen=True)
class Choice:
    """The splits by which an arm is solved.

    Attributes:
        given: Indices of the joints that are given, in ascending order.
        ratings: The splits that are kept, the best first.
    """

    given: tuple[int, ...]
    ratings: tuple[Rating, ...]

    @property
    def good(self) -> float:
        """Part of the configurations at which some split is good."""
        found = frozenset[int]().union(*(rating.good_at for rating in self.ratings))
        return len(found) / len(self.ratings[0].separations)

    @property
    def separation(self) -> float:
        """How well the best split tells solutions apart, where it is good: see its key."""
        return self.ratings[0].key[1]

    @property
    def splits(self) -> tuple[Split, ...]:
        """The splits, over the indices of the six joints that are solved for."""
        return tuple(rating.split for rating in self.ratings)


def choose(robot: SerialRobot) -> Choice | None:
    """The splits of an arm of six joints and more, or None where none is good.

    Where the other six are nearly singular without a slide, as without one along their axes, any
    joint is given in its place.

    Args:
        robot: The description.
    """
    found = _best(robot, ways_to_give(robot))
    is_poor = found is None or found.separation < POOR_SEPARATION
    if not (slides_of(robot) and is_poor and len(robot.moving) == JOINTS + 1):
        return found
    ways = [(k,) for k in range(len(robot.moving)) if is_fit(robot, (k,))]
    return _best(robot, ways)


def _best(robot: SerialRobot, ways: Sequence[tuple[int, ...]]) -> Choice | None:
    """The best choice of the joints to be given, of some."""
    if not ways:
        return None
    constants, slides = numbers(robot), slides_of(robot)
    found = [choice for given in ways if (choice := choice_at(constants, given, slides))]
    # Of equals the joint nearest to the tool is given: an operator sets it most easily.
    return max(reversed(found), key=lambda c: (c.good, c.ratings[0].key), default=None)


def slides_of(robot: SerialRobot) -> frozenset[int]:
    """Indices of the joints that slide."""
    return frozenset(k for k, joint in enumerate(robot.moving) if joint.kind == "prismatic")


def ways_to_give(robot: SerialRobot) -> list[tuple[int, ...]]:
    """The sets of joints that may be given so that six are left.

    Slides are given, and the revolute joints next to the base, as those of a torso are; each of the
    others may be the last that is given. Where fewer than six joints turn, some slides are left.
    """
    slides = sorted(slides_of(robot))
    turns = [k for k in range(len(robot.moving)) if k not in slides]
    surplus = len(turns) - JOINTS
    if len(robot.moving) < JOINTS or len(robot.moving) > MOST_JOINTS:
        return []
    if surplus < 0:
        ways = [(*given,) for given in combinations(slides, len(slides) + surplus)]
        return [given for given in ways if is_fit(robot, given)]
    lasts: list[tuple[int, ...]] = [(k,) for k in turns[surplus - 1 :]] if surplus else [()]
    first = turns[: max(surplus - 1, 0)]
    ways = [tuple(sorted((*slides, *first, *last))) for last in lasts]
    return [given for given in ways if is_fit(robot, given)]


def choice_at(
    constants: Sequence[Array],
    given: tuple[int, ...] = (),
    slides: frozenset[int] = frozenset(),
    apart: Sequence[float] = (),
) -> Choice | None:
    """The splits where some joints are given, or None where none is good.

    Args:
        constants: The placements before, between and behind the joints, as floats.
        given: Indices of the given joints, in ascending order.
        slides: Indices of the joints that slide.
        apart: How far solutions are apart in each of the six joints (radian), if it is known: those
            of an arm near a structure often share some joints, in which no root tells them apart.
    """
    choice = Choice(given, _ratings(constants, given, slides, apart))
    return choice if choice.ratings and choice.good > 0 else None


def without(constants: Sequence[Array], motions: Mapping[int, Array]) -> list[Array]:
    """The placements of the joints that are left where others are given.

    Args:
        constants: The placements before, between and behind the joints.
        motions: The motion (4, 4) of each given joint, by its index.
    """
    left = [constants[0]]
    for k, E in enumerate(constants[1:]):
        if k in motions:
            left[-1] = left[-1] @ motions[k] @ E
        else:
            left.append(E)
    return left


def _ratings(
    constants: Sequence[Array],
    given: tuple[int, ...],
    slides: frozenset[int],
    apart: Sequence[float],
) -> tuple[Rating, ...]:
    """The best splits, no two of the same order of joints, the best first.

    Where it is known how far solutions are apart, splits by joints that tell them apart are
    preferred, each by another one: solutions that meet in one joint may differ in the next.
    """

    def tells_apart(rating: Rating) -> tuple[bool, bool]:
        joint = rating.split.joints[2]
        is_new = all(joint != other.split.joints[2] for other in kept)
        return not apart or apart[joint] > SEPARATE, not apart or is_new

    left = [rating for rating in _rated(constants, given, slides) if rating.is_fit]
    if not any(rating.good_at for rating in left):
        # Where four axes or more meet in two points, A is singular in every split. So it is where
        # both of the pair slide in one direction, but then the arm lacks a freedom.
        sliding = slides_left(slides, len(constants) - 1, given)
        left = [
            replace(rating, pairs=(1.0,) * len(rating.pairs))
            for rating in left
            if not sliding.issuperset(rating.split.joints[:2])
        ]
    kept: list[Rating] = []
    while left and len(kept) < MOST_KEPT:
        known = frozenset[int]().union(*(rating.good_at for rating in kept))
        best = max(left, key=lambda r: (tells_apart(r), len(r.good_at - known), r.key))
        if len(kept) >= KEPT and best.good_at <= known:
            break
        kept.append(best)
        left = [rating for rating in left if _order(rating.split) != _order(best.split)]
    return tuple(kept)


def _order(split: Split) -> tuple[tuple[int, ...], int]:
    return split.joints, split.sense


def _rated(
    constants: Sequence[Array], given: tuple[int, ...], slides: frozenset[int]
) -> list[Rating]:
    found: dict[tuple[tuple[int, ...], int], list[LineEquations]] = {}
    sliding = slides_left(slides, len(constants) - 1, given)
    orders = {_order(split): split for split in splits(sliding)}
    configured = configurations(len(constants) - 1, given)
    size = length(constants)
    for angles in configured:
        values = [_value_at(angle, size, k in slides) for k, angle in enumerate(angles)]
        six = without(constants, {k: moved(values[k], k in slides) for k in given})
        scaled = _scaled([*six, forward(six, _solved(values, given), sliding)], length(six))
        for order, split in orders.items():
            found.setdefault(order, []).append(equations(scaled[:-1], split, scaled[-1], sliding))
    stacked = {
        order: LineEquations(np.stack([e.left for e in each]), np.stack([e.right for e in each]))
        for order, each in found.items()
    }
    q = np.array([_solved(angles, given) for angles in configured])
    pairs = {order: _pairs(each) for order, each in stacked.items()}
    return [
        Rating(split, _separations(stacked[_order(split)], split, q), pairs[_order(split)])
        for split in splits(sliding)
    ]


def _value_at(angle: float, size: float, slides: bool) -> float:
    """A joint's value; a slide goes the same part of the arm's length as a turn of a whole one."""
    return angle / (2 * np.pi) * size if slides else angle


def _solved(values: Sequence[float], given: tuple[int, ...]) -> list[float]:
    """The values of the joints that are not given."""
    return [value for k, value in enumerate(values) if k not in given]


def slides_left(slides: frozenset[int], joints: int, given: tuple[int, ...]) -> frozenset[int]:
    """Places of the joints that slide, among those of an arm that are not given."""
    left = [k for k in range(joints) if k not in given]
    return frozenset(place for place, k in enumerate(left) if k in slides)


def _scaled(poses: Sequence[Array], size: float) -> list[Array]:
    """Poses with lengths in parts of a length."""
    return [np.vstack([np.hstack([T[:3, :3], T[:3, 3:] / size]), T[3:]]) for T in poses]


def length(constants: Sequence[Array]) -> float:
    """The sum of the distances between the arm's frames (metre), 1 where there are none."""
    return sum(float(np.linalg.norm(E[:3, 3])) for E in constants[1:]) or 1.0


def _pairs(found: LineEquations) -> tuple[float, ...]:
    """Smallest singular value of A, of each pose, over the greatest.

    A is singular where the pair are two of three parallel axes: one solution for the others then
    has two for the pair. Where both of the pair slide, products of squares never appear.
    """
    A = found.left[..., 1:]
    parts, appear = np.zeros(len(A)), A.any((0, 1))
    if not appear.any():
        return tuple(parts.tolist())
    sizes = np.linalg.svd(A[..., appear], compute_uv=False)
    np.divide(sizes[:, -1], sizes[:, 0], out=parts, where=sizes[:, 0] > 0)
    return tuple(map(float, parts))


def _separations(found: LineEquations, split: Split, q: Array) -> tuple[float, ...]:
    """Second smallest singular value at solutions q (C, 6) over the greatest; NaN for a bad split.

    Args:
        found: The equations of each pose, (C, 14, 9) and (C, 3, 14, 9).
        split: Their split.
        q: The values of the six joints at each pose, of which the suppressed angle is taken.
    """
    M = suppressed(found, split.halved)
    turns = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    degrees = np.abs(np.fft.rfft(np.linalg.det(_at(turns, M[:, None]))))
    is_fit = degrees[:, DEGREE + 1 :].max(-1) < DETERMINANT_TAIL * degrees.max(-1)
    sizes = np.linalg.svd(_at(split.sense * q[:, split.joints[2]], M), compute_uv=False)
    parts = np.full(len(q), np.nan)
    np.divide(sizes[:, -2], sizes[:, 0], out=parts, where=is_fit)
    return tuple(map(float, parts))


def _at(angle: Array, M: Array) -> Array:
    """M (..., 3, 12, 12) of 1, cos and sin of an angle at angles (...), as (..., 12, 12)."""
    c, s = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    return np.asarray(M[..., 0, :, :] + c * M[..., 1, :, :] + s * M[..., 2, :, :])


def configurations(joints: int, given: tuple[int, ...]) -> list[list[float]]:
    """Evenly distributed configurations without a pattern: multiples of square roots modulo 1.

    Where joints are given, they are at each right angle in some of them: the six that are left
    often have a structure there.
    """
    if not given:
        return [_spread(joints, k) for k in range(CONFIGURATIONS)]
    found = [_spread(joints, k) for k in range(GIVEN_CONFIGURATIONS + 4 * AT_RIGHT_ANGLES)]
    for k, q in enumerate(found[GIVEN_CONFIGURATIONS:]):
        for place, joint in enumerate(given):
            q[joint] = (k + place * (k // 4)) % 4 * np.pi / 2
    return found


def _spread(joints: int, k: int) -> list[float]:
    return [2 * np.pi * ((k + 1) * p**0.5 % 1) for p in PRIMES[:joints]]
