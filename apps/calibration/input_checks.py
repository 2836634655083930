"""Checks for one or two mistakes in the input of a calibration, such as wrong units.

The nominal robot normally fits the measurements to a few percent of their spread. The calibrated
robot fits the measurements far better than the nominal robot. If the misfit of the nominal robot
exceeds a few percent of the measurements' spread, the checks repeat the fit with corrected input.
The checks try other units, other joint signs, other joint zeros, and swapped joint columns. One
check assumes that a joint column contains the sum or difference of the joint's own angle and the
angle of an earlier joint. Controllers of arms with parallel links report such sums of joint angles.
The checks also try shifted rows, a left-handed frame and other orientation conventions.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

from .diagnostics import MIN_SPREAD, is_unexplained, left, spread
from .fitting.problem import problem_at
from .measurements.tool_measurements import Measurements
from .parameters import nominal
from .result import Calibration

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

DOUBTFUL = 0.05
"""The input is checked for mistakes if the nominal robot's misfit exceeds this fraction of the tool
position spread."""
BETTER = 10.0
"""An input mistake is reported if its correction reduces the nominal robot's misfit by more than
this factor."""
MUCH_BETTER = 3.0
"""An input mistake is reported if its correction reduces the calibrated robot's median error by
more than this factor."""
_TRIED = 3
"""Number of the most likely input mistakes that are examined further, by a full calibration or in
combination with a second mistake."""
_LENGTHS = {
    "positions are in millimeters": 1e-3,
    "positions are in meters, not in millimeters": 1e3,
}
_ANGLES = {
    "joint angles are in degrees": math.pi / 180,
    "joint angles are in radians, not in degrees": 180 / math.pi,
}
_SLIDES = {
    "prismatic coordinates are in millimeters": 1e-3,
    "prismatic coordinates are in meters, not in millimeters": 1e3,
}
_NEIGHBOURS = 2
"""The checks test whether the encoder of joint j also measures joint i if the index difference j -
i is at most this value."""
_MIN_SURPLUS = 9
"""Minimum number of redundant equations for the checks of joints, rows and conventions. With fewer
redundant equations, wrong input may fit by chance."""
_ALIKE = 1.5
"""Two input mistakes count as equally likely if the ratio of their misfits is at most this value.
Of two equally likely mistakes, the error message names the mistake that is more common in practice.
For example, a wrong sign of the wrist pitch has the same effect as a roll zero offset of 180 deg.
"""


class Mistake(NamedTuple):
    """A possible mistake in the input of a calibration, together with the corrected input.

    Attributes:
        words: The mistake, as the end of the sentence "the measurements fit better if ...".
        q: (N, n) corrected coordinates.
        measurements: The corrected measurements.
        factor: Factor that converts the measured lengths to the correct unit, 1 if their unit is
            correct.
    """

    words: str
    q: FloatArray
    measurements: Measurements
    factor: float = 1.0

    def comparable(self, misfit: float) -> float:
        """Return the misfit of the corrected input [m], for comparison with other corrections.

        A correction that multiplies all lengths by a factor below 1 also reduces the misfit by this
        factor. The function therefore divides the misfit by a length factor below 1, and leaves the
        misfit unchanged for all other length factors.
        """
        return misfit / min(self.factor, 1.0)


def mistakes(robot: Robot, q: FloatArray, measured: Measurements) -> Iterator[Mistake]:
    """Yield each possible input mistake together with the corrected input.

    Args:
        robot: The nominal robot.
        q: (N, n) coordinates of the input, before any correction.
        measured: The measurements of the input, before any correction.
    """
    turning = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    for words, factor in _LENGTHS.items():
        yield Mistake(words, q, measured._scaled(factor), factor)
    for mistake in _table_mistakes(robot, q, measured, turning):
        if mistake.measurements._surplus >= _MIN_SURPLUS:
            yield mistake


def _table_mistakes(
    robot: Robot, q: FloatArray, measured: Measurements, turning: BoolArray
) -> Iterator[Mistake]:
    """Yield possible mistakes in coordinate units, joints, rows and orientation conventions."""
    for kind, units in ((turning, _ANGLES), (~turning, _SLIDES)):
        for words, factor in units.items():
            if kind.any():
                yield Mistake(words, np.where(kind, factor * q, q), measured)
    names = [coordinate.name for coordinate in robot.coordinates]
    for words, corrected in (*_wrong_joints(names, q), *_wrong_zeros(names, q, turning)):
        yield Mistake(words, corrected, measured)
    for words, corrected in _added(names, q, turning):
        yield Mistake(words, corrected, measured)
    yield from _shifted_rows(q, measured)
    for words, otherwise in measured._read_otherwise():
        yield Mistake(words, q, otherwise)


def _wrong_joints(names: Sequence[str], q: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Yield corrected coordinates for wrong signs and for swapped columns."""
    for k, name in enumerate(names):
        yield f"the sign of {name} is reversed", np.where(np.arange(len(names)) == k, -q, q)
    for i, j in itertools.combinations(range(len(names)), 2):
        order = list(range(len(names)))
        order[i], order[j] = j, i
        yield f"the columns of {names[i]} and {names[j]} are swapped", q[:, order]


