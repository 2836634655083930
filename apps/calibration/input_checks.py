"""Mistakes in the input that another reading of it corrects, one or two at a time.

The nominal robot fits measurements to a few hundredths of their spread, and the calibrated one far
better. Where one does not, it is tried with other units, with the sign or the zero of a joint
turned, with the columns of two joints exchanged, with a joint added to a later one, as controllers
write that drive parallel links, with rows shifted by one, in a left-handed frame, and with other
readings of orientations.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

from .diagnostics import LEAST_SPREAD, is_unexplained, left, spread
from .fitting.problem import problem_at
from .measurements.tool_measurements import Measurements
from .parameters import nominal
from .result import Calibration

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

DOUBTFUL = 0.05
"""Error of the nominal robot, in parts of the spread of its tool, from which on mistakes are
tried."""
BETTER = 10.0
"""Factor by which the error falls without the mistake."""
MUCH_BETTER = 3.0
"""Factor by which the error of a calibrated robot falls without the mistake."""
_TRIED = 3
"""Mistakes that are tried with a calibration, those first that fit the nominal robot best."""
_LENGTHS = {
    "positions are in millimetres": 1e-3,
    "positions are in metres, not in millimetres": 1e3,
}
_ANGLES = {
    "joint angles are in degrees": math.pi / 180,
    "joint angles are in radians, not in degrees": 180 / math.pi,
}
_SLIDES = {
    "coordinates of slides are in millimetres": 1e-3,
    "coordinates of slides are in metres, not in millimetres": 1e3,
}
_NEIGHBOURS = 2
"""Joints between which a value may be added."""
_FEW = 6
"""Rows below which measurements fit other joints by chance; their units are still told."""
_ALIKE = 1.5
"""Ratio of misfits that tells nothing: a wrist whose pitch has the other sign is one whose roll has
its zero half a turn away. The mistake that comes first is the more frequent one."""


class Mistake(NamedTuple):
    """A mistake that measurements may have.

    Attributes:
        words: The mistake, as the end of a sentence "it fits better if ...".
        q: (N, n) coordinates without it.
        measurements: The measurements without it.
        factor: By which their lengths are multiplied.
    """

    words: str
    q: FloatArray
    measurements: Measurements
    factor: float = 1.0


def mistakes(robot: Robot, q: FloatArray, measured: Measurements) -> Iterator[Mistake]:
    """Mistakes that coordinates and measurements may have, with both as they are without it.

    Args:
        robot: The nominal robot.
        q: (N, n) coordinates as they were given.
        measured: The measurements, likewise.
    """
    turning = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    for words, factor in _LENGTHS.items():
        yield Mistake(words, q, measured.scaled(factor), factor)
    for kind, units in ((turning, _ANGLES), (~turning, _SLIDES)):
        for words, factor in units.items():
            if kind.any():
                yield Mistake(words, np.where(kind, factor * q, q), measured)
    if len(q) < _FEW:
        return
    names = [coordinate.name for coordinate in robot.coordinates]
    for words, corrected in (*_wrong_joints(names, q), *_wrong_zeros(names, q, turning)):
        yield Mistake(words, corrected, measured)
    for words, corrected in _added(names, q, turning):
        yield Mistake(words, corrected, measured)
    yield from _shifted_rows(q, measured)
    for words, otherwise in measured.read_otherwise():
        yield Mistake(words, q, otherwise)


def _wrong_joints(names: Sequence[str], q: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Signs that are turned, columns that are exchanged."""
    for k, name in enumerate(names):
        yield f"the sign of {name} is turned", np.where(np.arange(len(names)) == k, -q, q)
    for i, j in itertools.combinations(range(len(names)), 2):
        order = list(range(len(names)))
        order[i], order[j] = j, i
        yield f"the columns of {names[i]} and {names[j]} are exchanged", q[:, order]


def _wrong_zeros(
    names: Sequence[str], q: FloatArray, turning: BoolArray
) -> Iterator[tuple[str, FloatArray]]:
    """Zeros a quarter or half a turn away; the last joint's zero is that of the unknown tool."""
    for k in np.flatnonzero(turning).tolist():
        for degrees in (90, -90, 180):
            corrected = q.copy()
            corrected[:, k] -= math.radians(degrees)
            yield f"the zero of {names[k]} is off by {degrees} deg", corrected


