"""What is doubtful of a calibration, in sentences."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .observed.observations import Positions
from .parameters import nominal
from .result import Calibration

FloatArray = NDArray[np.float64]

UNEXPLAINED = 0.01
"""Error of the calibrated robot, in parts of the spread of its tool, from which on the measurements
are taken for those of another robot, or of wrong joints."""
MANY = 0.2
"""Part of the rows that may contradict the others before the whole set is doubtful."""
STILL = math.radians(5)
"""Span of a joint [rad or m] below which its parameters are hardly told apart from others'."""
_ALIKE = 4
"""Decimals of coordinates [rad, m] to which repeated configurations agree."""
FAR_OFF = 0.1, 0.02
"""Change of a parameter [rad, m] that no workshop makes."""


def doubts(found: Calibration) -> tuple[str, ...]:
    """What is doubtful of a result, a sentence each.

    Args:
        found: A calibration.
    """
    return (
        *_poor_fit(found),
        *_rows_off(found),
        *_still_joints(found),
        *_far_off(found),
    )


def _rows_off(found: Calibration) -> Iterator[str]:
    rows = len(found.used)
    left_out = int((~found.used).sum())
    if left_out > MANY * rows:
        yield (
            f"{left_out} of {rows} measured points contradict the others: the measurements do not "
            "belong together, or the base moved between them"
        )
        return
    at = found.observation.configurations
    sizes = found.observation.lengths(found.errors)
    for k in np.unique(at[~found.used]):
        own = at == k
        if not found.used[own].any() and own.sum() > 1:
            yield (
                _exchanged(found, int(k))
                or f"measurement {k + 1}: all {own.sum()} targets are off, by "
                f"{1e3 * sizes[own].min():.3g} mm at least; its joint values may be wrong"
            )
        elif (~found.used[own]).sum() > 1 and (words := _exchanged(found, int(k))):
            yield words


def _exchanged(found: Calibration, k: int) -> str | None:
    """Whether two targets of a configuration are exchanged."""
    measured = found.observation
    if not isinstance(measured, Positions):
        return None
    one, T = measured.at(np.array([k])), found.poses(found.q[[k]])
    worst = 5 * max(found.noise, np.finfo(float).tiny)
    seen = np.flatnonzero(one.seen[0])
    for i, j in itertools.combinations(seen, 2):
        order = np.arange(one.points.shape[1])
        order[[i, j]] = j, i
        other = Positions(one.points[:, order], one.sigma)
        if np.abs(other.errors(T, found.unknowns)).max() < worst:
            return f"measurement {k + 1}: targets {i + 1} and {j + 1} are exchanged"
    return None


def _still_joints(found: Calibration) -> Iterator[str]:
    span = np.ptp(found.q, axis=0)
    for coordinate, width in zip(found.robot.coordinates, span, strict=True):
        shown = f"{math.degrees(width):.2g} deg" if coordinate.unit == "rad" else f"{width:.2g} m"
        if width < STILL:
            yield (
                f"{coordinate.name} moves by {shown} only: what belongs to it is not told apart "
                "from its neighbours; measure with it in other positions"
            )


def _far_off(found: Calibration) -> Iterator[str]:
    units = {item.name: item.unit for item in found.robot.geometry if item.part != "base"}
    for name, change in zip(found.names, found.deviations, strict=True):
        if name in units and abs(change) > FAR_OFF[units[name] == "m"]:
            unit = "m" if units[name] == "m" else "rad"
            yield f"{name} differs by {change:.3g} {unit} from nominal: is its zero another one?"


def _poor_fit(found: Calibration) -> Iterator[str]:
    rest = left(found)
    if rest > UNEXPLAINED * spread(found.robot.fk_p(found.q, nominal(found.robot))):
        yield (
            f"{1e3 * rest:.3g} mm remain after the identification: the measurements may be those "
            "of another robot, or most of them are wrong"
        )
    different = len(np.unique(np.round(found.q, _ALIKE), axis=0))
    if 2 * different < len(found.q):
        yield (
            f"only {different} of {len(found.q)} configurations differ: repeated ones tell nothing "
            "new of the geometry"
        )
    if found.freedoms < len(found.names):
        yield (
            f"{len(found.errors)} measured numbers are few for {len(found.names)} variables: "
            "errors elsewhere may be larger than here"
        )


def left(found: Calibration) -> float:
    """Median error that a calibration leaves [m]."""
    return float(np.median(found.observation.lengths(found.errors)))


def spread(T: FloatArray) -> float:
    """Root mean square distance of the tool from the middle of its positions [m]."""
    return float(np.linalg.norm(T[:, :3, 3].std(0)))