def _wrong_zeros(
    names: Sequence[str], q: FloatArray, turning: BoolArray
) -> Iterator[tuple[str, FloatArray]]:
    """Yield corrected coordinates for joint zeros that are off by 90 or 180 deg."""
    for k in np.flatnonzero(turning).tolist():
        for degrees in (90, -90, 180):
            corrected = q.copy()
            corrected[:, k] -= math.radians(degrees)
            yield f"the zero of {names[k]} is off by {degrees} deg", corrected


def _added(
    names: Sequence[str], q: FloatArray, turning: BoolArray
) -> Iterator[tuple[str, FloatArray]]:
    """Yield corrected coordinates for an encoder that also measures the motion of another joint.

    The other joint is earlier in the chain.
    """
    for i, j in itertools.combinations(np.flatnonzero(turning).tolist(), 2):
        if j - i <= _NEIGHBOURS:
            for word, sign in (("added to", 1.0), ("subtracted from", -1.0)):
                corrected = q.copy()
                corrected[:, j] -= sign * q[:, i]
                yield f"{names[i]} is {word} {names[j]}", corrected


def _shifted_rows(q: FloatArray, measured: Measurements) -> Iterator[Mistake]:
    """Yield corrected input for coordinates that are recorded one row too late or too early."""
    every = np.arange(len(q))
    yield Mistake("coordinates are one row too late", q[1:], measured.at(every[:-1]))
    yield Mistake("coordinates are one row too early", q[:-1], measured.at(every[1:]))


def check_input(
    robot: Robot, q: FloatArray, p: FloatArray, measurements: Measurements, stated: float
) -> None:
    """Raise an error if the nominal robot fits only after correcting a mistake in the input.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        p: The nominal geometry.
        measurements: The measurements.
        stated: Misfit of the input before any correction [m].

    Raises:
        InputValueError: A corrected input fits much better. The message states the probable
            mistake.
    """
    moved = spread(robot.fk_p(q, p))
    if moved < MIN_SPREAD or stated <= DOUBTFUL * moved:
        return
    tried = _tried(robot, q, p, measurements)
    misfit, mistake = _likely(tried)
    if BETTER * misfit >= stated and measurements._surplus >= _MIN_SURPLUS:
        misfit, mistake = min(_pairs(robot, p, tried), key=_misfit)
    if BETTER * misfit < stated:
        raise InputValueError(_sentence("nominal", stated, misfit, mistake))


def check_result(found: Calibration, vary: Collection[str]) -> None:
    """Raise an error if the calibrated robot fits only after correcting a mistake in the input.

    Args:
        found: A calibration.
        vary: The varied parameters.

    Raises:
        InputValueError: A corrected input fits much better. The message states the probable
            mistake.
    """
    if not is_unexplained(found):
        return
    p, rest = nominal(found.robot), left(found)
    tried = _tried(found.robot, found.q, p, found.measurements)
    for _, mistake in sorted(tried, key=_misfit)[:_TRIED]:
        start = mistake.measurements._start(found.robot.fk_p(mistake.q, p))
        problem = problem_at(found.robot, mistake.q, start, vary)
        try:
            without = mistake.comparable(left(problem.solved(problem.x0, robust=True)))
        except InputValueError:
            continue  # The corrected measurements are inconsistent with each other.
        if MUCH_BETTER * without < rest:
            raise InputValueError(_sentence("calibrated", rest, without, mistake))


def _tried(
    robot: Robot, q: FloatArray, p: FloatArray, measurements: Measurements
) -> list[tuple[float, Mistake]]:
    return [
        (m.comparable(m.measurements._start(robot.fk_p(m.q, p)).misfit), m)
        for m in mistakes(robot, q, measurements)
    ]


def _misfit(pair: tuple[float, Mistake]) -> float:
    return pair[0]


def _likely(tried: list[tuple[float, Mistake]]) -> tuple[float, Mistake]:
    """Return the first input correction that fits almost as well as the best input correction."""
    least = _ALIKE * min(map(_misfit, tried))
    return next(pair for pair in tried if pair[0] <= least)


def _pairs(
    robot: Robot, p: FloatArray, tried: list[tuple[float, Mistake]]
) -> Iterator[tuple[float, Mistake]]:
    for _, one in sorted(tried, key=_misfit)[:_TRIED]:
        misfit, other = _likely(_tried(robot, one.q, p, one.measurements))
        words = f"{one.words}, and {other.words}"
        yield one.comparable(misfit), other._replace(words=words, factor=one.factor * other.factor)


def _sentence(robot: str, stated: float, without: float, mistake: Mistake) -> str:
    times = f"{stated / without:.0f} times " if without > 0 else ""
    remedy = "units" if mistake.words in _LENGTHS | _ANGLES | _SLIDES else "table"
    return (
        f"identify: the {robot} robot misfits the measurements by {stated:.3g} m; they fit {times}"
        f"better if {mistake.words}. Correct the {remedy}"
    )
