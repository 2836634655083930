"""Restores symmetric arrangements of points whose coordinates are rounded in a file.

For example, a platform may have three equal legs, rotated by 120 degrees. A file then contains
(200, 0, 0) and the rounded copy (-100, 173.2050807569, 0). Two points of a body belong to the same
group if a rotation by a multiple of 15 degrees about a frame axis maps the first point to the
second point. In each group, the point with the fewest decimal places is not changed. The other
points of the group become exact rotated copies of this point. A rounded distance between two points
of a body becomes an exact root, for example a rod length in a parallelogram.
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
"""Number of 15-degree steps in a right angle."""
_AXES = (2, 0, 1)
"""Rotation axes in the order in which they are tried. Legs are usually arranged about z."""
_LAST_PLACES = 1.5
"""Maximum rounding error of a coordinate, in units of its last decimal place. Both points of a pair
may have rounding errors of half a unit, and the rotation may increase the error."""


def arranged(bodies: Iterable[Iterable[Vector]], noise: float) -> dict[Vector, Vector]:
    """Return exact coordinates for points whose coordinates are rounded in a file.

    A rounded point is a copy of another point of the body, rotated by a multiple of 15 degrees.

    Args:
        bodies: The points of each body (meter), as decimals from which noise was removed.
        noise: Difference (meter) up to which numbers always count as rounded.

    Returns:
        A dictionary from each rounded point to its exact point.
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
    """Return the largest number of decimal places among the coordinates of a point.

    Returns None for the origin, and if a coordinate is not a decimal number.
    """
    places = [decimal_places(component) for component in point]
    if any(count is None for count in places) or not any(point):
        return None
    return max(count or 0 for count in places)


def _copy(
    point: Vector, originals: Sequence[Vector], rounding: float, noise: float
) -> Vector | None:
    """Return the rotated copy of an original point that is closest to ``point``, or None.

    The coordinates of the rotated point are exact.
    """
    copies = [
        (off, original, axis, steps)
        for original in originals
        if not _is_mirrored(point, original)
        for off, axis, steps in _rotations(point, original, rounding, noise)
    ]
    if not copies:
        return None
    _, original, axis, steps = min(copies, key=lambda copy: copy[0])
    return _turned(original, axis, steps)


def _is_mirrored(point: Vector, original: Vector) -> bool:
    """Whether two points differ only in the signs of their components."""
    return point != original and all(abs(p) == abs(q) for p, q in zip(point, original, strict=True))


def _rotations(
    point: Vector, original: Vector, rounding: float, noise: float
) -> Iterator[tuple[float, int, int]]:
    """Yield (deviation, axis, steps) for each rotation that moves ``original`` to ``point``.

    One step is 15 degrees.

    A rotation by a multiple of 90 degrees only exchanges coordinates or changes their signs, so the
    deviation must not exceed ``noise``. For other rotations, the deviation must not exceed
    ``rounding``.
    """
    here, there = tuple(map(float, point)), tuple(map(float, original))
    for axis in _AXES:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        if rounding > CHANCE * math.hypot(there[i], there[j]):
            continue
        turn = math.atan2(here[j], here[i]) - math.atan2(there[j], there[i])
        steps = round(turn / _STEP)
        c, s = math.cos(steps * _STEP), math.sin(steps * _STEP)
        off = (
            here[axis] - there[axis],
            here[i] - c * there[i] + s * there[j],
            here[j] - s * there[i] - c * there[j],
        )
        deviation = max(map(abs, off))
        if deviation <= (rounding if steps % _RIGHT_ANGLE else noise):
            yield deviation, axis, steps


def _turned(point: Vector, axis: int, steps: int) -> Vector:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s = (f(steps * sp.pi / 12) for f in (sp.cos, sp.sin))
    turned = list(point)
    turned[i] = sp.expand(c * point[i] - s * point[j])
    turned[j] = sp.expand(s * point[i] + c * point[j])
    x, y, z = turned
    return x, y, z


class Distances:
    """Irrational distances between points of one body.

    A robot file contains only rounded values of these distances.
    """

    def __init__(self, bodies: Iterable[Iterable[Vector]], noise: float) -> None:
        """Collect the distances.

        Args:
            bodies: The exact points of each body (meter).
            noise: Difference (meter) up to which numbers always count as rounded.
        """
        self._noise = noise
        squares = {square for points in bodies for square in _squares(points)}
        self._roots = {square: math.sqrt(square) for square in sorted(squares)}

    def exact(self, length: sp.Expr) -> sp.Expr:
        """Return the exact distance between two points that agrees with a rounded length.

        If no exact distance agrees with the length, return the length unchanged.
        """
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
    numbers = [point for point in points if not any(c.free_symbols for c in point)]
    for a, b in combinations(dict.fromkeys(numbers), 2):
        square = sp.expand(sum((p - q) ** 2 for p, q in zip(a, b, strict=True)))
        if square.is_Rational and not _is_square(square):
            yield square


def _is_square(square: sp.Rational) -> bool:
    return all(math.isqrt(n) ** 2 == n for n in (square.p, square.q))
