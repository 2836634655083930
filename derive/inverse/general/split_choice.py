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

from ...model.tolerances import DETERMINANT_TAIL, SINGLE_SOLUTION
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
"""Configurations at which a split is tried."""
KEPT = 3
"""Splits that are kept: where one fails at a pose, the next is tried."""
PRIMES = (2, 3, 5, 7, 11, 13, 17)


@dataclass(frozen=True)
class Rating:
    """How well a split does.

    Attributes:
        split: The split.
        good: Part of the configurations at which it is good.
        separation: Median of the singular values' ratio there, as its decimal logarithm.
        fit: Part of the configurations at which det M has degree 8.
    """

    split: Split
    good: float
    separation: float
    fit: float

    @property
    def key(self) -> tuple[float, float]:
        """The greater, the better."""
        return self.good, self.separation


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
    def splits(self) -> tuple[Split, ...]:
        """The splits, over the indices of the six joints that are solved for."""
        return tuple(rating.split for rating in self.ratings)


def choose(constants: Sequence[Array]) -> Choice | None:
    """The splits of an arm of six or seven revolute joints, or None where none is good.

    Args:
        constants: The placements before, between and behind its joints, as floats.
    """
    givens = [None] if len(constants) == JOINTS + 1 else range(len(constants) - 1)
    choices = [Choice(given, _ratings(constants, given)) for given in givens]
    found = [c for c in choices if c.ratings and c.ratings[0].good > 0]
    # Of equals the joint nearest to the tool is given: an operator sets it most easily.
    return max(reversed(found), key=lambda choice: choice.ratings[0].key, default=None)


def without(constants: Sequence[Array], given: int | None, angle: float) -> list[Array]:
    """The placements of the six joints that are left where one is given, at its angle (radian)."""
    if given is None:
        return list(constants)
    joined = constants[given] @ turned(angle) @ constants[given + 1]
    return [*constants[:given], joined, *constants[given + 2 :]]


def _ratings(constants: Sequence[Array], given: int | None) -> tuple[Rating, ...]:
    """The best splits, no two of the same order of joints, the best first."""
    ratings = sorted(_rated(constants, given), key=lambda rating: rating.key, reverse=True)
    kept: list[Rating] = []
    for rating in ratings:
        orders = [(other.split.joints, other.split.sense) for other in kept]
        if rating.fit > 0 and (rating.split.joints, rating.split.sense) not in orders:
            kept.append(rating)
    return tuple(kept[:KEPT])


def _rated(constants: Sequence[Array], given: int | None) -> list[Rating]:
    found: dict[Split, list[float]] = {split: [] for split in splits()}
    for angles in configurations(len(constants) - 1):
        six = without(constants, given, 0.0 if given is None else angles[given])
        q = [angle for k, angle in enumerate(angles) if k != given]
        scaled, by_order = _scaled([*six, forward(six, q)], length(six)), {}
        for split, values in found.items():
            order = split.joints, split.sense
            if order not in by_order:
                by_order[order] = equations(scaled[:-1], split, scaled[-1])
            values.append(_separation(by_order[order], split, q))
    return [_rating(split, np.array(values)) for split, values in found.items()]


def _rating(split: Split, separations: Array) -> Rating:
    good, fit = separations > SINGLE_SOLUTION, np.isfinite(separations)
    median = float(np.median(np.log10(separations[good]))) if good.any() else -np.inf
    return Rating(split, float(good.mean()), median, float(fit.mean()))


def _scaled(poses: Sequence[Array], size: float) -> list[Array]:
    """Poses with lengths in parts of a length."""
    return [np.vstack([np.hstack([T[:3, :3], T[:3, 3:] / size]), T[3:]]) for T in poses]


def length(constants: Sequence[Array]) -> float:
    """The sum of the distances between the arm's frames (metre), 1 where there are none."""
    return sum(float(np.linalg.norm(E[:3, 3])) for E in constants[1:]) or 1.0


def _separation(found: LineEquations, split: Split, q: Sequence[float]) -> float:
    """Second smallest singular value at a solution over the greatest; NaN for a bad split."""
    M = suppressed(found, split.halved)
    turns = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    sampled = np.tensordot(np.array([np.ones(SAMPLES), np.cos(turns), np.sin(turns)]).T, M, 1)
    degrees = np.abs(np.fft.rfft(np.linalg.det(sampled)))
    if not degrees[DEGREE + 1 :].max() < DETERMINANT_TAIL * degrees.max():
        return np.nan
    angle = split.sense * q[split.joints[2]]
    at = np.tensordot(np.array([1.0, np.cos(angle), np.sin(angle)]), M, 1)
    sizes = np.linalg.svd(at, compute_uv=False)
    return float(sizes[-2] / sizes[0])


def configurations(joints: int) -> list[list[float]]:
    """Evenly distributed configurations without a pattern: multiples of square roots modulo 1."""
    return [
        [2 * np.pi * (k * p**0.5 % 1) for p in PRIMES[:joints]]
        for k in range(1, CONFIGURATIONS + 1)
    ]
