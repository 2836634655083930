"""Regions of a plane between circles: the area that several annuli have in common, by their arcs.

The border of the region consists of arcs of the circles. Each circle is cut where it crosses the
others; an arc whose middle lies in all annuli belongs to the border. The area follows from these
arcs by Green's theorem, exactly:

    2 A = sum over arcs, counterclockwise around the region, of
          r^2 (b - a) + r (c_x (sin b - sin a) - c_y (cos b - cos a))
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_TURN = 2 * math.pi
_SAME = 1e-12
"""Distance below which circles coincide and points lie on a circle, in parts of the radii."""


@dataclass(frozen=True, eq=False)
class Annulus:
    """All points of a plane whose distance from a center lies between two radii.

    Attributes:
        center: (2,) [m].
        inner: The lesser radius [m]; 0 for a disk.
        outer: The larger radius [m].
    """

    center: FloatArray
    inner: float
    outer: float

    def contains(self, points: FloatArray, slack: float = 0.0) -> NDArray[np.bool_]:
        """Whether points (m, 2) lie in it, up to a slack [m]."""
        d = np.linalg.norm(points - self.center, axis=-1)
        return np.asarray((d >= self.inner - slack) & (d <= self.outer + slack))


@dataclass(frozen=True, eq=False)
class BorderArc:
    """An arc of the border, with the region to its left.

    Attributes:
        center: (2,) [m].
        radius: [m].
        start: Angle at its start [rad].
        end: Angle at its end [rad]; less than the start where it runs clockwise.
    """

    center: FloatArray
    radius: float
    start: float
    end: float

    def points(self, count: int = 60) -> FloatArray:
        """(count, 2) points on it [m]."""
        angle = np.linspace(self.start, self.end, count)
        return np.asarray(
            self.center + self.radius * np.column_stack([np.cos(angle), np.sin(angle)])
        )

    @property
    def twice_area(self) -> float:
        """Its part of twice the area by Green's theorem [m^2]."""
        a, b, r, (x, y) = self.start, self.end, self.radius, self.center
        shift = x * (math.sin(b) - math.sin(a)) - y * (math.cos(b) - math.cos(a))
        return float(r * r * (b - a) + r * shift)


def border(annuli: Sequence[Annulus]) -> list[BorderArc]:
    """The arcs that bound what all annuli have in common; none where that is empty."""
    found = []
    for k, own in enumerate(annuli):
        for radius, outward in ((own.outer, True), (own.inner, False)):
            if radius <= 0:
                continue
            others = [other for j, other in enumerate(annuli) if j != k]
            for a, b in itertools.pairwise(_cuts(own.center, radius, others)):
                middle = own.center + radius * np.array(
                    [math.cos((a + b) / 2), math.sin((a + b) / 2)]
                )
                if all(other.contains(middle, _SAME * other.outer) for other in others):
                    found.append(BorderArc(own.center, radius, *((a, b) if outward else (b, a))))
    return found


def area(annuli: Sequence[Annulus]) -> float:
    """The area that annuli have in common [m^2]."""
    return sum(arc.twice_area for arc in border(annuli)) / 2


def _cuts(center: FloatArray, radius: float, others: Sequence[Annulus]) -> list[float]:
    """Angles over one turn at which a circle crosses circles, from one of them to the same one."""
    angles: list[float] = []
    for other in others:
        step = other.center - center
        d = float(np.hypot(*step))
        for r in (other.inner, other.outer):
            if d <= _SAME * radius or r <= 0:
                continue
            cosine = (radius**2 + d**2 - r**2) / (2 * radius * d)
            if abs(cosine) < 1:
                towards, half = math.atan2(step[1], step[0]), math.acos(cosine)
                angles += [(towards - half) % _TURN, (towards + half) % _TURN]
    angles = sorted(angles) or [0.0]
    return [*angles, angles[0] + _TURN]
