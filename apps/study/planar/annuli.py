"""Border arcs and area of the intersection of several annuli.

The border of the intersection of annuli consists of circular arcs. Each circle of an annulus is cut
into arcs at its intersections with the circles of the other annuli. Such an arc belongs to the
border if its midpoint lies in all annuli. Each border arc has the radius r and the center (c_x,
c_y), and extends from angle a to angle b. Green's theorem gives the exact area A of the
intersection from its border arcs:

    2 A = sum of r^2 (b - a) + r (c_x (sin b - sin a) - c_y (cos b - cos a)) over the arcs,
    counterclockwise around the region
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
"""Relative tolerance for circles with the same center, and for points on a circle."""


@dataclass(frozen=True, eq=False)
class Annulus:
    """All points of a plane between two concentric circles.

    Attributes:
        center: (2,) center [m].
        inner: Inner radius [m], or 0 for a disk.
        outer: Outer radius [m].
    """

    center: FloatArray
    inner: float
    outer: float

    def contains(self, points: FloatArray, slack: float = 0.0) -> NDArray[np.bool_]:
        """Return whether points (m, 2) lie in the annulus, up to a tolerance [m]."""
        d = np.linalg.norm(points - self.center, axis=-1)
        return np.asarray((d >= self.inner - slack) & (d <= self.outer + slack))


@dataclass(frozen=True, eq=False)
class BorderArc:
    """A directed circular arc on the boundary of a region.

    The region is on the left of the arc, seen from start to end.

    Attributes:
        center: (2,) center [m].
        radius: Radius [m].
        start: Angle at the start of the arc [rad].
        end: Angle at the end of the arc [rad]. For a clockwise arc, the end angle is less than the
            start angle.
    """

    center: FloatArray
    radius: float
    start: float
    end: float

    def points(self, count: int = 60) -> FloatArray:
        """Return points (count, 2) on the arc [m]."""
        angle = np.linspace(self.start, self.end, count)
        return np.asarray(
            self.center + self.radius * np.column_stack([np.cos(angle), np.sin(angle)])
        )

    @property
    def twice_area(self) -> float:
        """Return the contribution of the arc to twice the area, by Green's theorem [m^2]."""
        a, b, r, (x, y) = self.start, self.end, self.radius, self.center
        shift = x * (math.sin(b) - math.sin(a)) - y * (math.cos(b) - math.cos(a))
        return float(r * r * (b - a) + r * shift)


def border(annuli: Sequence[Annulus]) -> list[BorderArc]:
    """Return the arcs on the boundary of the intersection of annuli."""
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
    """Return the area of the intersection of annuli [m^2]."""
    return sum(arc.twice_area for arc in border(annuli)) / 2


def _cuts(center: FloatArray, radius: float, others: Sequence[Annulus]) -> list[float]:
    """Return the sorted angles at which the circles of other annuli cross a circle.

    The last entry of the list is the first angle plus 2 pi. If no other circle crosses the circle,
    the angles are 0 and 2 pi.
    """
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
