"""Bodies of revolution that a rotating planar region sweeps.

The rotating region lies in a vertical plane at the distance d from a vertical axis. A point of the
region has the horizontal coordinate u and the height v in the plane. In the plane, the line u = 0
has the smallest distance from the axis. In a full turn, the point (u, v) describes a circle of
radius rho = sqrt(u^2 + d^2) at height v. The points (u, v) and (-u, v) describe the same circle.
Since rho d(rho) = u du, the swept volume is an integral over the planar region (theorem of Pappus).

In a rotation by an angle s of less than a full turn, the point (u, v) describes an arc of angle s.
The point (-u, v) describes a second arc on the same circle. The start of the second arc is the
start of the first arc, rotated by pi - 2 a(u), with a(u) = atan2(d, u). If (u, v) and (-u, v)
belong to the region, their arcs overlap by the following angle:

    max(0, s - pi + 2 a) + max(0, s - pi - 2 a)

The swept volume counts the overlap of the two arcs only once. Let m+ and m- be the integrals of |u|
over the parts of the region with u > 0 and u < 0. Let C be the intersection of the region with its
reflection at the line u = 0. The volume is

    V = s (m+ + m-) - integral over C, u > 0, of u (max(0, s - pi + 2 a) + max(0, s - pi - 2 a))

Green's theorem replaces the integral of f(u) over a region by the integral of F(u) dv along the
border, with F' = f.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles.contract import requires
from chasles.summaries import summary_repr

from ..tolerances import SAME_ARC
from .annuli import BorderArc
from .arc_regions import ArcRegion, common, united

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TURN = 2 * math.pi
_EXACT = 1e-13
"""Relative tolerance of an integral along an arc."""


@dataclass(frozen=True, eq=False)
class Meridian:
    """The meridian section of a body of revolution, with points (distance from the axis, height).

    Attributes:
        both: The union of the rotating planar region with its mirror image at the line u = 0.
        offset: The distance of the plane from the axis [m].
    """

    both: ArcRegion
    offset: float

    def __repr__(self) -> str:
        """Short summary with the main values."""
        return summary_repr(
            self,
            "",
            f"area {self.area:.12g} m^2",
            f"{self.offset:.6g} m from the axis",
            methods="contains(points)",
        )

    @property
    def area(self) -> float:
        """The area of the meridian section in (rho, z) [m^2], with relative error 1e-12."""
        if not self.both.solid:
            return 0.0
        d = self.offset
        if d == 0:
            return self.both.area / 2
        return _along(self.both.arcs, lambda u: math.hypot(u, d) - d, (0.0,))

    @property
    def bounds(self) -> FloatArray:
        """(2, 2) smallest and largest rho and z [m], exact up to rounding errors."""
        (_, v_0), (u_1, v_1) = self.both.bounds
        nearest = [np.abs(u).min() for u, _ in self._pieces()]
        return np.array(
            [[math.hypot(min(nearest), self.offset), v_0], [math.hypot(u_1, self.offset), v_1]]
        )

    def contains(self, points: FloatArray) -> BoolArray:
        """Return whether points (rho, z) (m, 2) are reached at some angle of the rotation."""
        rho, z = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        u = np.sqrt(np.maximum((rho - self.offset) * (rho + self.offset), 0))
        inside = self.both.contains(np.column_stack([u, z]))
        return np.asarray(inside & (rho >= self.offset))

    def curves(self) -> list[FloatArray]:
        """Return the border of the meridian section as curves (k, 2) of points (rho, z) [m].

        The points with u = 0 are the points of the plane that are nearest to the axis. If `offset`
        is not 0 and the region contains segments of the line u = 0, the border includes these
        segments at rho = `offset`.
        """
        found = [np.column_stack([np.hypot(u, self.offset), v]) for u, v in self._pieces()]
        return found + (self._nearest() if self.offset else [])

    def _nearest(self) -> list[FloatArray]:
        """Return the segments of the line u = 0 inside the region."""
        at = [
            arc.center[1] + arc.radius * math.sin(t)
            for arc in self.both.arcs
            for t in _cuts(arc, (0.0,))
            if abs(arc.center[0] + arc.radius * math.cos(t)) <= SAME_ARC * arc.radius
        ]
        found = []
        for a, b in itertools.pairwise(sorted(at)):
            middle = np.array([[0.0, (a + b) / 2]])
            if b - a > SAME_ARC and self.both.solid and self.both.contains(middle)[0]:
                found.append(np.array([[self.offset, a], [self.offset, b]]))
        return found

    def _pieces(self) -> list[tuple[FloatArray, FloatArray]]:
        """Return the arcs of the boundary with u >= 0, as points in pairs of arrays (u, v)."""
        pieces = []
        for arc in self.both.arcs:
            for a, b in itertools.pairwise(_cuts(arc, (0.0,))):
                if arc.center[0] + arc.radius * math.cos((a + b) / 2) >= 0:
                    u, v = BorderArc(arc.center, arc.radius, a, b).points().T
                    pieces.append((np.maximum(u, 0), v))
        return pieces


def meridian(section: ArcRegion, offset: float) -> Meridian:
    """Return the meridian section of a planar region that rotates about an axis.

    Args:
        section: The region in the coordinates (u, v).
        offset: The distance of the plane from the axis [m], of either sign.
    """
    both = united(section, section.mirrored()) if section.solid else section
    return Meridian(both, abs(offset))


def swept_volume(section: ArcRegion, offset: float, turn: float) -> float:
    """Return the volume that a planar region sweeps by rotating about an axis.

    Args:
        section: The region in the coordinates (u, v).
        offset: The distance of the plane from the axis [m].
        turn: The angle of rotation [rad], at most a full turn.

    Returns:
        The swept volume [m^3] with relative error 1e-12, or 0 for a region with zero area.
    """
    mirrored = section.mirrored()
    if not section.solid:
        return 0.0
    if turn >= _TURN:
        return _TURN * united(section, mirrored).moment()
    d, beyond = abs(offset), turn - math.pi

    def half_turns(u: float) -> float:
        """Return the integral of x atan2(d, x) for x from 0 to u."""
        return u * u / 2 * math.atan2(d, u) + d / 2 * (u - d * math.atan2(u, d)) if d else 0.0

    # At u = `turned`, one of the overlap angles `beyond` + 2 a and `beyond` - 2 a is 0, where a =
    # atan2(d, u).
    turned = d / math.tan(abs(beyond) / 2) if beyond else math.inf

    def shared(u: float) -> float:
        """Return the integral from 0 to u of x times the overlap angle of the arcs at x and -x."""
        near = min(u, turned) if beyond < 0 else u
        total = beyond * near * near / 2 + 2 * half_turns(near)
        if beyond > 0 and u > turned:
            far = beyond * u * u / 2 - 2 * half_turns(u)
            total += far - (beyond * turned * turned / 2 - 2 * half_turns(turned))
        return total

    twice = common(section, mirrored)
    once = section.moment() + mirrored.moment()
    return turn * once - _along(twice.arcs, shared, (0.0, turned))


def _along(
    arcs: Sequence[BorderArc], value: Callable[[float], float], at: Sequence[float]
) -> float:
    with requires("chasles[study]"):
        from scipy.integrate import quad  # noqa: PLC0415

    total = 0.0
    for arc in arcs:
        c, r = float(arc.center[0]), arc.radius

        def rate(t: float, c: float = c, r: float = r) -> float:
            return value(max(c + r * math.cos(t), 0.0)) * r * math.cos(t)

        for a, b in itertools.pairwise(_cuts(arc, at)):
            if c + r * math.cos((a + b) / 2) > 0:
                error = _EXACT * r * value(abs(c) + r)
                total += quad(rate, a, b, epsabs=error, epsrel=_EXACT)[0]
    return total


def _cuts(arc: BorderArc, places: Sequence[float]) -> list[float]:
    """Return the end angles of an arc, and the angles at which u has a specified value."""
    least, most = sorted((arc.start, arc.end))
    cuts = [least, most]
    for place in places:
        cosine = (place - float(arc.center[0])) / arc.radius if arc.radius else math.inf
        if abs(cosine) < 1:
            for angle in (math.acos(cosine), -math.acos(cosine)):
                cuts.append(least + (angle - least) % _TURN)
    return sorted((t for t in cuts if least <= t <= most), reverse=bool(arc.start > arc.end))
