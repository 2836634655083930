"""Warnings about a calibration: suspicious data, poor fits and implausible parameters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import scipy.special
from numpy.typing import NDArray

from .fitting.noise import CHANCE, LEAST_NOISE, OUTLYING, largest_noise
from .measurements.tool_measurements import Positions
from .parameters import FRAMES, nominal
from .result import Calibration

FloatArray = NDArray[np.float64]

UNEXPLAINED = 0.01
"""Error of the calibrated robot, in parts of the spread of its tool, from which on the measurements
are taken for those of another robot, or of wrong joints."""
UNSTATED = 2.0
"""Factor by which devices exceed the noise that is stated of them, and by chance beyond."""
NOISY = 10.0
"""Factor, likewise, from which on the varied parameters do not explain the measurements."""
LEAST_SPREAD = 1e-6
"""Spread of a tool [m] below which it only turns, and tells nothing of lengths."""
MANY = 0.2
"""Part of the rows that may contradict the others before the whole set is doubtful."""
STILL = math.radians(5)
"""Span of a revolute joint [rad] below which its parameters are hardly told apart from others'; of
a prismatic joint, in parts of the spread of the tool."""
_ALIKE = 4
"""Decimals of coordinates [rad, m] to which repeated configurations agree."""
FAR_OFF = 0.1, 0.01
"""Change of a parameter [rad, m] that no workshop makes, less what noise makes of it."""


def diagnose(found: Calibration) -> tuple[str, ...]:
    """Return the warnings about a result, one sentence each.

    Args:
        found: A calibration.
    """
    return (
        *_poor_fit(found),
        *_rows_off(found),
        *_still_joints(found),
        *_beyond_tolerances(found),
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
    at = found.measurements.configurations
    sizes = found.measurements.lengths(found.errors)
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
    measured = found.measurements
    if not isinstance(measured, Positions):
        return None
    one, T = measured.at(np.array([k])), found.poses(found.q[[k]])
    worst = OUTLYING * max(found.noise, LEAST_NOISE)
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
    moved = spread(found.robot.fk_p(found.q, nominal(found.robot)))
    for coordinate, width in zip(found.robot.coordinates, span, strict=True):
        turns = coordinate.unit == "rad"
        shown = f"{math.degrees(width):.2g} deg" if turns else f"{width:.2g} m"
        if width < STILL * (1.0 if turns else min(moved, 1.0)):
            yield (
                f"{coordinate.name} moves by {shown} only: what belongs to it is not told apart "
                "from its neighbours; measure with it in other positions"
            )


def _beyond_tolerances(found: Calibration) -> Iterator[str]:
    for name, change, size in zip(found.names, found.deviations, found.parameter_std, strict=True):
        if size and abs(change) > OUTLYING * size:
            yield (
                f"{name} differs from nominal by {abs(change) / size:.3g} times its tolerance: is "
                "another robot measured?"
            )


def _far_off(found: Calibration) -> Iterator[str]:
    units = {item.name: item.unit for item in found.robot.geometry if item.part not in FRAMES}
    reach = -scipy.special.stdtrit(found.residual_dof, CHANCE) * found.std
    for name, change, half in zip(found.names, found.deviations, reach, strict=True):
        if name in units and abs(change) - half > FAR_OFF[units[name] == "m"]:
            unit = "m" if units[name] == "m" else "rad"
            yield f"{name} differs by {change:.3g} {unit} from nominal: is its zero another one?"


def _poor_fit(found: Calibration) -> Iterator[str]:
    if is_unexplained(found):
        yield (
            f"{1e3 * left(found):.3g} mm remain after the identification: the measurements may be "
            "those of another robot, or most of them are wrong"
        )
    elif found.noise > NOISY * largest_noise(found.residual_dof):
        yield (
            f"errors are {found.noise:.3g} times the stated noise ({found.measurements.stated}): "
            "other parameters than the varied ones differ, another robot is measured, or sigma is "
            "too small"
        )
    different = len(np.unique(np.round(found.q, _ALIKE), axis=0))
    if 2 * different < len(found.q):
        yield (
            f"only {different} of {len(found.q)} configurations differ: repeated ones tell nothing "
            "new of the geometry"
        )
    count = int(found.used[found.measurements.rows].sum())
    if 2 * found.residual_dof < count:
        yield (
            f"{count} measured numbers are few: the {len(found.names)} variables follow "
            f"{count - found.residual_dof} of them, and errors elsewhere may be larger than here"
        )


def is_unexplained(found: Calibration) -> bool:
    """Whether a calibration leaves more than the stated noise and parts of the motion.

    Args:
        found: A calibration.
    """
    moved = spread(found.robot.fk_p(found.q, nominal(found.robot)))
    excess = found.noise / largest_noise(found.residual_dof)
    return moved >= LEAST_SPREAD and left(found) > UNEXPLAINED * moved and excess > UNSTATED


def left(found: Calibration) -> float:
    """Median error that a calibration leaves [m]."""
    return float(np.median(found.measurements.lengths(found.errors)))


def spread(T: FloatArray) -> float:
    """Root mean square distance of the tool from the middle of its positions [m]."""
    return float(np.linalg.norm(T[:, :3, 3].std(0)))
