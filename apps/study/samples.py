"""Sample points within the coordinate limits of a robot.

A sample set is not stored, because it may contain a billion configurations. A sample set is a
sequence of pieces of 2^16 points. Each piece of a sample set depends only on the index of the piece
and the random seed. A sample set is therefore the same for any number of threads, processes and
machines.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import requires
from chasles.summaries import short_repr

from .arguments import integer_at_least

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.uint64]
Sampling = Literal["sobol", "uniform", "grid"]

PIECE = 1 << 16
"""Number of sample points that a thread processes as one piece of work. A Sobol net with this
number of points fits in the CPU cache."""
BLOCK = 1 << 12
"""Number of sample points that are processed at once. The poses and Jacobians of this number of
points fit in the CPU cache."""
_BITS = 52
"""Number of bits of each coordinate of a sample point in the unit cube."""
_NET_KEY = 0
"""Second number of the random seed of the scrambled Sobol net. The first number is the seed of the
sample set.

The random seeds of the pieces of a sample set have 1, 2, and so on as second number."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Sample points in a box of coordinates.

    Attributes:
        lower: (n,) smallest coordinates [rad or m].
        upper: (n,) largest coordinates [rad or m].
        count: Number of points.
        sampling: "sobol", "uniform" or "grid". With "sobol", each piece is a Sobol net with its own
            random digital shift. With "uniform", the points are random and independent. With
            "grid", the points are the nodes of a grid that has equally many nodes along each
            coordinate and includes both limits of each coordinate.
        key: Seed of the random numbers. Equal seeds generate equal points.
    """

    lower: FloatArray
    upper: FloatArray
    count: int
    sampling: Sampling
    key: int

    __repr__ = short_repr

    @property
    def pieces(self) -> int:
        """Number of pieces.

        Each piece has 2^16 points, but the last piece may have fewer.
        """
        return -(-self.count // PIECE)

    def blocks(self, piece: int) -> Iterator[FloatArray]:
        """Yield the sample points of a piece in blocks (m, n), with m at most `BLOCK`.

        Each block of sample points may overwrite the memory of the previous block.

        Args:
            piece: Index of the piece, from 0.
        """
        size = min(PIECE, self.count - piece * PIECE)
        if self.sampling == "grid":
            yield from self._nodes(piece * PIECE, size)
            return
        span = self.upper - self.lower
        for block in self._cube(piece, size):
            np.multiply(block, span, out=block)
            yield np.add(block, self.lower, out=block)

    def _nodes(self, first: int, size: int) -> Iterator[FloatArray]:
        n = len(self.lower)
        side = _side(self.count, n)
        places = [np.linspace(a, b, side) for a, b in zip(self.lower, self.upper, strict=True)]
        for begin in range(first, first + size, BLOCK):
            index = np.arange(begin, min(begin + BLOCK, first + size))
            node = np.unravel_index(index, (side,) * n)
            yield np.column_stack([own[k] for own, k in zip(places, node, strict=True)])

    def _cube(self, piece: int, size: int) -> Iterator[FloatArray]:
        """Yield the sample points of a piece in blocks, as points in the unit cube."""
        n = len(self.lower)
        digits = np.random.default_rng([self.key, piece + 1])
        block = np.empty((BLOCK, n))
        if self.sampling == "uniform":
            for begin in range(0, size, BLOCK):
                some = block[: min(BLOCK, size - begin)]
                yield digits.random(out=some)
            return
        net = _net(n, self.key)
        shift = digits.integers(0, 1 << _BITS, size=n, dtype=np.uint64)
        shifted = np.empty((BLOCK, n), dtype=np.uint64)
        for begin in range(0, size, BLOCK):
            m = min(BLOCK, size - begin)
            np.bitwise_xor(net[begin : begin + m], shift, out=shifted[:m])
            yield np.multiply(shifted[:m], 2.0**-_BITS, out=block[:m])


def samples_of(robot: Robot, count: int, sampling: Sampling, key: int) -> Samples:
    """Return sample points within a robot's limits.

    A revolute joint without limits is sampled over one turn.

    Args:
        robot: The robot.
        count: Number of points. For sampling "grid" with n coordinates, the number of points is
            rounded down to k^n with an integer k.
        sampling: As in `Samples`.
        key: As in `Samples`.

    Raises:
        InputValueError: A prismatic coordinate has no limits, `count` is too small, or `sampling`
            is unknown.
    """
    if sampling not in get_args(Sampling):
        expected = ", ".join(get_args(Sampling))
        raise InputValueError(f"sampling = {sampling!r}: expected one of {expected}")
    count = integer_at_least("samples", count, 1)
    lower, upper = box_of(robot)
    if sampling == "grid":
        side = _side(count, robot.n)
        if side < 2:  # noqa: PLR2004 - a grid has both limits of each coordinate
            raise InputValueError(
                f"samples = {count}: too few nodes for a grid; expected at least {2**robot.n} for "
                f"{robot.n} coordinates"
            )
        count = side**robot.n
    return Samples(lower, upper, count, sampling, key)


def box_of(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper limits (n,).

    A revolute joint without limits gets a range of one turn.

    Raises:
        InputValueError: A prismatic coordinate of the robot has no limits.
    """
    lower, upper = robot.lower.copy(), robot.upper.copy()
    for i, coordinate in enumerate(robot.coordinates):
        if np.isfinite([lower[i], upper[i]]).all():
            continue
        if coordinate.unit != "rad":
            raise InputValueError(
                f"{robot.name}: prismatic coordinate {coordinate.name}: the workspace is unbounded "
                "without limits; state limits in the robot file"
            )
        lower[i], upper[i] = _one_turn(lower[i], upper[i])
    return lower, upper


def _one_turn(lower: float, upper: float) -> tuple[float, float]:
    if math.isfinite(lower):
        return lower, lower + 2 * math.pi
    if math.isfinite(upper):
        return upper - 2 * math.pi, upper
    return -math.pi, math.pi


def _side(count: int, n: int) -> int:
    """Return the largest integer k with k^n at most `count`."""
    side = int(count ** (1 / n))
    return side + 1 if (side + 1) ** n <= count else side


@lru_cache(maxsize=4)
def _net(n: int, key: int) -> IntArray:
    """Return the (2^16, n) points of a scrambled Sobol net as integers."""
    with requires("chasles[study]"):
        from scipy.stats import qmc  # noqa: PLC0415

    digits = np.random.default_rng([key, _NET_KEY])
    points = qmc.Sobol(n, scramble=True, bits=_BITS, rng=digits).random(PIECE)
    return np.asarray(points * 2.0**_BITS, dtype=np.uint64)
