"""Symmetric arrangements whose points a file rounds.

The legs of a platform are copies of each other, turned by 120 degrees, say. A file writes
(200, 0, 0), and (-100, 173.2050807569, 0) for its copy. Of the points of one body that are turned
into each other about an axis of its frame by multiples of 15 degrees, the point with the fewest
places stays, and each other one becomes its exact copy. A distance between two points of a body
that a file rounds, such as the length of a rod in a parallelogram, becomes the exact root.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations

import sympy as sp

from ..model.cleaning import decimal_places
from ..model.placements import Vector
from ..model.roots import root
from ..model.tolerances import CHANCE, NOISE_GAP

_STEP = math.pi / 12
_RIGHT_ANGLE = 6
"""Steps of a right angle."""
_AXES = (2, 0, 1)
"""Axes about which copies are turned, z first: legs mostly stand around it."""
_LAST_PLACES = 1.5
"""Difference of a rounded component from the copy of a rounded point, in units of the last place:
half of one each, the second half turned by up to 45 degrees."""


def arranged(bodies: Iterable[Iterable[Vector]], noise: float) -> dict[Vector, Vector]:
    """Exact points for the points that are rounded copies of others on their body.

    Args:
        bodies: The points of each body, decimals without noise (metre).
        noise: Least difference that counts as rounding (metre).

    Returns:
        An exact point for each copy. The same point has the same exact point on every body.
    """
    found: dict[Vector, Vector] = {}
    for points in bodies:
        decimals = {point: places for point in points if (places := _places(point)) is not None}
        originals: list[Vector] = []
        for point in sorted(decimals, key=decimals.__getitem__):
            if point in found:
                continue
            rounding = max(_LAST_PLACES / 10 ** decimals[point], noise)
            copy = _copy(point, originals, rounding, noise)
            if copy is None:
                originals.append(point)
            elif copy != point:
                found[point] = copy
    return found


def _places(point: Vector) -> int | None:
    """The places of a point that an arrangement may hold; None for any other point."""
    places = [decimal_places(component) for component in point]
    if any(count is None for count in places) or not any(point):
        return None
    return max(count or 0 for count in places)


def _copy(
    point: Vector, originals: Sequence[Vector], rounding: float, noise: float
) -> Vector | None:
    """The exact copy of one of some points that a point agrees with to its rounding.

    A copy at a right angle has the decimals of its original, so that no rounding parts them.
    """
    here = tuple(map(float, point))
    for original in originals:
        there = tuple(map(float, original))
        for axis in _AXES:
            i, j = (axis + 1) % 3, (axis + 2) % 3
            radius = math.hypot(there[i], there[j])
            if rounding > CHANCE * radius:
                continue
            turn = math.atan2(here[j], here[i]) - math.atan2(there[j], there[i])
            steps = round(turn / _STEP)
            c, s = math.cos(steps * _STEP), math.sin(steps * _STEP)
            off = (
                here[axis] - there[axis],
                here[i] - c * there[i] + s * there[j],
                here[j] - s * there[i] - c * there[j],
            )
            if max(map(abs, off)) <= (rounding if steps % _RIGHT_ANGLE else noise):
                return _turned(original, axis, steps)
    return None


def _turned(point: Vector, axis: int, steps: int) -> Vector:
    """A point turned about an axis of its frame by a number of steps of 15 degrees."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s = (f(steps * sp.pi / 12) for f in (sp.cos, sp.sin))
    turned = list(point)
    turned[i] = sp.expand(c * point[i] - s * point[j])
    turned[j] = sp.expand(s * point[i] + c * point[j])
    x, y, z = turned
    return x, y, z


class Distances:
    """Distances between points of one body that a file has to round."""

    def __init__(self, bodies: Iterable[Iterable[Vector]], noise: float) -> None:
        """Notes the distances.

        Args:
            bodies: The points of each body, exact (metre).
            noise: Least difference that counts as rounding (metre).
        """
        self._noise = noise
        squares = {square for points in bodies for square in _squares(points)}
        self._roots = {square: math.sqrt(square) for square in sorted(squares)}

    def exact(self, length: sp.Expr) -> sp.Expr:
        """The distance that a positive length stands for, else the length itself."""
        places = decimal_places(length)
        if places is None:
            return length
        rounding = max(_LAST_PLACES / 10**places, self._noise)
        if rounding * NOISE_GAP > length:
            return length
        agreeing = (s for s, d in self._roots.items() if abs(d - float(length)) <= rounding)
        square = next(agreeing, None)
        return length if square is None else root(square)


def _squares(points: Iterable[Vector]) -> Iterator[sp.Rational]:
    """The squared distances between points of numbers whose roots are no fractions."""
    numbers = [point for point in points if not any(c.free_symbols for c in point)]
    for a, b in combinations(dict.fromkeys(numbers), 2):
        square = sp.expand(sum((p - q) ** 2 for p, q in zip(a, b, strict=True)))
        if square.is_Rational and not _is_square(square):
            yield square


def _is_square(square: sp.Rational) -> bool:
    return all(math.isqrt(n) ** 2 == n for n in (square.p, square.q))