def _added(
    names: Sequence[str], q: FloatArray, turning: BoolArray
) -> Iterator[tuple[str, FloatArray]]:
    """A joint's value that contains that of an earlier one."""
    for i, j in itertools.combinations(np.flatnonzero(turning).tolist(), 2):
        if j - i <= _NEIGHBOURS:
            for word, sign in (("added to", 1.0), ("subtracted from", -1.0)):
                corrected = q.copy()
                corrected[:, j] -= sign * q[:, i]
                yield f"{names[i]} is {word} {names[j]}", corrected


def _shifted_rows(q: FloatArray, measured: Measurements) -> Iterator[Mistake]:
    """Coordinates beside the measurements of the row before or behind."""
    every = np.arange(len(q))
    yield Mistake("coordinates stand one row too late", q[1:], measured.at(every[:-1]))
    yield Mistake("coordinates stand one row too early", q[:-1], measured.at(every[1:]))


def check_input(
    robot: Robot, q: FloatArray, p: FloatArray, measurements: Measurements, stated: float
) -> None:
    """Raises where measurements fit the nominal robot only without a mistake.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        p: Its nominal geometry.
        measurements: The measurements.
        stated: Their misfit as they were given.

    Raises:
        InputValueError: They fit ten times better without a mistake, which the message names.
    """
    moved = spread(robot.fk_p(q, p))
    if moved < LEAST_SPREAD or stated <= DOUBTFUL * moved:
        return
    tried = _tried(robot, q, p, measurements)
    misfit, mistake = _likely(tried)
    if BETTER * misfit >= stated and len(q) >= _FEW:
        misfit, mistake = min(_pairs(robot, p, tried), key=_misfit)
    if BETTER * misfit < stated:
        raise InputValueError(_sentence("nominal", stated, misfit, mistake))


def check_result(found: Calibration, vary: Collection[str]) -> None:
    """Raises where the calibrated robot misses the measurements, but not without a mistake.

    Args:
        found: A calibration.
        vary: The parameters that were varied.

    Raises:
        InputValueError: It fits three times better without a mistake, which the message names.
    """
    if not is_unexplained(found):
        return
    p, rest = nominal(found.robot), left(found)
    tried = _tried(found.robot, found.q, p, found.measurements)
    for _, mistake in sorted(tried, key=_misfit)[:_TRIED]:
        start = mistake.measurements.start(found.robot.fk_p(mistake.q, p))
        problem = problem_at(found.robot, mistake.q, start, vary)
        try:
            without = left(problem.solved(problem.x0, robust=True)) / mistake.factor
        except InputValueError:
            continue  # Without this mistake the measurements contradict one another.
        if MUCH_BETTER * without < rest:
            raise InputValueError(_sentence("calibrated", rest, without, mistake))


def _tried(
    robot: Robot, q: FloatArray, p: FloatArray, measurements: Measurements
) -> list[tuple[float, Mistake]]:
    """The misfit of the nominal robot without each mistake, the more frequent ones first."""
    return [
        (m.measurements.start(robot.fk_p(m.q, p)).misfit / m.factor, m)
        for m in mistakes(robot, q, measurements)
    ]


def _misfit(pair: tuple[float, Mistake]) -> float:
    return pair[0]


def _likely(tried: list[tuple[float, Mistake]]) -> tuple[float, Mistake]:
    """The most frequent mistake of those that explain the misfit alike."""
    least = _ALIKE * min(map(_misfit, tried))
    return next(pair for pair in tried if pair[0] <= least)


def _pairs(
    robot: Robot, p: FloatArray, tried: list[tuple[float, Mistake]]
) -> Iterator[tuple[float, Mistake]]:
    """The best pairs of mistakes, of which the first are those that help most alone."""
    for _, one in sorted(tried, key=_misfit)[:_TRIED]:
        misfit, other = _likely(_tried(robot, one.q, p, one.measurements))
        words = f"{one.words}, and {other.words}"
        yield misfit / one.factor, other._replace(words=words, factor=one.factor * other.factor)


def _sentence(robot: str, stated: float, without: float, mistake: Mistake) -> str:
    times = f"{stated / without:.0f} times " if without > 0 else ""
    remedy = "units" if mistake.words in _LENGTHS | _ANGLES | _SLIDES else "table"
    return (
        f"identify: the measurements miss the {robot} robot by {stated:.3g} m; they fit {times}"
        f"better if {mistake.words}. Correct the {remedy}"
    )
