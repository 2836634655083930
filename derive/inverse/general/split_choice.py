"""The splits of a general arm that separate its solutions best, and the joint to be given of seven.

Where neighbouring axes of the arm meet or are parallel, many splits give a determinant of M that
vanishes for every angle of the suppressed joint, or that does not tell some solutions apart. So all
splits are tried at many configurations. A split is good at a configuration where det M is a
trigonometric polynomial of degree 8 in the suppressed angle, and where the second smallest singular
value of M at the solution is far from zero; the greater it is, the better.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...model.tolerances import DETERMINANT_TAIL, SEPARATE, SINGLE_SOLUTION
from .line_quantities import Array
from .raghavan_roth import (
    JOINTS,
    LineEquations,
    Split,
    equations,
    forward,
    splits,
    suppressed,
    turned,
)

SAMPLES = 32
"""Angles at which the determinant of a split is sampled."""
DEGREE = 8
"""Degree of the determinant in the suppressed angle: sixteen solutions."""
CONFIGURATIONS = 12
"""Configurations at which a split of six joints is tried."""
GIVEN_CONFIGURATIONS, AT_RIGHT_ANGLES = 8, 2
"""The same for seven, and how many more with the given joint at each right angle."""
KEPT, MOST_KEPT = 3, 4
"""Splits that are kept: where one fails at a pose, the next is tried. A fourth is kept only if it
is good where the others are not."""
PRIMES = (2, 3, 5, 7, 11, 13, 17)


@dataclass(frozen=True)
class Rating:
    """How well a split does.

    Attributes:
        split: The split.
        separations: At each configuration the ratio of the singular values; NaN where det M does
            not have degree 8.
    """

    split: Split
    separations: tuple[float, ...]

    @property
    def good_at(self) -> frozenset[int]:
        """Indices of the configurations at which it is good."""
        return frozenset(k for k, s in enumerate(self.separations) if s > SINGLE_SOLUTION)

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
        there = [self.separations[k] for k in self.good_at]
        return self.good, float(np.median(there)) if there else 0.0


@dataclass(frozen=True)
class Choice:
    """The splits by which an arm is solved.

    Attributes:
        given: Index of the joint that is given, if the arm has seven.
        ratings: The splits that are kept, the best first.
    """

    given: int | None
    ratings: tuple[Rating, ...]

    @property
    def good(self) -> float:
        """Part of the configurations at which some split is good."""
        found = frozenset[int]().union(*(rating.good_at for rating in self.ratings))
        return len(found) / len(self.ratings[0].separations)

    @property
    def splits(self) -> tuple[Split, ...]:
        """The splits, over the indices of the six joints that are solved for."""
        return tuple(rating.split for rating in self.ratings)


def choose(constants: Sequence[Array]) -> Choice | None:
    """The splits of an arm of six or seven revolute joints, or None where none is good.

    Args:
        constants: The placements before, between and behind its joints, as floats.
    """
    givens = [None] if len(constants) == JOINTS + 1 else range(len(constants) - 1)
    found = [choice for given in givens if (choice := choice_at(constants, given))]
    # Of equals the joint nearest to the tool is given: an operator sets it most easily.
    return max(reversed(found), key=lambda c: (c.good, c.ratings[0].key), default=None)


def choice_at(
    constants: Sequence[Array], given: int | None, apart: Sequence[float] = ()
) -> Choice | None:
    """The splits where the joint of this index is given, or None where none is good.

    Args:
        constants: The placements before, between and behind the joints, as floats.
        given: The index.
        apart: How far solutions are apart in each of the six joints (radian), if it is known: those
            of an arm near a structure often share some joints, in which no root tells them apart.
    """
    choice = Choice(given, _ratings(constants, given, apart))
    return choice if choice.ratings and choice.good > 0 else None


def without(constants: Sequence[Array], given: int | None, angle: float) -> list[Array]:
    """The placements of the six joints that are left where one is given, at its angle (radian)."""
    if given is None:
        return list(constants)
    joined = constants[given] @ turned(angle) @ constants[given + 1]
    return [*constants[:given], joined, *constants[given + 2 :]]


def _ratings(
    constants: Sequence[Array], given: int | None, apart: Sequence[float]
) -> tuple[Rating, ...]:
    """The best splits, no two of the same order of joints, the best first.

    Where it is known how far solutions are apart, splits by joints that tell them apart are
    preferred, each by another one: solutions that meet in one joint may differ in the next.
    """

    def tells_apart(rating: Rating) -> tuple[bool, bool]:
        joint = rating.split.joints[2]
        is_new = all(joint != other.split.joints[2] for other in kept)
        return not apart or apart[joint] > SEPARATE, not apart or is_new

    left = [rating for rating in _rated(constants, given) if rating.is_fit]
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


def _rated(constants: Sequence[Array], given: int | None) -> list[Rating]:
    found: dict[tuple[tuple[int, ...], int], list[LineEquations]] = {}
    orders = {_order(split): split for split in splits()}
    configured = configurations(len(constants) - 1, given)
    for angles in configured:
        six = without(constants, given, 0.0 if given is None else angles[given])
        scaled = _scaled([*six, forward(six, _solved(angles, given))], length(six))
        for order, split in orders.items():
            found.setdefault(order, []).append(equations(scaled[:-1], split, scaled[-1]))
    stacked = {
        order: LineEquations(np.stack([e.left for e in each]), np.stack([e.right for e in each]))
        for order, each in found.items()
    }
    q = np.array([_solved(angles, given) for angles in configured])
    return [
        Rating(split, tuple(_separations(stacked[_order(split)], split, q))) for split in splits()
    ]


def _solved(angles: Sequence[float], given: int | None) -> list[float]:
    """The angles of the joints that are not given."""
    return [angle for k, angle in enumerate(angles) if k != given]


def _scaled(poses: Sequence[Array], size: float) -> list[Array]:
    """Poses with lengths in parts of a length."""
    return [np.vstack([np.hstack([T[:3, :3], T[:3, 3:] / size]), T[3:]]) for T in poses]


def length(constants: Sequence[Array]) -> float:
    """The sum of the distances between the arm's frames (metre), 1 where there are none."""
    return sum(float(np.linalg.norm(E[:3, 3])) for E in constants[1:]) or 1.0


