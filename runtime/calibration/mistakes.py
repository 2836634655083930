"""Mistakes in the input that another reading of it corrects: units, signs, columns, quaternions.

The nominal robot fits measurements to a few hundredths of their spread, and the calibrated one far
better. Where one does not, it is tried with other units, with the sign of a joint turned, with the
columns of two joints exchanged, and with other readings of orientations.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputValueError
from .doubts import UNEXPLAINED, left, spread
from .fitting.problem import problem_at
from .observed.observations import Observation
from .parameters import nominal
from .result import Calibration

FloatArray = NDArray[np.float64]

LEAST_SPREAD = 1e-6
"""Spread of a tool [m] below which it only turns, and tells nothing of lengths."""
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


class Mistake(NamedTuple):
    """A mistake that measurements may have.

    Attributes:
        words: The mistake, as the end of a sentence "it fits better if ...".
        q: (N, n) coordinates without it.
        observation: The measurements without it.
        factor: By which their lengths are multiplied.
    """

    words: str
    q: FloatArray
    observation: Observation
    factor: float = 1.0


def mistakes(robot: Any, q: FloatArray, measured: Observation) -> Iterator[Mistake]:
    """Other units, joints with the other sign, pairs of joints exchanged, orientations read anew.

    Args:
        robot: The nominal robot.
        q: (N, n) coordinates as they were given.
        measured: The measurements, likewise.
    """
    names = [coordinate.name for coordinate in robot.coordinates]
    turning = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    for words, factor in _LENGTHS.items():
        yield Mistake(words, q, measured.scaled(factor), factor)
    for words, factor in _ANGLES.items():
        yield Mistake(words, np.where(turning, factor * q, q), measured)
    for k, name in enumerate(names):
        signs = np.where(np.arange(len(names)) == k, -1.0, 1.0)
        yield Mistake(f"the sign of {name} is turned", signs * q, measured)
    for i, j in itertools.combinations(range(len(names)), 2):
        order = list(range(len(names)))
        order[i], order[j] = j, i
        words = f"the columns of {names[i]} and {names[j]} are exchanged"
        yield Mistake(words, q[:, order], measured)
    for words, otherwise in measured.read_otherwise():
        yield Mistake(words, q, otherwise)


def check_input(
    robot: Any, q: FloatArray, p: FloatArray, observation: Observation, stated: float
) -> None:
    """Raises where measurements fit the nominal robot only without a mistake.

    Args:
        robot: A robot with parametric functions.
        q: (N, n) coordinates [rad or m].
        p: Its nominal geometry.
        observation: The measurements.
        stated: Their misfit as they were given.

    Raises:
        InputValueError: They fit ten times better without a mistake, which the message names.
    """
    moved = spread(robot.fk_p(q, p))
    if moved < LEAST_SPREAD or stated <= DOUBTFUL * moved:
        return
    ranked = _ranked(robot, q, p, observation)
    misfit, mistake = ranked[0]
    if BETTER * misfit < stated:
        raise InputValueError(_sentence("nominal", stated, misfit, mistake))


def check_result(found: Calibration, vary: tuple[str, ...]) -> None:
    """Raises where the calibrated robot misses the measurements, but not without a mistake.

    Args:
        found: A calibration.
        vary: The parameters that were varied.

    Raises:
        InputValueError: It fits three times better without a mistake, which the message names.
    """
    p, rest = nominal(found.robot), left(found)
    moved = spread(found.robot.fk_p(found.q, p))
    if moved < LEAST_SPREAD or rest <= UNEXPLAINED * moved:
        return
    for _, mistake in _ranked(found.robot, found.q, p, found.observation)[:_TRIED]:
        start = mistake.observation.start(found.robot.fk_p(mistake.q, p))
        problem = problem_at(found.robot, mistake.q, start, vary)
        try:
            without = left(problem.solved(problem.x0, robust=True)) / mistake.factor
        except InputValueError:
            continue  # Without this mistake the measurements contradict one another.
        if MUCH_BETTER * without < rest:
            raise InputValueError(_sentence("calibrated", rest, without, mistake))


def _ranked(
    robot: Any, q: FloatArray, p: FloatArray, observation: Observation
) -> list[tuple[float, Mistake]]:
    """Mistakes, and the misfit of the nominal robot without them, the best first."""
    found = [
        (m.observation.start(robot.fk_p(m.q, p)).misfit / m.factor, m)
        for m in mistakes(robot, q, observation)
    ]
    return sorted(found, key=lambda pair: pair[0])


def _sentence(robot: str, stated: float, without: float, mistake: Mistake) -> str:
    times = f"{stated / without:.0f} times " if without > 0 else ""
    remedy = "units" if mistake.words in _LENGTHS | _ANGLES else "table"
    return (
        f"identify: the measurements miss the {robot} robot by {stated:.3g} m; they fit {times}"
        f"better if {mistake.words}. Correct the {remedy}"
    )
