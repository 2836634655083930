"""Overconstrained loops that cannot all close: the configuration nearest to closure, and its gaps.

Loops repeat constraints where their equations are more than the unknown variables need: a pin whose
axis is parallel to the others of its loop holds the plane once more, a third crank of a
parallelogram the coupler's direction. As built, such constraints contradict each other a little.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.mechanism import Closure, Mechanism, Strut
from ...model.tolerances import GAP, MEASURED_STRUCTURE, REPEATED_AS_BUILT, REPEATED_EQUATION
from ..checks.bodies_in_numbers import BodiesInNumbers
from ..closing import swings_at

Floats = NDArray[np.float64]
TOLD = 0.05
"""Part of the largest gap below which a gap is not told."""


@dataclass(frozen=True)
class LeftOpen:
    """Loops that repeat constraints and cannot all close.

    Attributes:
        at: The configuration of the least sum of squared gaps at the reference's actuated
            coordinates: values of joints and cylinders (radian or metre), by name.
        repeated: Number of constraints beyond those that the unknown variables need.
        gaps: What stays open there, in words, by closure or strut; the widest first.
        spare: Names of the closures and struts without which the others hold the mechanism.
    """

    at: Mapping[str, float]
    repeated: int
    gaps: Mapping[str, str]
    spare: tuple[str, ...]

    def __str__(self) -> str:
        """The redundant constraints and how far they are open."""
        open_ = ", ".join(f"{name!r} {gap}" for name, gap in self.gaps.items())
        many = "1 constraint is" if self.repeated == 1 else f"{self.repeated} constraints are"
        told = f"{many} redundant, and at best there stay open {open_}"
        if not self.spare:
            return told
        spare = " or ".join(map(repr, self.spare))
        return f"{told}; without {spare} the others hold the mechanism"


def left_open(mechanism: Mechanism) -> LeftOpen | None:
    """The overconstrained loops that cannot all close near the reference.

    None where all loops close, where no equation repeats others, where a gap is wider than errors
    of a robot as built leave, or where actuated coordinates work against each other.
    """
    bodies = BodiesInNumbers(mechanism)
    closers = [closer.name for closer in mechanism.closers]
    at = bodies.nearest(bodies.values, bodies.unknown, closers)
    gaps = bodies.gaps(at)
    if bodies.all_closed(at, closers) or not all(
        max(gaps[closer.name].distance / bodies.size, gaps[closer.name].turn)
        <= MEASURED_STRUCTURE * _joints(mechanism, closer)
        for closer in mechanism.closers
    ):
        return None
    rows = bodies.slopes(at, bodies.unknown, closers)
    J = np.concatenate([rows[name] for name in closers])
    if _rank(J, REPEATED_EQUATION) < J.shape[1] or J.shape[0] == J.shape[1]:
        return None
    every = bodies.slopes(at, tuple(mechanism.members), closers)
    if _rank(np.concatenate([every[name] for name in closers]), REPEATED_AS_BUILT) > J.shape[1]:
        return None
    spare = tuple(
        name
        for name in closers
        if _rank(
            np.concatenate([rows[other] for other in closers if other != name] or [J[:0]]),
            REPEATED_AS_BUILT,
        )
        == J.shape[1]
    )
    told = _told(bodies, mechanism.closers, at)
    return LeftOpen(at | swings_at(mechanism, at), J.shape[0] - J.shape[1], told, spare)


def _joints(mechanism: Mechanism, closer: Closure | Strut) -> int:
    """Number of joints around a loop, its closer included: their errors add up."""
    one, other = ({joint.name for joint in mechanism.way(f.body)} for f in (closer.a, closer.b))
    return len(one ^ other) + 1


def _rank(J: Floats, least: float) -> int:
    """Number of singular values above a part of the largest."""
    values = np.linalg.svd(J, compute_uv=False) if J.size else np.zeros(0)
    return int(np.sum(values > least * max(values, default=0.0)))


def _told(
    bodies: BodiesInNumbers, closers: Sequence[Closure | Strut], at: Mapping[str, float]
) -> dict[str, str]:
    gaps = bodies.gaps(at)
    sizes = {name: gap.distance / bodies.size + gap.turn for name, gap in gaps.items()}
    widest = max(sizes.values())
    found = {}
    for closer in sorted(closers, key=lambda closer: -sizes[closer.name]):
        if sizes[closer.name] < TOLD * widest:
            continue
        gap, parts = gaps[closer.name], []
        if gap.distance > GAP * bodies.size:
            parts.append(f"{_distance(bodies, closer, at)}")
        if gap.turn > GAP:
            parts.append(f"{1e3 * gap.turn:.3g} mrad out of direction")
        found[closer.name] = "by " + " and ".join(parts)
    return found


def _distance(bodies: BodiesInNumbers, closer: Closure | Strut, at: Mapping[str, float]) -> str:
    """A distance in words; of a pin, along its axis and across it."""
    gap = bodies.gaps(at)[closer.name].distance
    if isinstance(closer, Strut):
        return f"{1e3 * gap:.3g} mm of its length"
    if closer.kind != "pin":
        return f"{1e3 * gap:.3g} mm"
    A, _, d = bodies.ends(closer, at)
    along = abs(float(A[:3, 2] @ d))
    across = float(np.sqrt(max(gap**2 - along**2, 0.0)))
    parts = [(along, "along its axis"), (across, "across its axis")]
    return " and ".join(f"{1e3 * v:.3g} mm {way}" for v, way in parts if v > TOLD * gap)