def _separations(found: LineEquations, split: Split, q: Array) -> list[float]:
    """Second smallest singular value at solutions q (C, 6) over the greatest; NaN for a bad split.

    Args:
        found: The equations of each pose, (C, 14, 9) and (C, 3, 14, 9).
        split: Their split.
        q: The six angles at each pose.
    """
    M = suppressed(found, split.halved)
    turns = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    degrees = np.abs(np.fft.rfft(np.linalg.det(_at(turns, M[:, None]))))
    is_fit = degrees[:, DEGREE + 1 :].max(-1) < DETERMINANT_TAIL * degrees.max(-1)
    sizes = np.linalg.svd(_at(split.sense * q[:, split.joints[2]], M), compute_uv=False)
    parts = np.full(len(q), np.nan)
    np.divide(sizes[:, -2], sizes[:, 0], out=parts, where=is_fit)
    return [float(part) for part in parts]


def _at(angle: Array, M: Array) -> Array:
    """M (..., 3, 12, 12) of 1, cos and sin of an angle at angles (...), as (..., 12, 12)."""
    c, s = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    return np.asarray(M[..., 0, :, :] + c * M[..., 1, :, :] + s * M[..., 2, :, :])


def configurations(joints: int, given: int | None) -> list[list[float]]:
    """Evenly distributed configurations without a pattern: multiples of square roots modulo 1.

    Where a joint is given, it is at each right angle in some of them: the six that are left often
    have a structure there.
    """
    if given is None:
        return [_spread(joints, k) for k in range(CONFIGURATIONS)]
    found = [_spread(joints, k) for k in range(GIVEN_CONFIGURATIONS + 4 * AT_RIGHT_ANGLES)]
    for k, q in enumerate(found[GIVEN_CONFIGURATIONS:]):
        q[given] = k % 4 * np.pi / 2
    return found


def _spread(joints: int, k: int) -> list[float]:
    return [2 * np.pi * ((k + 1) * p**0.5 % 1) for p in PRIMES[:joints]]
