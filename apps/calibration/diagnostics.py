"""Warnings about a calibration: suspicious data, poor fits and implausible parameters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import scipy.special
from numpy.typing import NDArray

from .fitting.noise import CHANCE, MIN_NOISE, OUTLYING, largest_noise
from .measurements.tool_measurements import Positions
from .parameters import FRAMES, nominal
from .result import Calibration

FloatArray = NDArray[np.float64]

UNEXPLAINED = 0.01
"""Maximum plausible median error of a calibrated robot, relative to the spread of its tool
positions. A larger error suggests that the measurements belong to another robot or that joint
values are wrong."""
UNSTATED = 2.0
"""Maximum plausible ratio of the actual noise of a device to its stated noise."""
NOISY = 10.0
MIN_SPREAD = 1e-6
"""Minimum root mean square spread of the tool positions [m]. A motion with less spread counts as a
pure rotation of the tool."""
MANY = 0.2
"""Maximum fraction of outliers among the measured points. A larger fraction of outliers suggests
that the whole measurement table is wrong."""
STILL = math.radians(5)
"""Minimum range of motion of a revolute joint [rad] for which the joint's parameters are
identifiable. For a prismatic joint, the minimum range is this value times the spread of the tool
positions, with the spread limited to 1 m."""
_ALIKE = 4
"""Configurations count as repeated if their coordinates [rad, m] agree to this number of decimal
places."""
FAR_OFF = 0.1, 0.01
"""Maximum plausible change of a parameter from its nominal value, for angles [rad] and lengths [m].
The part of a parameter change that noise may cause is subtracted before the comparison."""


def diagnose(found: Calibration) -> tuple[str, ...]:
    """Return all warnings about a calibration, one sentence each."""
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
            f"{left_out} of {rows} measured points contradict the others: some come from another "
            "setup, or the base moved between them"
        )
        return
    at = found.measurements.configurations
    sizes = found.measurements._lengths(found.errors)
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
    """Return a warning if two targets of configuration k are swapped, otherwise None."""
    measured = found.measurements
    if not isinstance(measured, Positions):
        return None
    one, T = measured.at(np.array([k])), found.poses(found.q[[k]])
    worst = OUTLYING * max(found.noise, MIN_NOISE)
    seen = np.flatnonzero(one._seen[0])
    for i, j in itertools.combinations(seen, 2):
        order = np.arange(one.points.shape[1])
        order[[i, j]] = j, i
        other = Positions(one.points[:, order], one.sigma)
        if np.abs(other._errors(T, found.unknowns)).max() < worst:
            return f"measurement {k + 1}: targets {i + 1} and {j + 1} are swapped"
    return None


def _still_joints(found: Calibration) -> Iterator[str]:
    span = np.ptp(found.q, axis=0)
    moved = spread(found.robot.fk_p(found.q, nominal(found.robot)))
    for coordinate, width in zip(found.robot.coordinates, span, strict=True):
        turns = coordinate.unit == "rad"
        shown = f"{math.degrees(width):.2g} deg" if turns else f"{width:.2g} m"
        if width < STILL * (1.0 if turns else min(moved, 1.0)):
            yield (
                f"{coordinate.name} moves by only {shown}: its parameters cannot be distinguished "
                "from the parameters of adjacent joints; measure at other positions of this joint"
            )


def _beyond_tolerances(found: Calibration) -> Iterator[str]:
    known = np.flatnonzero(found.parameter_std)
    changes = np.abs(found.deviations[known] / found.parameter_std[known])
    if (changes <= OUTLYING).all() and (changes**2).sum() > scipy.special.chdtri(
        len(known), CHANCE
    ):
        yield (
            f"{len(known)} parameters together differ from nominal by "
            f"{np.sqrt((changes**2).mean()):.3g} times their standard deviations; the measurements "
            "may belong to another robot"
        )
    for k, change in zip(known, changes, strict=True):
        if change > OUTLYING:
            yield (
                f"{found.names[k]} differs from nominal by {change:.3g} times its standard "
                "deviation; the measurements may belong to another robot"
            )


def _far_off(found: Calibration) -> Iterator[str]:
    units = {item.name: item.unit for item in found.robot.geometry if item.part not in FRAMES}
    reach = -scipy.special.stdtrit(found.residual_dof, CHANCE) * found.std
    for name, change, half in zip(found.names, found.deviations, reach, strict=True):
        if name in units and abs(change) - half > FAR_OFF[units[name] == "m"]:
            unit = "m" if units[name] == "m" else "rad"
            yield f"{name} differs from nominal by {change:.3g} {unit}; check its zero offset"


def _poor_fit(found: Calibration) -> Iterator[str]:
    if is_unexplained(found):
        yield (
            f"the median error after the identification is {1e3 * left(found):.3g} mm: the "
            "measurements may belong to another robot, or most of them are wrong"
        )
    elif found.noise > NOISY * largest_noise(found.residual_dof):
        yield (
            f"errors are {found.noise:.3g} times the stated noise ({found.measurements._stated}): "
            "parameters that were not varied differ from nominal, the measurements belong to "
            "another robot, or sigma is too small"
        )
    different = len(np.unique(np.round(found.q, _ALIKE), axis=0))
    if 2 * different < len(found.q):
        yield (
            f"only {different} of {len(found.q)} configurations differ: repeated configurations "
            "give no new information about the geometry"
        )
    count = int(found.used[found.measurements.rows].sum())
    if 2 * found.residual_dof < count:
        yield (
            f"{count} measured values are few: the {len(found.names)} variables absorb "
            f"{count - found.residual_dof} of them, so errors at other configurations may be larger"
        )


def is_unexplained(found: Calibration) -> bool:
    """Return whether calibrated errors are large relative to stated noise and tool motion."""
    moved = spread(found.robot.fk_p(found.q, nominal(found.robot)))
    excess = found.noise / largest_noise(found.residual_dof)
    return moved >= MIN_SPREAD and left(found) > UNEXPLAINED * moved and excess > UNSTATED


def left(found: Calibration) -> float:
    """Return the median error of a calibrated robot [m]."""
    return float(np.median(found.measurements._lengths(found.errors)))


def spread(T: FloatArray) -> float:
    """Return the root mean square distance of the tool positions from their center [m]."""
    return float(np.linalg.norm(T[:, :3, 3].std(0)))
